"""Small parts with closed forms, for testing what couples them."""

from __future__ import annotations

import math
import os
import signal
import threading

from selflock.master import Part, PartFailed, Variable


def real(name, causality, unit="", start=0.0, **more):
    return Variable(name, unit, start, causality=causality, **more)


class Small(Part):
    """A part that can roll back and says when it was closed."""

    can_roll_back = True

    def close(self):
        self.closed = True


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
        super().set("v" if name == "v0" else name, value)

    def step(self, time, size):
        n = 50
        h = size / n
        own = self.values
        mass, stiffness, damping, force = (own[name] for name in ("mass", "stiffness", "damping", "force"))

        def rate(x, v):
            return v, (force - stiffness * x - damping * v) / mass

        for _ in range(n):
            x, v = own["x"], own["v"]
            a1 = rate(x, v)
            a2 = rate(x + h / 2 * a1[0], v + h / 2 * a1[1])
            a3 = rate(x + h / 2 * a2[0], v + h / 2 * a2[1])
            a4 = rate(x + h * a3[0], v + h * a3[1])
            own["x"] += h / 6 * (a1[0] + 2 * a2[0] + 2 * a3[0] + a4[0])
            own["v"] += h / 6 * (a1[1] + 2 * a2[1] + 2 * a3[1] + a4[1])


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

    def compute(self):
        v = self.values
        v["force"] = v["stiffness"] * v["length"]
        v["reaction"] = -v["force"]

    def step(self, time, size):
        v = self.values
        v["length"] += (v["v2"] - v["v1"]) * size


class Gain(Small):
    """y = gain · u + shift at once."""

    described = (
        real("gain", "parameter", "", 1.0),
        real("shift", "parameter"),
        real("u", "input"),
        real("y", "output", depends_on=("u",)),
    )

    def compute(self):
        v = self.values
        v["y"] = v["gain"] * v["u"] + v["shift"]


class Integrator(Small):
    """dy/dt = u, held."""

    described = (real("u", "input"), real("y", "output", depends_on=()))

    def step(self, time, size):
        self.values["y"] += self.values["u"] * size


class Clock(Small):
    """A function of time, evaluated wherever the listener stands."""

    described = (real("angle", "output", "rad", depends_on=()),)

    def at(self, time):
        self.values["angle"] = math.sin(time)
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
        v = self.values
        v["flag_out"] = not v["flag_out"]
        v["count_out"] += 1
        v["word_out"] = f"{v['word']}b"[-5:]


class Fragile(Integrator):
    """Fails at a given time."""

    described = (*Integrator.described, real("fails_at", "parameter", "s", 0.5))

    def step(self, time, size):
        if time >= self.values["fails_at"] - 1e-12:
            given = {"u": self.values["u"]}
            raise PartFailed(self.name, time, size, "Error", given, ["the shaft broke"], "a thicker shaft.")
        super().step(time, size)


class Listener(Small):
    """Remembers what it was given at every step."""

    described = (real("u", "input"), real("w", "input"), real("y", "output", depends_on=()))

    def __init__(self, name):
        super().__init__(name)
        self.heard = []

    def step(self, time, size):
        self.heard.append((time, size, self.values["u"], self.values["w"]))


class Push(Small):
    """A constant force on whatever moves with v."""

    described = (real("force", "output", "N", depends_on=()), real("strength", "parameter", "N", 1.0), real("v", "input", "m/s"))

    def compute(self):
        self.values["force"] = self.values["strength"]


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
        if size > self.values["longest"] + 1e-12:
            raise PartFailed(self.name, time, size, "Discard to fmi2DoStep", {}, ["too long for me"])
        super().step(time, size)


class Wheel(Small):
    """Turns at a constant speed, and says that its speed is the derivative of its angle."""

    described = (
        real("speed", "output", "rad/s", 2.0, depends_on=(), derivative_of="angle"),
        real("angle", "output", "rad", depends_on=()),
    )

    def step(self, time, size):
        self.values["angle"] += self.values["speed"] * size


class Tired(Small):
    """Counts the time, and ends the run at 0.5 s."""

    described = (real("y", "output", "s", depends_on=()),)

    def step(self, time, size):
        self.values["y"] += size
        if time + size > 0.5 - 1e-9:
            self.end(time + size)


class Waits(Small):
    """A clock, whose step at `from_` waits until a test goes on (`Waits.go`), hears Ctrl-C, or fails of it."""

    described = (real("from_", "parameter", "s", 1e9), real("t", "output", "s", depends_on=()))
    go: threading.Event
    heard: str = ""

    def step(self, time, size):
        if time >= self.values["from_"]:
            if self.heard:
                self.hear(time, size)
            else:
                self.go.wait()
        self.values["t"] = time + size

    def hear(self, time, size):
        """Ctrl-C in the middle of a step: as it comes, as an FMU in Python tells it, or a compiler, or lost on its way."""
        try:
            os.kill(os.getpid(), signal.SIGINT)
            for _ in range(1000):  # it comes within a few lines
                pass
        except KeyboardInterrupt:
            if self.heard == "told":
                raise PartFailed(self.name, time, size, "Error", {}, ["Traceback: KeyboardInterrupt"], "") from None
            if self.heard == "torn":
                raise RuntimeError("no compiled object yet") from None
            if self.heard == "as it comes":
                raise


class Lag(Small):
    """dx/dt = u - x, exactly for a held u; y = x + through · u + push at once."""

    described = (
        real("through", "parameter"),
        real("push", "parameter"),
        real("x", "parameter"),
        real("u", "input"),
        real("y", "output", depends_on=("u",)),
    )

    def step(self, time, size):
        v = self.values
        v["x"] = v["u"] + (v["x"] - v["u"]) * math.exp(-size)

    def compute(self):
        v = self.values
        v["y"] = v["x"] + v["through"] * v["u"] + v["push"]


class Stepped(Lag):
    """The same, whose outputs follow at the end of a step alone."""

    instant = False

    def compute(self):
        pass

    def enter_initialization(self, start, stop):
        self.compute = super().compute  # then they do

    def exit_initialization(self):
        self.compute = lambda: None

    def step(self, time, size):
        super().step(time, size)
        super().compute()


class Sum(Small):
    """y = u + w at once."""

    described = (real("u", "input"), real("w", "input"), real("y", "output", depends_on=("u", "w")))

    def compute(self):
        v = self.values
        v["y"] = v["u"] + v["w"]


class Rooted(Small):
    """y = the positive root of 5 - a² - b², no number where there is none."""

    described = (real("a", "input"), real("b", "input"), real("y", "output", depends_on=("a", "b")))

    def compute(self):
        v = self.values
        square = 5.0 - v["a"] ** 2 - v["b"] ** 2
        v["y"] = math.sqrt(square) if square >= 0.0 else math.nan
