"""What the product answered, and whether it is right. Names are `component.effect`, with a channel or parameter in brackets."""

from __future__ import annotations

from dataclasses import dataclass

from .bench import STEP, Case
from .causes import Cause
from .rig import SHEETS, signal


def expected(cause: Cause) -> str:
    """The right answer for a hidden cause."""
    if cause.effect == "unknown":
        return "unknown"
    if cause.component == "sensor":
        return f"sensor.{cause.effect}({signal(cause.what)})"
    if cause.effect == "parameter":
        return f"parameter({cause.component}.{cause.what})"
    return cause.name


def plain(diagnosis) -> dict:
    """What the product returns, as its diagnosis.json."""
    return diagnosis.data()


def answers(result: dict) -> list[str]:
    """The causes named in a diagnosis.json, in their order; the verdict alone where it names none."""
    if result["verdict"] in ("none", "unknown"):
        return [result["verdict"]]
    return [_name(cause) for cause in result["causes"]]


def _name(cause: dict) -> str:
    if cause["component"] == "sensor":
        return f"sensor.{cause['effect']}({cause['channel']})"
    if cause["effect"] == "parameter":
        return f"parameter({next(iter(cause['parameters']))})"
    return f"{cause['component']}.{cause['effect']}"


def right_first(result: dict, case: Case) -> bool:
    """The first cause named is one that is there; for a case without any: none is named."""
    found = answers(result)
    if not case.causes:
        return found == ["none"]
    if case.causes[0].effect == "unknown":
        return found == ["unknown"] and right_variable(result, case.causes[0])
    return found[0] in [expected(cause) for cause in case.causes]


def both(result: dict, case: Case) -> bool:
    """Every hidden cause is among those named."""
    return set(expected(cause) for cause in case.causes) <= set(answers(result))


def right_variable(result: dict, cause: Cause) -> bool:
    """The remainder is said to depend on what it does depend on."""
    said = " ".join(str(name) for name in result["remainder"]["depends_on"])
    return any(name in said for name in cause.depends_on)


def fault_found(result: dict, placed: dict, reach: int = 3) -> bool:
    """The fault that was put into the log is reported by kind and channel, in the right rows."""
    channel = signal_or_time(placed["channel"])
    return any(
        fault["kind"] == placed["kind"]
        and fault["channel"] == channel
        and abs(fault["first"] - placed["first"]) <= reach
        and abs(fault["last"] - placed["last"]) <= reach
        for fault in result["faults"]
    )


def fault_rows(result: dict, placed: list[dict], log: str, reach: int = 3) -> dict[str, list[int]]:
    """Of each kind of fault: rows placed, of these told, rows told, of these placed (give or take `reach` rows).

    A row is one of one channel.
    """
    put, said = _rows(placed, signal_or_time), _rows([f for f in result["faults"] if log in f["log"]], str)
    found = {}
    for kind in sorted(set(put) | set(said)):
        there, told = put.get(kind, set()), said.get(kind, set())
        widened = {(channel, row + shift) for channel, row in there for shift in range(-reach, reach + 1)}
        found[kind] = [len(there), len(there & told), len(told), len(told & widened)]
    return found


def signal_or_time(channel: str) -> str:
    return channel if channel == "time" else signal(channel)


def _rows(listed: list[dict], name) -> dict[str, set]:
    rows: dict[str, set] = {}
    for fault in listed:
        here = {(name(fault["channel"]), row) for row in range(fault["first"], fault["last"] + 1)}
        rows.setdefault(fault["kind"], set()).update(here)
    return rows


def believed(result: dict, case: Case) -> list[tuple[float, bool]]:
    """Confidence of each cause named, and whether it is there."""
    if result["verdict"] in ("none", "unknown"):
        return []
    there = [expected(cause) for cause in case.causes]
    return [(float(cause["confidence"]), _name(cause) in there) for cause in result["causes"]]


PRODUCTS = {  # the product's name of what the plant hides, for what has the same meaning in both
    "brush_drop": "motor.brush_voltage",
    "dead_zone": "controller.dead_zone",
    "delay": "controller.command_delay",
    "sampling": "controller.sample_period",
    "backlash": "reducer.backlash",
    "compliance": "reducer.compliance",
    "preload": "reducer.preload",
}
OF_SENSORS = {
    "bias": ("bias", 0.0),
    "scale": ("scale_factor", 1.0),
    "lag": ("lag_time", 0.0),
    "quantisation": ("resolution", 0.0),
}


@dataclass(frozen=True)
class Amount:
    """A parameter hidden and found; counted from where the effect is off, or as the data sheet's error."""

    name: str
    hidden: float
    found: float
    half: float  # of the 95 % interval
    grain: float = 0.0  # what the log cannot resolve

    @property
    def near(self) -> bool:
        """Within three half intervals, which say something only below the amount itself; or a tenth, for formulas differ."""
        told = min(3.0 * self.half, abs(self.hidden))
        return abs(self.found - self.hidden) <= max(told, 0.1 * abs(self.hidden), self.grain)

    def __str__(self) -> str:
        return f"{self.name}: hidden {self.hidden:.4g}, found {self.found:.4g} ± {self.half:.2g}"


def amounts(result: dict, case: Case) -> list[Amount]:
    """The hidden parameters of causes that were named, beside what was found for them."""
    said = {name: p for cause in result["causes"] for name, p in cause["parameters"].items()}
    found = []
    for cause, strength in zip(case.causes, case.strengths):
        for key, value in cause.parameters(strength).items():
            name, off = PRODUCTS.get(key, ""), 0.0
            if cause.component == "sensor":
                key, off = OF_SENSORS[key]
                name, value = f"sensor.{signal(cause.what)}.{key}", off + value
            elif cause.effect == "parameter":
                name, off = f"{cause.component}.{key}", getattr(case.sheet, SHEETS[cause.component][key])
            if name in said:
                p = said[name]
                grain = STEP if key == "delay" else 0.0  # between two rows a log does not say when a command arrived
                found.append(Amount(name, float(value) - off, p["value"] - off, 0.5 * (p["high"] - p["low"]), grain))
    return found
