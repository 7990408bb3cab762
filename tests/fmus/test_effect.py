"""Every effect says all that is known of it, does nothing while it is off, and something in each of its numbers when on.

Whatever file is added to a component's `effects` folder is held to this.
"""

import inspect
import random
import re
from importlib import import_module
from math import cos, sin
from pathlib import Path

import pytest

from selflock.fmus import effect_file
from selflock.fmus.build import FACES, face_of
from selflock.fmus.effect import PHASE, ROLES, SHAPES, Parameter

LAWS = {component: import_module(f"selflock.fmus.{module}") for component, module in sorted(effect_file.LAWS.items())}
HOOKS = {component: import_module(f"selflock.fmus.{component}.effects").HOOKS for component in LAWS}
EFFECTS = [effect for law in LAWS.values() for effect in law.EFFECTS]
named = pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: f"{effect.component}.{effect.name}")


def gaps(effect) -> list[str]:
    """What an effect does not say, or says wrongly."""
    return effect_file.gaps(effect, LAWS[effect.component].BASE, HOOKS[effect.component])


@named
def test_nothing_is_left_unsaid(effect):
    assert gaps(effect) == []


@named
def test_it_is_found_under_its_own_names(effect):
    module = inspect.getmodule(next(iter(effect.hooks.values())))
    assert module.__name__.endswith(f"{effect.component}.effects.{effect.name}") and module.__doc__
    assert [e.name for e in EFFECTS if e.component == effect.component].count(effect.name) == 1


@pytest.mark.parametrize("component", LAWS)
def test_numbers_are_each_said_once(component):
    law = LAWS[component]
    names = [p.name for e in law.EFFECTS for p in e.parameters]
    assert len(names) == len(set(names))
    said = [name for e in law.EFFECTS for name in e.says]
    assert len(said) == len(set(said))
    base = {p.name: p for p in law.BASE}
    assert all(p.role in ROLES and p.description for p in base.values())
    for effect in law.EFFECTS:  # one number, whoever declares it
        for p in effect.parameters:
            assert p.name not in base or (p.unit, p.off) == (base[p.name].unit, base[p.name].off)
    assert all(p.above.name in base for p in base.values() if p.above)


def test_a_gap_is_told():
    whole = EFFECTS[0]
    assert gaps(whole._replace(advice="")) == ["no advice"]
    assert "no hook of the" in gaps(whole._replace(hooks={"heat": min}))[0]
    wrong = Parameter("x", "", 3.0, 0.0, 1.0, "")
    told = gaps(whole._replace(parameters=(wrong,)))
    assert len(told) == 3 and "no description" in told[0] and "no role" in told[1] and "off at 3.0" in told[2]


def condition(component, draw):
    """Any state that a hook may be asked in."""
    if component == "sensor":
        return draw.uniform(-2.0, 2.0)
    if component == "load":
        return LAWS["load"].State(draw.uniform(-2.0, 2.0), draw.uniform(-2.0, 2.0))
    kind = LAWS[component].Condition
    x = kind(*(draw.uniform(0.1, 2.0) for _ in kind._fields))
    return x._replace(direction=draw.choice([-1.0, 1.0])) if component == "reducer" else x


def somewhere(p, draw):
    return draw.uniform(p.low, p.high)


@named
def test_off_its_hooks_are_as_if_it_were_not_there(effect):
    """Whatever its shapes, as long as all that acts by itself is off."""
    seed = random.randrange(2**32)
    draw = random.Random(seed)
    for _ in range(50):
        shapes = {p.name: somewhere(p, draw) for p in effect.parameters if p.role in SHAPES}
        p = LAWS[effect.component].Parameters(**shapes)
        x = condition(effect.component, draw)
        for hook, function in effect.hooks.items():
            nothing = HOOKS[effect.component][hook]((), hook)(p, x)
            assert function(p, x) == nothing, f"{hook} at {shapes} in {x}, seed {seed}"


GIVEN = {
    "Motor": ({}, {"voltage": lambda t: 12.0 * sin(50.0 * t), "speed": lambda t: 100.0 * sin(20.0 * t)}),
    "Controller": (
        {},
        {
            "angle_setpoint": lambda t: 0.1 * sin(19.0 * t),
            "speed_setpoint": lambda t: 1.9 * cos(19.0 * t),
            "angle": lambda t: 0.05 * sin(18.0 * t),
            "speed": lambda t: 0.9 * cos(18.0 * t),
            "motor_speed": lambda t: 45.0 * cos(18.0 * t),
        },
    ),
    "Load": ({"mass": 1.0}, {"torque": lambda t: 5.0 * sin(6.0 * t)}),
    "Sensor": ({}, {"value": lambda t: 2.0 * sin(11.0 * t)}),
    "Reducer": (
        {"friction_kinetic": 0.005, "friction_static": 0.01},
        {
            "motor_torque": lambda t: 0.5 * sin(20.0 * t),
            "output_angle": lambda t: 0.02 * sin(15.0 * t),
            "output_speed": lambda t: 0.3 * cos(15.0 * t),
        },
    ),
}


def run(component, **values):
    """All outputs of a component's FMU face over 0.2 s, under inputs that go to and fro."""
    name = next(name for name in FACES if name.lower() == component)
    start, inputs = GIVEN[name]
    slave = face_of(name)(instance_name=name, resources="")
    for key, value in {**start, **values}.items():
        slave._set(slave._place[key], value, "Real")
    found = []
    for i in range(100):
        slave.set_real([slave._place[n] for n in inputs], [f(2e-3 * i) for f in inputs.values()])
        if i == 0:
            slave.enter_initialization_mode()
            slave.exit_initialization_mode()
        assert slave.do_step(2e-3 * i, 2e-3), slave._fault
        found.append([slave.value(row.name) for row in slave.outputs])
    return found


def on(p):
    """An amount at which it acts, or another value of a shape."""
    return p.off + 0.1 * (p.high - p.off) if p.high > p.off else p.off - 0.1 * (p.off - p.low)


@named
def test_off_it_changes_no_bit_of_what_the_fmu_gives(effect):
    seed = random.randrange(2**32)
    draw = random.Random(seed)
    shapes = {p.name: somewhere(p, draw) for p in effect.parameters if p.role in SHAPES}
    assert run(effect.component, **shapes) == run(effect.component), f"seed {seed}"


@pytest.mark.alike
@named
def test_each_of_its_numbers_changes_what_the_fmu_gives(effect):
    nothing = run(effect.component)
    acting = {p.name: on(p) for p in effect.parameters if p.role not in SHAPES}
    assert acting
    for name, value in acting.items():
        assert run(effect.component, **{name: value}) != nothing, name
    together = run(effect.component, **acting)
    for p in effect.parameters:
        if p.role in SHAPES:
            other = 1.0 if p.role == PHASE else on(p)
            assert run(effect.component, **acting, **{p.name: other}) != together, p.name


@named
def test_its_own_check_is_the_fmu_s(effect):
    """Its bounds are fit; what its check refuses, the face refuses with the same sentence."""
    law, face = LAWS[effect.component], face_of(effect.component.capitalize())
    assert effect.check(law.Parameters()) == ""
    for p in effect.parameters:
        values = law.Parameters(**{p.name: 0.0})
        if effect.check(values):
            slave = face(instance_name="it", resources="")
            slave._set(slave._place[p.name], 0.0, "Real")
            slave.enter_initialization_mode()
            slave.exit_initialization_mode()
            assert slave._fault == effect.check(values)


def test_the_page_of_the_fmus_names_every_effect():
    rows = (Path(__file__).parents[2] / "docs/fmus.md").read_text().splitlines()
    for component, law in LAWS.items():
        (row,) = [row for row in rows if row.startswith(f"| {component.capitalize()} ")]
        assert set(re.findall("`(.+?)`", row.split("|")[4])) == {effect.name for effect in law.EFFECTS}
