"""Laws of our FMUs, compiled, in place of their Python: the same bits, the same failures, and Python where it is not the same."""

import logging
from contextlib import nullcontext
from math import inf

import pytest

from selflock import master
from selflock.fmus import build, laws
from selflock.master import simulation, twin

WIRES = {
    "motor.voltage": "controller.voltage",
    "motor.speed": "reducer.input_speed",
    "reducer.motor_torque": "motor.torque",
    "load.torque": "reducer.output_torque",
    "reducer.output_angle": "load.angle",
    "reducer.output_speed": "load.speed",
    "controller.angle": "load.angle",
    "controller.speed": "load.speed",
    "controller.motor_speed": "reducer.input_speed",
    "controller.output_torque": "reducer.output_torque",
}


def servo(**starts):
    """A servo for some seconds; starts: of its components."""
    parts = ("controller", "motor", "reducer", "load")
    described = {
        "run": {"stop": 1.0, "open_inputs": True},
        "components": {name: {"fmu": f"selflock:{name.capitalize()}", "start": starts.get(name, {})} for name in parts},
        "connections": WIRES,
    }
    return master.from_dict(described)


@pytest.fixture
def offers(monkeypatch):
    """What FMUs were offered, a pair each: the name of the function that they step with, and whether they have it compiled."""
    made, twins = [], twin._twin

    def watched(sources, advance, *given):
        found = twins(sources, advance, *given)
        made.append((advance.__name__, found is not None))
        return found

    monkeypatch.setattr(twin, "_twin", watched)
    monkeypatch.setattr(simulation, "TWINS", 0)
    return made


def runs_until_offered(monkeypatch, wanted):
    """How many runs of a servo there are before its FMUs are offered their laws."""
    monkeypatch.setattr(simulation, "_stepped", [0.0])
    monkeypatch.setattr(simulation, "TWINS", wanted)
    made = []
    monkeypatch.setattr(twin, "offered", lambda: (made.append(1), nullcontext())[1])
    return next(run for run in range(1, 9) if (master.run(servo()), made)[1])


def test_a_run_has_the_same_numbers_to_the_bit(offers):
    moved = {
        "controller": {"angle_setpoint": 0.7},
        "motor": {"brush_voltage": 0.4},
        "reducer": {"viscous_damping": 1e-4, "backlash": 0.01, "friction_static": 0.03},
        "load": {"mass": 1.0},
    }
    plain = master.run(servo(**moved), as_fmu=True)
    assert not offers
    compiled = master.run(servo(**moved))
    assert sorted(offers) == [("_dynamic", True), ("advance", True), ("advance", True), ("advance", True)]
    assert compiled.table.equals(plain.table) and abs(plain.table["load.angle"].iloc[-1]) > 0.1


def drawn(face, rng):
    """Parameters of a face: some of its effects on, within their ranges."""
    p = face.law.Parameters()
    for effect in getattr(face.law, "EFFECTS", ()):
        if rng.random() < 0.5:
            own = {
                one.name: rng.uniform(max(one.low, -10.0), min(one.high, 10.0))
                for one in effect.parameters
                if one.high < inf or one.low > -inf
            }
            p = p._replace(**own)
    return p


@pytest.mark.parametrize("name, step", twin.LOOPS, ids="-".join)
def test_every_law_with_its_effects_gives_the_same_bits_compiled(name, step, rng):
    face = build.face_of(name)
    package, asked = laws.in_force(), 0
    function = twin._address(package, twin.LOOPS[name, step])
    for _ in range(30):
        slave = face(instance_name="it", resources="")
        slave._values[slave._place.get("kinematic", 0)] = float(step == "_kinematic")
        p = slave.complete(drawn(face, rng))
        if slave.check(p) or any(effect.check(p) for effect in getattr(face.law, "EFFECTS", ())):
            continue
        inputs = [float(one) for one in rng.normal(0.0, rng.choice([0.1, 3.0, 50.0]), slave._first_output)]
        state = slave.begin(p, *inputs)
        assert twin._agree(function, slave.stepper(), p, tuple(state), inputs), (p, inputs)
        asked += 1
    assert asked > 3


def test_what_fails_fails_as_it_does_without(offers):
    starts = {"controller": {"angle_setpoint": 1.0, "angle_gain": 1e200, "voltage_max": 1e300, "voltage_min": -1e300}}
    said = []
    for as_fmu in (True, False):
        with pytest.raises(master.PartFailed) as failed:
            master.run(servo(**starts), as_fmu=as_fmu)
        said.append((str(failed.value), len(failed.value.result.table)))
    assert said[0] == said[1] and offers


def test_a_law_that_is_not_the_same_compiled_is_not_used(offers, monkeypatch, caplog):
    monkeypatch.setattr(twin, "_agree", lambda *given: False)
    monkeypatch.setattr(twin, "_same", {})
    with caplog.at_level(logging.WARNING):
        found = master.run(servo(controller={"angle_setpoint": 0.7}))
    assert offers and not any(used for _, used in offers) and "is stepped as it is" in caplog.text
    assert found.table.equals(master.run(servo(controller={"angle_setpoint": 0.7}), as_fmu=True).table)


def test_sources_that_are_not_ours_have_no_compiled_law():
    motor = build.face_of("Motor")
    given = motor.law.advance, motor.law.Parameters(), tuple(motor.law.start(motor.law.Parameters())), [0.0, 0.0]
    assert twin._twin(build.laws_of(build.sources_of(motor)), *given) is not None
    assert twin._twin("", *given) is None and twin._twin("000000000000", *given) is None


def test_laws_are_loaded_once_runs_have_taken_as_many_steps_as_that_is_worth(monkeypatch):
    assert runs_until_offered(monkeypatch, 4000) == 1  # a second in ms, of four FMUs
    assert runs_until_offered(monkeypatch, 4001) == 2
    assert runs_until_offered(monkeypatch, 12_000) == 3
