"""Small parts with closed forms, for testing what couples them."""

from __future__ import annotations

import math

import numpy as np

from selflock.master.errors import PartFailed
from selflock.master.face import Variable


class Small:
    """What every small part shares: variables as attributes of the same name."""

    can_roll_back = True
    described: tuple[Variable, ...] = ()

    def __init__(self, name: str):
        self.name = name
        self.variables = {v.name: v for v in self.described}
        self.log: list[str] = []
        self.u = self.y = np.zeros(0)
        for v in self.described:
            setattr(self, v.name, v.start)

    def bind(self, inputs, outputs):
        self.inputs, self.outputs = list(inputs), list(outputs)
        self.u, self.y = np.zeros(len(inputs)), np.zeros(len(outputs))

    def set(self, name, value):
        setattr(self, name, value)

    def get(self, name):
        return getattr(self, name)

    def enter_initialization(self, start, stop): ...
    def exit_initialization(self): ...

    def write(self):
        for name, value in zip(self.inputs, self.u.tolist()):
            setattr(self, name, value)
        self.compute()

    def read(self):
        for k, name in enumerate(self.outputs):
            self.y[k] = getattr(self, name)

    def compute(self): ...

    def step(self, time, size): ...

    def save(self):
        return {k: v for k, v in vars(self).items() if isinstance(v, (float, int, bool, str))}

    def restore(self, state):
        vars(self).update(state)

    def reset(self): ...
    def terminate(self): ...

    def close(self):
        self.closed = True


def real(name, causality, unit="", start=0.0, **more):
    return Variable(name, unit, start, causality=causality, **more)


class Mass(Small):
    """m dv/dt = f - k x - d v for a held force, by many small steps of fourth order."""

    described = (
        real("mass", "parameter", "kg", 1.0, minimum=0.0),
        real("stiffness", "parameter", "N/m"),
        real("damping", "parameter", "N.s/m"),
        real("v0", "parameter", "m/s"),
        real("force", "input", "N"),
        real("x", "output", "m", depends_on=()),
        real("v", "output", "m/s", depends_on=()),
    )

    def set(self, name, value):
        setattr(self, "v" if name == "v0" else name, value)

    def step(self, time, size):
        n = 50
        h = size / n
        for _ in range(n):

            def rate(x, v):
                return v, (self.force - self.stiffness * x - self.damping * v) / self.mass

            x, v = self.x, self.v
            a1 = rate(x, v)
            a2 = rate(x + h / 2 * a1[0], v + h / 2 * a1[1])
            a3 = rate(x + h / 2 * a2[0], v + h / 2 * a2[1])
            a4 = rate(x + h * a3[0], v + h * a3[1])
            self.x += h / 6 * (a1[0] + 2 * a2[0] + 2 * a3[0] + a4[0])
            self.v += h / 6 * (a1[1] + 2 * a2[1] + 2 * a3[1] + a4[1])


class Spring(Small):
    """A spring between two masses, integrating its length from their held speeds: force = k l, on the first."""

    described = (
        real("stiffness", "parameter", "N/m", 1.0),
        real("v1", "input", "m/s"),
        real("v2", "input", "m/s"),
        real("length", "parameter", "m"),
        real("force", "output", "N", depends_on=()),
        real("reaction", "output", "N", depends_on=()),
    )

    def exit_initialization(self):
        self.compute()

    def compute(self):
        self.force = self.stiffness * self.length
        self.reaction = -self.force

    def step(self, time, size):
        self.length += (self.v2 - self.v1) * size
        self.compute()


class Gain(Small):
    """y = gain · u + shift at once."""

    described = (
        real("gain", "parameter", "", 1.0),
        real("shift", "parameter"),
        real("u", "input"),
        real("y", "output", depends_on=("u",)),
    )

    def compute(self):
        self.y_ = self.gain * self.u_ + self.shift

    u_ = y_ = 0.0

    def write(self):
        if self.inputs:
            self.u_ = float(self.u[0])
        self.compute()

    def read(self):
        if self.outputs:
            self.y[0] = self.y_

    def set(self, name, value):
        setattr(self, "u_" if name == "u" else name, value)


class Integrator(Small):
    """dy/dt = u, held."""

    described = (real("u", "input"), real("y", "output", depends_on=()))

    def __init__(self, name):
        super().__init__(name)
        self.state, self.given = 0.0, 0.0

    def write(self):
        if self.inputs:
            self.given = float(self.u[0])

    def set(self, name, value):
        setattr(self, "given" if name == "u" else name, value)

    def read(self):
        if self.outputs:
            self.y[:] = self.state

    def step(self, time, size):
        self.state += self.given * size


class Clock(Small):
    """A function of time, evaluated wherever the listener stands."""

    described = (real("angle", "output", "rad", depends_on=()),)

    def at(self, time):
        self.angle = math.sin(time)
        self.read()


class Types(Small):
    """One variable of each type, passed through."""

    described = (
        Variable("flag", start=False, causality="input"),
        Variable("count", start=0, causality="input"),
        Variable("word", start="", causality="input"),
        Variable("flag_out", start=True, causality="output"),
        Variable("count_out", start=3, causality="output"),
        Variable("word_out", start="a", causality="output"),
    )

    def step(self, time, size):
        self.flag_out = not self.flag_out
        self.count_out += 1
        self.word_out = f"{self.word}b"[-5:]


class Fragile(Integrator):
    """Fails at a given time."""

    described = (*Integrator.described, real("fails_at", "parameter", "s", 0.5))

    def step(self, time, size):
        if time >= self.fails_at - 1e-12:
            raise PartFailed(self.name, time, size, "Error", {"u": self.given}, ["the shaft broke"], "a thicker shaft.")
        super().step(time, size)


class Listener(Small):
    """Remembers what it was given at every step."""

    described = (real("u", "input"), real("w", "input"), real("y", "output", depends_on=()))

    def __init__(self, name):
        super().__init__(name)
        self.heard = []

    def step(self, time, size):
        self.heard.append((time, size, self.u_given(), self.w))

    def write(self):
        self.given = dict(zip(self.inputs, self.u.tolist()))
        self.w = self.given.get("w", 0.0)

    def u_given(self):
        return self.given.get("u", 0.0)

    def set(self, name, value): ...

    def read(self):
        self.y[:] = 0.0


class Push(Small):
    """A constant force on whatever moves with v."""

    described = (real("force", "output", "N", depends_on=()), real("strength", "parameter", "N", 1.0), real("v", "input", "m/s"))

    def read(self):
        self.y[:] = self.strength


class Thermometer(Small):
    """Outputs in units of many kinds; an input in kelvin, one in radians."""

    described = (
        real("celsius", "output", "degC", 20.0, depends_on=()),
        real("degrees", "output", "deg", 180.0, depends_on=()),
        real("hertz", "output", "Hz", 1.0, depends_on=()),
        real("odd", "output", "quux", 1.0, depends_on=()),
        real("kelvin", "input", "K"),
        real("radians", "input", "rad"),
        real("speed", "input", "rad/s"),
    )


class Careful(Integrator):
    """Discards steps that are longer than it likes."""

    described = (*Integrator.described, real("longest", "parameter", "s", 1.0))

    def step(self, time, size):
        if size > self.longest + 1e-12:
            raise PartFailed(self.name, time, size, "Discard to fmi2DoStep", {}, ["too long for me"])
        super().step(time, size)


class Wheel(Small):
    """Turns at a constant speed, and says that its speed is the derivative of its angle."""

    described = (
        real("speed", "output", "rad/s", 2.0, depends_on=(), derivative_of="angle"),
        real("angle", "output", "rad", depends_on=()),
    )

    def step(self, time, size):
        self.angle += self.speed * size
