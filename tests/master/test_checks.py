"""What is checked before the first step, and what the messages say."""

import math

import pytest

from selflock import master

GAINS = {"a": ("Gain", {"u": 1.0}), "b": "Gain"}


def written(tmp_path, text):
    path = tmp_path / "system.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "text, words",
    [
        ("[components.a]\npart = ", ["system.toml", "TOML"]),
        ("[componets.a]", ["componets", "Did you mean components?"]),
        ("[run]\nsteps = 1", ["[run] has no key steps", "Did you mean step?"]),
        ("[run]\nstep = 'fast'", ["[run] step = 'fast'", "a number"]),
        ("[run]\nstep = true", ["a number"]),
        ("[run]\nrecord = 'a'", ["a list of names"]),
        ("[run]\nalgorithm = 'seidel'", ["seidel", "gauss-seidel", "jacobi"]),
        ("[run]\nstep_control = 'pid'", ["pid", "power, doubling"]),
        ("[components.a]\nstep = 0.1", ["[components.a] needs either fmu", "or part"]),
        ("[components.a]\nfmu = 'x'\npart = 'y:Z'", ["needs either fmu"]),
        ("[connections]\n'a.u' = 'b.y'\n'a.u' = 'c.y'", ["takes one connection only"]),
        ("[connections]\na.u = 'b.y'\n'a.u' = 'c.y'", ["a.u is connected twice"]),
        ("[connections]\n'a.u' = 3", ["component.variable"]),
        ("[connections]\n'a.u' = { from = 'b.y', factr = 2.0 }", ["factr", "Did you mean factor?"]),
        ("[[bonds]]\neffort = 'a.y'", ["[[bonds]]", "flow"]),
        ("[[faults]]\nvariable = 'a.y'\nkind = 'broken'\nstart = 1", ["broken", "stuck"]),
        ("", ["no components"]),
    ],
)
def test_the_file(tmp_path, refused, text, words):
    refused(lambda: master.run(written(tmp_path, text)), *words)


def test_the_path(tmp_path, refused):
    refused(lambda: master.load(tmp_path / "none.toml"), "no system file")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    refused(lambda: master.load(tmp_path / "binary.toml"), "cannot be read")


def test_a_file_says_all_that_a_system_holds(tmp_path):
    path = written(
        tmp_path,
        """
        [system]
        name = "two"
        [run]
        stop = 2
        order = ["b", "a"]
        [components.a]
        part = "small_parts:Gain"
        step = 0.002
        start.gain = 2.0
        [components.b]
        part = "small_parts:Gain"
        [components.b.start]
        "u" = 1
        [connections]
        a.u = { from = "b.y", factor = 3.0, offset = 1.0 }
        [[faults]]
        variable = "b.y"
        kind = "offset"
        start = 1.0
        value = 1.0
        """,
    )
    system = master.load(path)
    assert system.name == "two" and system.run.stop == 2.0 and system.folder == tmp_path
    assert system.components["a"] == master.Component(part="small_parts:Gain", step=0.002, start={"gain": 2.0})
    assert system.connections == {"a.u": master.Connection("b.y", 3.0, 1.0)}
    table = master.run(system, allow_code=True).table.set_index("time")
    assert table["a.y"].iloc[0] == 8.0 and table["a.y"].iloc[-1] == 14.0


@pytest.mark.parametrize(
    "connections, words",
    [
        ({"c.u": "a.y"}, ["no component c"]),
        ({"bb.u": "a.y"}, ["no component bb"]),
        ({"b.v": "a.y"}, ["b has no variable v"]),
        ({"b.u": "a.yy"}, ["a has no variable yy", "Did you mean y?"]),
        ({"b": "a.y"}, ["b should be written as component.variable"]),
        ({"b.y": "a.y"}, ["b.y is no input", "target stands on the left"]),
        ({"b.u": "a.u"}, ["a.u is an input, not an output"]),
        ({"b.u": "a.gain"}, ["a.gain is a parameter, not an output"]),
    ],
)
def test_connections(system, refused, connections, words):
    refused(lambda: master.run(system(GAINS, connections)), *words)


def test_open_inputs(system, refused):
    refused(lambda: master.run(system(GAINS)), "Inputs that nobody gives: b.u", "u = ...", "[components.b.start]")
    assert len(master.run(system(GAINS, open_inputs=True, stop=0.1, step=0.1)).table) == 2
    assert len(master.run(system(GAINS, stop=0.1, step=0.1), settings={"b.u": 0.0}).table) == 2


@pytest.mark.parametrize(
    "target, source, fits",
    [
        ("t.flag", "t.count_out", False),
        ("t.count", "t.flag_out", True),
        ("t.word", "t.flag_out", False),
        ("g.u", "t.flag_out", True),
        ("g.u", "t.count_out", True),
        ("t.count", "g.y", False),
        ("g.u", "t.word_out", False),
        ("t.flag", "g.y", False),
    ],
)
def test_types(system, refused, target, source, fits):
    description = system({"t": "Types", "g": "Gain"}, {target: source}, open_inputs=True, stop=0.1, step=0.1)
    if fits:
        master.run(description)
    else:
        refused(lambda: master.run(description), target, "does not fit into")


def test_units_are_converted(system):
    description = system(
        {"t": "Thermometer"},
        {"t.kelvin": "t.celsius", "t.radians": "t.degrees"},
        open_inputs=True,
        stop=0.1,
        step=0.1,
        record=["t.kelvin", "t.radians"],
    )
    table = master.run(description).table
    assert table["t.kelvin"].iloc[0] == pytest.approx(293.15)
    assert table["t.radians"].iloc[0] == pytest.approx(3.141592653589793)


@pytest.mark.parametrize(
    "target, source, why",
    [
        ("t.kelvin", "t.degrees", "deg cannot be converted to K"),
        ("t.speed", "t.hertz", "angle of a turn"),
        ("t.kelvin", "t.odd", "quux"),
    ],
)
def test_units_that_do_not_fit(system, refused, target, source, why):
    description = system({"t": "Thermometer"}, {target: source}, open_inputs=True, stop=0.1, step=0.1)
    refused(lambda: master.run(description), why, "convert = false")
    description.connections[target].convert = False
    master.run(description)


@pytest.mark.parametrize(
    "name, value, words",
    [
        ("m.mas", 1.0, ["m has no variable mas", "Did you mean mass?"]),
        ("n.mass", 1.0, ["no component n"]),
        ("mass", 1.0, ["component.variable"]),
        ("m.mass", "heavy", ["m.mass = heavy", "a number"]),
        ("m.mass", "nan", ["finite"]),
        ("m.mass", -1, ["at least 0 kg"]),
        ("m.mass", True, ["a number"]),
        ("m.x", 1.0, ["is computed, it cannot be set"]),
        ("t.flag", "perhaps", ["true or false"]),
        ("t.count", "2.5", ["a whole number"]),
    ],
)
def test_settings(system, refused, name, value, words):
    description = system({"m": "Mass", "t": "Types"}, open_inputs=True)
    refused(lambda: master.run(description, settings={name: value}), *words)


def test_settings_are_taken_as_the_variable_wants_them(system):
    got = {}
    description = system({"m": "Mass", "t": "Types"}, open_inputs=True, stop=0.1, step=0.1)
    settings = {"m.mass": "2.5", "t.flag": "True", "t.count": "7", "t.word": 3}
    master.run(
        description, settings=settings, observe=lambda time, parts: got.update(m=parts["m"].get("mass"), t=parts["t"].values)
    )
    assert got["m"] == 2.5 and got["t"]["flag"] is True and got["t"]["count"] == 7 and got["t"]["word"] == "3"


@pytest.mark.parametrize(
    "run, words",
    [
        ({"step": 0.0}, ["above zero"]),
        ({"stop": -1.0}, ["after the start"]),
        ({"stop": math.inf}, ["The stop time inf s is none that a run comes to"]),
        ({"step": 0.3}, ["whole number of steps"]),
        ({"interval": 0.0015}, ["interval", "whole number"]),
        ({"order": ["a"]}, ["missing: b"]),
        ({"order": ["a", "b", "b"]}, ["twice"]),
        ({"order": ["a", "c"]}, ["no component c"]),
        ({"record": ["a.z"]}, ["a has no variable z"]),
        ({"record": ["z*"]}, ["nothing is called z*"]),
    ],
)
def test_run(system, refused, run, words):
    refused(lambda: master.run(system(GAINS, {"b.u": "a.y"}, **run)), *words)


def test_own_steps_must_fit(system, refused):
    description = system(GAINS, {"b.u": "a.y"}, step=0.01)
    description.components["b"].step = 0.004
    refused(lambda: master.run(description), "[components.b] step = 0.004", "neither divides")


@pytest.mark.parametrize(
    "part, words",
    [("no_such_module:X", ["no_such_module"]), ("small_parts:Nothing", ["Nothing"]), ("small_parts", ["package.module:Class"])],
)
def test_parts(refused, part, words):
    refused(
        lambda: master.run(master.from_dict({"components": {"p": {"part": part}}}), allow_code=True), "[components.p]", *words
    )
    refused(
        lambda: master.run(
            master.from_dict({"components": {"p": {"part": "small_parts:Gain", "options": {"size": 1}}}}), allow_code=True
        ),
        "size",
    )


def test_parts_are_closed_when_a_check_fails(system, refused, monkeypatch):
    import small_parts

    closed = []
    monkeypatch.setattr(small_parts.Gain, "close", lambda self: closed.append(self.name))
    refused(lambda: master.run(system(GAINS)), "b.u")
    assert closed == ["a", "b"]


def test_recording_by_pattern(system):
    table = master.run(system(GAINS, {"b.u": "a.y"}, record=["b.*", "a.y", "a.gain"], stop=0.1, step=0.1)).table
    assert table.columns.to_list() == ["time", "a.gain", "a.y", "b.u", "b.y"]
