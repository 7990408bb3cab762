"""What a person slips into a system in Python: one clear sentence each, and nothing is run."""

import pytest

from selflock import master

STEP = {"run": {"stop": 0.002}, "components": {"a": {"part": "small_parts:Gain", "start": {"u": 1.0}}}}


@pytest.fixture
def one():
    system = master.from_dict(STEP)
    system.allow_code = True
    return system


@pytest.mark.parametrize(
    "slip, words",
    [
        (lambda s: setattr(s.run, "algoritm", "jacobi"), ["Run has no field algoritm", "Did you mean algorithm?"]),
        (lambda s: setattr(s, "component", {}), ["System has no field component", "Did you mean components?"]),
        (lambda s: setattr(s.components["a"], "strat", {}), ["Component has no field strat", "Did you mean start?"]),
        (lambda s: s.connections.update({"a.u": "b.y"}), ["system.connections['a.u'] is text ('b.y')", 'master.Connection("']),
        (lambda s: s.connections.update({"a.u": {"from": "b.y"}}), ["is a dictionary", "master.Connection("]),
        (lambda s: s.components.update(b={"fmu": "x.fmu"}), ["system.components['b'] is a dictionary", "master.Component(fmu="]),
        (lambda s: setattr(s, "run", {"stop": 1.0}), ["system.run is a dictionary", "master.Run", "system.run.stop"]),
        (lambda s: setattr(s.run, "step", "fast"), ["[run] step = 'fast'", "a number is wanted"]),
        (lambda s: setattr(s.run, "record", "a.*"), ["[run] record = 'a.*'", "a list of names"]),
        (lambda s: setattr(s.components["a"], "start", [1.0]), ["[components.a] start = [1.0]", "a table is wanted"]),
        (lambda s: s.connections.update({"a.u": master.Connection(3)}), ["[connections] a.u source = 3", "text in quotes"]),
        (lambda s: s.components.update({"a\nb": s.components["a"]}), ["[components] 'a\\nb'", "no line breaks"]),
        (lambda s: s.components.update({"a\x1bb": s.components["a"]}), ["[components] 'a\\x1bb'", "control characters"]),
        (lambda s: s.faults.append({"variable": "a.y"}), ["system.faults holds a dictionary", "master.Fault("]),
    ],
)
def test_a_slip_in_a_system(one, refused, slip, words):
    refused(lambda: (slip(one), master.run(one)), *words)


@pytest.mark.parametrize(
    "given, words",
    [
        (({}, "x.parquet"), ["stop = 'x.parquet' is no number of seconds", 'out="x.parquet"']),
        (({}, "1 s"), ["stop = '1 s' is no number of seconds."]),
        (("a.u=1",), ["settings is text ('a.u=1')", "dictionary"]),
        (([("a.u", 1.0)],), ["settings is a list", "dictionary"]),
        (({}, 1.0, 3), ["out is int (3)", ".parquet"]),
    ],
)
def test_a_slip_in_the_call(one, refused, given, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused(lambda: master.run(one, *given), *words)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("system, words", [(STEP, ["dictionary", "from_dict"]), (None, ["nothing"]), ([1], ["a list ([1])"])])
def test_what_is_no_system(refused, system, words):
    refused(lambda: master.run(system), "run takes", *words)


def test_numbers_of_other_kinds_are_numbers(one):
    import numpy as np

    one.run.stop, one.run.step = np.float32(0.002), np.float64(0.001)
    assert master.run(one, stop=np.int64(1)).steps == 1000


def test_a_name_of_two_lines_is_refused_where_a_file_is_read(tmp_path, refused):
    for text in ('[components."a\\nb"]\npart = "x:Y"', '[components.a]\nfmu = "a\\nb.fmu"', '[drives."a\\tb"]\nratio = 50.0'):
        (tmp_path / "s.toml").write_text(text + "\n")
        said = refused(lambda: master.load(tmp_path / "s.toml"), "a name has no line breaks, tabs or other control characters")
        assert "\n" not in said and "\t" not in said
