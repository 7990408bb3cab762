"""The robot in the master's compiled loop: the bits of a run in Python, its failures, and Python where its memory is not known."""

import pytest

from selflock import master
from selflock.master import convoy, simulation
from selflock.study import runs
from selflock.vehicle import munk

STOP = 0.3  # s


@pytest.fixture
def sails(monkeypatch):
    """How many runs went through one compiled loop."""
    made, sail = [], convoy.sail
    monkeypatch.setattr(convoy, "sail", lambda *given: (made.append(1), sail(*given))[1])
    return made


def table(mode="kinematic", looked=False, **settings):
    observe = (lambda time, parts: None) if looked else None
    return master.run(runs.system(mode), settings, stop=STOP, observe=observe).table


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["kinematic", "dynamic"])
def test_a_run_that_is_one_compiled_loop_has_the_bits_of_one_in_python(sails, monkeypatch, mode):
    found = table(mode)
    assert len(sails) == 1
    monkeypatch.setattr(simulation, "find_spec", lambda name: None)
    assert table(mode).equals(found) and len(sails) == 1
    assert found["rear_reducer.input_torque"].std() > 0.0 and found["setpoints.front_angle"].equals(
        table(mode, looked=True)["setpoints.front_angle"]
    )


def test_where_pymunk_s_memory_is_not_known_python_steps_it(sails, monkeypatch):
    monkeypatch.setattr(munk, "layout", lambda: None)
    assert len(table()) == 1 + round(STOP / runs.system("kinematic").run.step) and not sails


def test_what_goes_wrong_is_told_as_without(sails):
    said = []
    for looked in (True, False):
        with pytest.raises(master.PartFailed) as failed:
            table("dynamic", looked, **{"rear_reducer.shaft_stiffness": 1e9})
        said.append((str(failed.value), len(failed.value.result.table)))
    assert said[0] == said[1] and "no longer sane" in said[0][0] and len(sails) == 1
