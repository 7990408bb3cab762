"""The face of a part: a small one is a few lines, and what the master asks of it is never guessed."""

import math

import pytest

from selflock import master
from selflock.master import Part, Variable
from selflock.master.algorithms import ALGORITHMS, GaussSeidel, Iterated, Jacobi


class Flywheel(Part):
    """J dw/dt = torque, held."""

    described = (
        Variable("inertia", "kg.m2", 2.0, minimum=0.0, causality="parameter"),
        Variable("torque", "N.m", 0.0, causality="input"),
        Variable("speed", "rad/s", 0.0, causality="output", depends_on=()),
    )
    can_roll_back = True

    def step(self, time, size):
        self.values["speed"] += self.values["torque"] / self.values["inertia"] * size


class Sine(Part):
    """A function of time."""

    described = (Variable("torque", "N.m", 0.0, causality="output", depends_on=()),)

    def at(self, time):
        self.y[:] = math.sin(time)


class Stranger:
    """No part."""

    def __init__(self, name): ...


def test_a_small_part_is_a_few_lines():
    wheel = Flywheel("w")
    wheel.bind(["torque"], ["speed"])
    wheel.set("inertia", 4.0)
    wheel.u[:] = 8.0
    wheel.cycle(0.0, 0.5)
    assert wheel.y.tolist() == [1.0] and wheel.get("speed") == 1.0
    before = wheel.save()
    wheel.stepper()(0.5, 0.5)
    assert wheel.get("speed") == 2.0
    wheel.restore(before)
    assert wheel.get("speed") == 1.0
    wheel.reset()
    assert wheel.get("inertia") == 2.0
    with pytest.raises(master.DescriptionError, match="w has no variable mass"):
        wheel.set("mass", 1.0)


def test_it_runs_in_a_system():
    description = master.from_dict(
        {
            "run": {"stop": 1.0, "step": 0.1},
            "components": {"s": {"part": f"{__name__}:Sine"}, "w": {"part": f"{__name__}:Flywheel"}},
            "connections": {"w.torque": "s.torque"},
        }
    )
    speed = master.run(description, allow_code=True).table["w.speed"]
    assert speed.iloc[-1] == pytest.approx(sum(math.sin(0.1 * n) for n in range(10)) * 0.1 / 2.0)


def test_capabilities_are_plain_attributes():
    wheel, sine = Flywheel("w"), Sine("s")
    assert not wheel.timed and sine.timed  # a class with an `at` is a function of time
    assert wheel.can_roll_back and not sine.can_roll_back
    assert wheel.variable_step and not wheel.parallel
    assert wheel.native() is None and wheel.pack is Part.pack and not wheel.units


def test_what_is_no_part_is_told_what_to_do():
    description = master.from_dict({"components": {"x": {"part": f"{__name__}:Stranger"}}})
    with pytest.raises(master.DescriptionError, match="no selflock.master.Part. Derive its class from that"):
        master.run(description, allow_code=True)


def test_an_algorithm_knows_who_is_ahead():
    assert ALGORITHMS == {"gauss-seidel": GaussSeidel, "jacobi": Jacobi, "iterated": Iterated}
    first = GaussSeidel(["a", "b"])
    assert first.ahead("a", "b") and not first.ahead("b", "a") and not first.ahead("a", "a")
    assert not first.ahead("clock", "b")  # not stepped: known at any time, ahead of nobody
    assert not Jacobi(["a", "b"]).ahead("a", "b")


def test_a_part_with_variables_in_the_old_order_is_told_the_new_one(tmp_path, monkeypatch):
    (tmp_path / "of_old.py").write_text(
        "from selflock.master.face import Part, Variable\n\n"
        "class Old(Part):\n    variables = {'u': Variable('u', 'input', 'Real', 'N')}\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    description = master.from_dict({"components": {"x": {"part": "of_old:Old"}}})
    with pytest.raises(master.DescriptionError, match='name, unit, start, description; write causality="input"'):
        master.run(description, allow_code=True)
