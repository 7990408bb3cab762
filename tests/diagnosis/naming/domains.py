"""Five domains that only the tests know: the balances of nature, and the FMUs that stand for them.

| domain | FMUs | what is recorded |
|---|---|---|
| thermal | three relaxations in a row | the command, the second and the third |
| hydraulic | two tanks | the pump, both levels |
| electrical | coil and capacitor, each acting on the other | voltage, current, voltage of the capacitor |
| mechanical | oscillator in the loop of a sampled controller (pythonfmu) | what is wanted, position, speed |
| house | six: thermostat (pythonfmu), burner, radiator, room, its wall, and the thermometer that the thermostat feels | what is wanted, radiator, room, wall |
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

CONTROLLER = '''
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Controller(Fmi2Slave):
    """A sampled controller: force = stiff (wanted - position) - soft speed, held for a step."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.stiff, self.soft, self.wanted, self.position, self.speed, self.force = 60.0, 6.0, 0.0, 0.0, 0.0, 0.0
        for name in ("stiff", "soft"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        for name in ("wanted", "position", "speed"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(Real("force", causality=Fmi2Causality.output))

    def do_step(self, t, h):
        self.force = self.stiff * (self.wanted - self.position) - self.soft * self.speed
        return True
'''

THERMOSTAT = '''
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Thermostat(Fmi2Slave):
    """How warm a burner is to be: gain (wanted - felt)."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.gain, self.wanted, self.felt, self.heat = 3.0, 0.0, 0.0, 0.0
        self.register_variable(Real("gain", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        for name in ("wanted", "felt"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(Real("heat", causality=Fmi2Causality.output))

    def do_step(self, t, h):
        self.heat = self.gain * (self.wanted - self.felt)
        return True
'''
PYTHON = {"controller": CONTROLLER, "thermostat": THERMOSTAT}
"""FMUs of pythonfmu, by file."""


@dataclass(frozen=True)
class Domain:
    """A domain: its FMUs, and how nature does the same.

    change(y, u, p, add): rates of nature's states; add(place) is what hides before that input, in its FMU's unit.
    free: numbers that the rig lets be fitted, by FMU variable; fixed: such as it does not. Values are nature's as drawn about
    them. over: what laws may hide before which input, with where each variable stands in `y`.
    """

    name: str
    fmus: tuple[str, ...]
    step: float  # s, of rows
    parts: int  # steps of the system from row to row
    system: str
    command: tuple[str, str, float, float]  # FMU variable, column, lowest and highest level
    outputs: dict[str, tuple[str, int]]  # FMU variable: column, place in y
    free: dict[str, float]
    starts: dict[str, float]  # start values of states, fitted to each run
    over: dict[str, dict[str, int]]
    change: Callable
    known: dict[str, float] = field(default_factory=dict)  # numbers that the rig does not let be fitted
    sampled: Callable | None = None  # what a sampled controller makes of y and the command, held for a row
    alike: tuple[frozenset[str], ...] = ()  # places where a path acts alike, or nearly

    def among(self, place: str) -> set[str]:
        return {place}.union(*(group for group in self.alike if place in group))


def _chain(y, u, p, add):
    """Heat from one body to the next: W over J/K."""
    into = (u + add("element.u"), y[0] + add("wall.u"), y[1] + add("load.u"))
    return [p[f"{n}.rate"] * (t - x) for n, t, x in zip(("element", "wall", "load"), into, y)]


def _tanks(y, u, p, add):
    """Water in m3 over the area; out by Torricelli."""
    out = [p[f"{n}.outlet"] * max(x, 0.0) ** 0.5 for n, x in zip(("upper", "lower"), y)]
    return [p["upper.gain"] * (u + add("upper.inflow")) - out[0], p["lower.gain"] * (out[0] + add("lower.inflow")) - out[1]]


def _circuit(y, u, p, add):
    """Kirchhoff: a coil, and a capacitor with a resistor across it."""
    voltage, current = u + add("coil.voltage") - y[1], y[0] + add("capacitor.current")
    return [
        (voltage - p["coil.resistance"] * y[0]) / p["coil.inductance"],
        (current - p["capacitor.conductance"] * y[1]) / p["capacitor.capacity"],
    ]


def _mass(y, u, p, add):
    """Newton, with the force that the controller holds."""
    force = u + add("oscillator.force")
    return [y[1], (force - p["oscillator.damping"] * y[1] - p["oscillator.stiffness"] * y[0]) / p["oscillator.mass"]]


def _house(y, u, p, add):
    """Heat on its way from a burner through a radiator into a room and its wall; W over J/K. A thermostat acts at once."""
    burner, radiator, room, wall, felt = y[:5]
    warm = p["thermostat.gain"] * (u - felt)
    into = (warm - burner, burner + add("radiator.u") - radiator, radiator + add("room.u") - room)
    into += (room + add("wall.u") - wall, room - felt)
    return [p[f"{n}.rate"] * d for n, d in zip(("burner", "radiator", "room", "wall", "thermometer"), into)]


DOMAINS = {
    d.name: d
    for d in (
        Domain(
            "thermal", ("relaxation",), 0.1, 5,
            """
[components]
element = "relaxation.fmu"
wall = "relaxation.fmu"
load = "relaxation.fmu"

[connections]
"wall.u" = "element.x"
"load.u" = "wall.x"
""",
            ("element.u", "heater", -2.0, 2.0),
            {"wall.x": ("wall", 1), "load.x": ("load", 2)},
            {"element.rate": 1.0, "load.rate": 0.4},
            {"element.x": 0.2, "wall.x": -0.1, "load.x": 0.1},
            {"wall.u": {"wall.x": 1}, "load.u": {"load.x": 2}},
            _chain,
            {"wall.rate": 0.6},
            alike=(frozenset({"element.u", "wall.u", "load.u", "wall.x"}), frozenset({"load.u", "load.x", "recorded load.x"})),
        ),
        Domain(
            "hydraulic", ("tank",), 1.0, 4,
            """
[components]
upper = "tank.fmu"
lower = "tank.fmu"

[connections]
"lower.inflow" = "upper.flow"
""",
            ("upper.inflow", "pump", 0.5, 3.0),
            {"upper.level": ("upper", 0), "lower.level": ("lower", 1)},
            {"upper.outlet": 0.15, "lower.outlet": 0.18},
            {"upper.level": 3.0, "lower.level": 2.5},
            {"upper.inflow": {"upper.level": 0, "lower.level": 1}, "lower.inflow": {"lower.level": 1}},
            _tanks,
            {"upper.gain": 0.15, "lower.gain": 1.0},
        ),
        Domain(
            "electrical", ("coil", "capacitor"), 0.01, 4,
            """
[components]
coil = "coil.fmu"
capacitor = "capacitor.fmu"

[connections]
"coil.back" = "capacitor.voltage"
"capacitor.current" = "coil.current"
""",
            ("coil.voltage", "supply", -10.0, 10.0),
            {"coil.current": ("current", 0), "capacitor.voltage": ("voltage", 1)},
            {"coil.resistance": 1.0, "capacitor.conductance": 0.5},
            {"coil.current": 0.1, "capacitor.voltage": 0.2},
            {"coil.voltage": {"coil.current": 0}, "capacitor.current": {"capacitor.voltage": 1}},
            _circuit,
            {"coil.inductance": 0.15, "capacitor.capacity": 0.3},
            alike=(frozenset({"coil.voltage", "coil.back"}),),
        ),
        Domain(
            "mechanical", ("oscillator", "controller"), 0.02, 1,
            """
[components]
controller = "Controller.fmu"
oscillator = "oscillator.fmu"

[connections]
"oscillator.force" = "controller.force"
"controller.position" = "oscillator.position"
"controller.speed" = "oscillator.speed"
""",
            ("controller.wanted", "wanted", -1.0, 1.0),
            {"oscillator.position": ("position", 0), "oscillator.speed": ("speed", 1)},
            {"oscillator.damping": 1.5, "oscillator.stiffness": 20.0},
            {"oscillator.position": 0.05, "oscillator.speed": 0.1},
            {"oscillator.force": {"oscillator.position": 0, "oscillator.speed": 1}},
            _mass,
            {"oscillator.mass": 1.0, "controller.stiff": 60.0, "controller.soft": 6.0},
            sampled=lambda y, u, p: p["controller.stiff"] * (u - y[0]) - p["controller.soft"] * y[1],
        ),
        Domain(
            "house", ("relaxation", "thermostat"), 0.2, 4,
            """
[components]
thermostat = "Thermostat.fmu"
burner = "relaxation.fmu"
radiator = "relaxation.fmu"
room = "relaxation.fmu"
wall = "relaxation.fmu"
thermometer = "relaxation.fmu"

[connections]
"burner.u" = "thermostat.heat"
"radiator.u" = "burner.x"
"room.u" = "radiator.x"
"wall.u" = "room.x"
"thermometer.u" = "room.x"
"thermostat.felt" = "thermometer.x"
""",
            ("thermostat.wanted", "wanted", -2.0, 2.0),
            {"radiator.x": ("radiator", 1), "room.x": ("room", 2), "wall.x": ("wall", 3)},
            {"burner.rate": 1.0, "room.rate": 0.4, "wall.rate": 0.3},
            {"burner.x": 0.1, "radiator.x": 0.2, "room.x": -0.1, "wall.x": 0.1, "thermometer.x": 0.1},
            {"radiator.u": {"radiator.x": 1}, "room.u": {"room.x": 2}, "wall.u": {"wall.x": 3}},
            _house,
            {"radiator.rate": 0.7, "thermometer.rate": 2.0, "thermostat.gain": 3.0},
            alike=(frozenset({"wall.u", "wall.x", "recorded wall.x"}),),
        ),
    )
}  # fmt: skip
