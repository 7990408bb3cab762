"""What is seen of a run while its rows are written: peaks, energies, last values, and times at limits. For its summary.

It is gathered row block by row block, so that a long run costs no more memory than a short one.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from math import isclose, isfinite, tan
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from .face import Variable

if TYPE_CHECKING:
    from .wiring import Wiring

PEAKS = ("N.m", "N", "A", "W")  # units of what is told by its peak, in this order,
SIZES = {f"{prefix}{unit}": (unit, size) for unit in PEAKS for prefix, size in (("", 1.0), ("m", 1e-3), ("k", 1e3))}  # or so
ANGLES = ("rad", "deg", "m")  # of what is told by where it ends
COMPONENTS, ANGLES_TOLD = 16, 3  # lines of a summary, and angles in one
TURNS = 20.0  # rad: beyond, degrees say no more
NEAR = 1e-9  # relative: a value that is met but for its rounding
STALLED = 0.95  # share of the stall current, at that share of the highest voltage, from which on a motor stalls
STARTS = 0.1  # s: any motor stalls for a moment when it is switched on


@dataclass
class Watch:
    """A column that is held against a limit, or a motor that may stall. `met` is the time at it, s."""

    name: str  # of the output, or of the motor
    place: int  # of the column in a row
    unit: str = ""
    low: float = -np.inf
    high: float = np.inf  # of a motor its voltage
    voltage: int | float | None = None  # of a motor: a column's place, or what it is held at
    resistance: float = 0.0
    least: float = 0.0  # s at it that are worth a word
    met: float = 0.0

    @property
    def stalls(self) -> bool:
        return self.voltage is not None

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest value of the column, in its unit; of a motor its stall current."""
        most = self.high / self.resistance if self.stalls else self.high
        return (-most if self.stalls else self.low), most

    def look(self, rows: np.ndarray, spans: np.ndarray) -> None:
        x = rows[:, self.place]
        if self.voltage is None:
            at = (x >= self.high - NEAR * abs(self.high)) | (x <= self.low + NEAR * abs(self.low))
        else:
            volts = abs(rows[:, self.voltage] if isinstance(self.voltage, int) else np.full(len(rows), self.voltage))
            at = (volts >= STALLED * self.high) & (abs(x) * self.resistance >= STALLED * volts)
        self.met += float(spans[at].sum())

    def said(self) -> str:
        """That it was met, and for how long."""
        if self.stalls:
            return f"{self.name} stood at its stall current, {self.range[1]:.4g} A at {self.high:g} V, for {self.met:.4g} s"
        return f"{self.name} was at its limit, {_ends(*self.range)} {self.unit}, for {self.met:.4g} s"


@dataclass(frozen=True)
class Peak:
    """What is told of a column by its peak."""

    owner: str  # the component
    place: int  # of the column in a row
    unit: str
    least: float
    greatest: float
    energy: float | None  # J, of a power: its integral over time

    @property
    def size(self) -> float:
        """In its unit."""
        return max(abs(self.least), abs(self.greatest))

    @property
    def kind(self) -> str:
        """N.m, N, A or W: what its unit is one of."""
        return SIZES[self.unit][0]

    @property
    def weight(self) -> float:
        """Its size in the unit of its kind."""
        return self.size * SIZES[self.unit][1]


class Seen:
    """Peaks, last values and integrals over time of all columns that are numbers; watches."""

    def __init__(self, columns: list[Variable]):
        self.columns = [c for c in columns if c.type != "String"]
        width = len(self.columns)
        self.least, self.greatest = np.full(width, np.inf), np.full(width, -np.inf)
        self.last, self.integral = np.full(width, np.nan), np.zeros(width)
        self.watches: list[Watch] = []
        self.remarks: list[str] = []
        self.sources: set[str] = set()  # components that are functions of time: what they give was said before
        self.before = np.full((1, width), np.nan)  # the last row
        self._any = False

    def add(self, rows: np.ndarray) -> None:
        """More rows, the first column of which is the time, s."""
        before = self.before if self._any else rows[:1]
        joined = np.concatenate([before, rows])
        spans = np.diff(joined[:, 0])
        self.least = np.minimum(self.least, rows.min(0))
        self.greatest = np.maximum(self.greatest, rows.max(0))
        with np.errstate(over="ignore", invalid="ignore"):  # of 1e300 s there is no integral, and that is told as inf
            self.integral += spans @ (0.5 * (joined[1:] + joined[:-1]))
        for watch in self.watches:
            watch.look(rows, spans)
        self.last, self.before, self._any = rows[-1].copy(), rows[-1:].copy(), True

    def known(self, before: np.ndarray) -> None:
        """Go on behind a last row that was seen in another process."""
        self.before, self._any = before.copy(), True

    def copied(self) -> Seen:
        """As it is now, whatever is added later."""
        other = copy(self)
        other.integral, other.watches = self.integral.copy(), [replace(watch) for watch in self.watches]
        return other

    @property
    def table(self) -> pd.DataFrame:
        """A row for each column: unit, least, greatest, last, and the integral over time."""
        data = {"unit": [c.unit for c in self.columns], "least": self.least, "greatest": self.greatest, "last": self.last, "integral": self.integral}  # fmt: skip
        return pd.DataFrame(data, index=[c.name for c in self.columns]).iloc[1:]

    def peaks(self) -> list[Peak]:
        """Of each component its torques (two at most), force, current and power of the largest peaks."""
        found = []
        for owner, mine in self._by_component().items():
            for kind in PEAKS:
                sizes = {k: SIZES[unit][1] for k in mine if (unit := self.columns[k].unit) in SIZES and SIZES[unit][0] == kind}
                here = [k for k in sizes if "torque" in _name(self.columns[k])] or list(sizes)
                energy = {k: self.integral[k] * sizes[k] if kind == "W" else None for k in here}
                told = [Peak(owner, k, self.columns[k].unit, self.least[k], self.greatest[k], energy[k]) for k in here]
                found += sorted(told, key=lambda peak: -peak.weight)[: 2 if kind == "N.m" else 1]
        return found

    def lines(self) -> list[str]:
        """A line for each component: peaks of torques, force, current and power with its energy, and angles at the end."""
        if not self._any:
            return []
        told: dict[str, list[str]] = {}
        for peak in self.peaks():
            energy = f" ({peak.energy:.4g} J)" if peak.energy is not None else ""
            told.setdefault(peak.owner, []).append(f"{_name(self.columns[peak.place])} {peak.size:.4g} {peak.unit}{energy}")
        for owner, mine in self._by_component().items():
            ends = [k for k in mine if self.columns[k].unit in ANGLES and not _name(self.columns[k]).startswith("input_")]
            for place in ends[:ANGLES_TOLD]:
                x, unit = self.last[place], self.columns[place].unit
                degrees = f" ({np.degrees(x):.4g} deg)" if unit == "rad" and abs(x) < TURNS else ""
                told.setdefault(owner, []).append(f"{_name(self.columns[place])} at the end {x:.4g} {unit}{degrees}")
        order = [owner for owner in self._by_component() if owner in told]
        lines = [f"  {owner}: {', '.join(told[owner])}" for owner in order]
        more = [f"  … and {len(lines) - COMPONENTS} components more"] * (len(lines) > COMPONENTS)
        return lines[:COMPONENTS] + more + [f"  {sentence}" for sentence in self.reached()]

    def _by_component(self) -> dict[str, list[int]]:
        """Places of the outputs of each component that is no source."""
        found: dict[str, list[int]] = {}
        for place, column in enumerate(self.columns):
            if column.causality == "output" and _owner(column) not in self.sources:
                found.setdefault(_owner(column), []).append(place)
        return found

    def reached(self) -> list[str]:
        """Limits that were reached, a sentence each."""
        return self.remarks + [w.said() for w in self.watches if w.met > w.least]


def _owner(column: Variable) -> str:
    return column.name.rpartition(".")[0]


def _name(column: Variable) -> str:
    return column.name.rpartition(".")[2]


def watch(seen: Seen, wiring: Wiring) -> None:
    """Watch what has a limit: outputs with parameters NAME_min and NAME_max, motors at their stall; and remark on gears that lock."""
    places = {column.name: place for place, column in enumerate(seen.columns)}
    seen.sources = {name for name, part in wiring.parts.items() if part.timed}
    for name, part in wiring.parts.items():
        known = part.variables
        for v in known.values():
            if (place := places.get(f"{name}.{v.name}")) is not None and v.causality == "output" and f"{v.name}_max" in known:
                low, high = (number(wiring, name, f"{v.name}_{end}") for end in ("min", "max"))
                low, high = -np.inf if low is None else low, np.inf if high is None else high
                seen.watches.append(Watch(f"{name}.{v.name}", place, v.unit, low, high))
        _motor(seen, wiring, name, places)
        _gear(seen, wiring, name)


def _motor(seen: Seen, wiring: Wiring, name: str, places: dict[str, int]) -> None:
    """A component with voltage, current and resistance, whose highest voltage is known."""
    known = wiring.parts[name].variables
    place, ohms = places.get(f"{name}.current"), number(wiring, name, "resistance")
    if place is None or not ohms or "voltage" not in known or known["voltage"].causality != "input":
        return
    voltage: int | float | None
    link = next((link for link in wiring.links if (link.target, link.input) == (name, "voltage")), None)
    if link is None:
        voltage = highest = abs(number(wiring, name, "voltage") or 0.0)
    else:
        ends = [number(wiring, link.source, f"{link.output}_{end}") for end in ("min", "max")]
        highest = max((abs(end) for end in ends if end is not None and isfinite(end)), default=0.0)
        voltage = places.get(f"{link.source}.{link.output}") if (link.factor, link.offset) == (1.0, 0.0) else None
    if voltage is not None and highest > 0.0:
        seen.watches.append(Watch(name, place, "A", high=highest, voltage=voltage, resistance=ohms, least=STARTS))


def _gear(seen: Seen, wiring: Wiring, name: str) -> None:
    """A gear by a wedge, whose friction locks it: at rest by the static one, a load that moves by the kinetic one (12, 11)."""
    ratio, static, angle = (number(wiring, name, key) for key in ("gear_ratio", "friction_static", "wedge_angle"))
    kinetic = number(wiring, name, "friction_kinetic")
    if ratio is None or static is None or kinetic is None or angle is None:
        return
    limit = tan(angle) if angle else 1.0 / ratio
    holds, stops = (mu > limit and not isclose(mu, limit, rel_tol=NEAR) for mu in (static, kinetic))
    if holds and stops:
        mu = f"{kinetic:g}" if static == kinetic else f"{static:g} at rest and {kinetic:g} sliding"
        said = f"locks itself: its friction, {mu}, is beyond the limit, {limit:.4g}; its load cannot drive it"
    elif holds:
        said = (
            f"holds its load at rest: its static friction, {static:g}, is beyond the limit, {limit:.4g}; "
            f"once it moves its load can drive it, for its kinetic friction, {kinetic:g}, is not"
        )
    elif stops:
        said = (
            f"stops its load: its kinetic friction, {kinetic:g}, is beyond the limit, {limit:.4g}; "
            f"at rest its load can set it going, for its static friction, {static:g}, is not"
        )
    else:
        return
    seen.remarks.append(f"{name} {said}")


def number(wiring: Wiring, name: str, variable: str) -> float | None:
    """A value that a component is run with; None where it has none."""
    described = wiring.parts[name].variables.get(variable)
    value: Any = None if described is None else wiring.values.get(name, {}).get(variable, described.start)
    return float(value) if isinstance(value, (int, float)) else None


def _ends(low: float, high: float) -> str:
    if isclose(-low, high):
        return f"±{high:g}"
    return " or ".join(f"{end:g}" for end in (low, high) if isfinite(end))
