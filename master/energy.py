"""What the coupling adds to the energy, bond by bond.

Where an effort e (torque, force, voltage) goes from part A to part B and a flow f (speed, current) comes back,
the power e·f should leave A as it enters B. In a step both work with inputs that the coupling holds: A sees the
flow f̃, B the effort ẽ. So A gives ∫ e f̃ dt, B takes ∫ ẽ f dt, and the difference is energy [J] that the coupling
swallowed (positive) or made (negative): the residual energy of Sadjina, Kyllingstad, Skjong, Pedersen, "Energy
conservation and power bonds in co-simulations" (Engineering with Computers 33, 2017). Own outputs are taken as
linear over a step, which leaves an error of third order in the step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .errors import DescriptionError
from .face import view
from .system import Bond
from .units import to_si
from .wiring import Link, Wiring

FLOW_OF = {"N.m": "rad/s", "N": "m/s", "V": "A"}  # bonds by these units are found without being declared


class Port:
    """One side of a bond: the energy through it, from the part's held input and its own output.

    `state`: the output at the last count, the energy so far in J, and its turnover, in one buffer that compiled
    code can count in as well.
    """

    __slots__ = ("u", "i", "y", "j", "scale", "state")

    def __init__(self, u: memoryview[float], i: int, y: memoryview[float], j: int, scale: float):
        self.u, self.i, self.y, self.j, self.scale = u, i, y, j, scale
        self.state = view(np.array([y[j], 0.0, 0.0]))

    def add(self, size: float) -> None:
        state, now = self.state, self.y[self.j]
        work = 0.5 * (state[0] + now) * self.u[self.i] * size * self.scale
        state[0] = now
        state[1] += work
        state[2] += work if work > 0.0 else -work

    @property
    def energy(self) -> float:
        return self.state[1]

    @property
    def turnover(self) -> float:
        return self.state[2]


@dataclass
class Balance:
    """Energy over one bond in J: given by the side of the effort, taken by the other, lost by the coupling."""

    name: str
    giver: Port
    taker: Port

    @property
    def given(self) -> float:
        return self.giver.energy

    @property
    def taken(self) -> float:
        return self.taker.energy

    @property
    def lost(self) -> float:
        return self.given - self.taken

    @property
    def turnover(self) -> float:
        """∫ |power| dt in J, of the side where it is larger."""
        return max(self.giver.turnover, self.taker.turnover)

    @property
    def relative(self) -> float:
        return self.lost / self.turnover if self.turnover else 0.0


@dataclass(frozen=True)
class Pair:
    """A bond as two links: the effort's, and that of the flow coming back."""

    name: str
    effort: Link
    flow: Link


def bonds(wiring: Wiring) -> list[Pair]:
    """The declared bonds, and those that units make plain."""
    pairs = [_declared(wiring, bond) for bond in wiring.system.bonds]
    taken = {pair.effort for pair in pairs} | {pair.flow for pair in pairs}
    return pairs + [pair for pair in _found(wiring) if pair.effort not in taken and pair.flow not in taken]


def _unit(wiring: Wiring, link: Link) -> str:
    return wiring.parts[link.source].variables[link.output].unit


def _found(wiring: Wiring) -> list[Pair]:
    """Two parts joined by exactly one effort and exactly one flow that belongs to it."""
    pairs = []
    between: dict[tuple[str, str], list[Link]] = {}
    for link in wiring.links:
        between.setdefault((link.source, link.target), []).append(link)
    for (source, target), links in between.items():
        efforts = [link for link in links if _unit(wiring, link) in FLOW_OF]
        if len(efforts) != 1:
            continue
        wanted = FLOW_OF[_unit(wiring, efforts[0])]
        flows = [link for link in between.get((target, source), []) if _unit(wiring, link) == wanted]
        if len(flows) == 1:
            pairs.append(Pair(f"{source}.{efforts[0].output}", efforts[0], flows[0]))
    return pairs


def _declared(wiring: Wiring, bond: Bond) -> Pair:
    where = "[[bonds]]"
    giver, effort = wiring.variable(bond.effort, where)
    taker, flow = wiring.variable(bond.flow, where)
    there = [k for k in wiring.links if (k.source, k.output, k.target) == (giver, effort.name, taker)]
    back = [k for k in wiring.links if (k.source, k.output, k.target) == (taker, flow.name, giver)]
    if len(there) != 1 or len(back) != 1:
        raise DescriptionError(
            f"{where} effort = {bond.effort}, flow = {bond.flow}: a bond needs one connection {bond.effort} -> {taker}.(input) "
            f"and one {bond.flow} -> {giver}.(input)."
        )
    return Pair(bond.name or bond.effort, there[0], back[0])


def balance(wiring: Wiring, pair: Pair) -> tuple[Balance, str, str]:
    """The balance of a bond, ready to count, and the two components whose steps it counts.

    Both sides are told in the giver's units made SI. Were ẽ = a·e and f̃ = b·f exact, A would give b·e·f and B
    take a·e·f: the factor b/a on B's side takes units and declared factors (two sides of a robot) out.
    """
    a, b = wiring.parts[pair.effort.source], wiring.parts[pair.flow.source]
    effort, flow_in = a.variables[pair.effort.output], a.variables[pair.flow.input]
    scale = to_si(effort.unit, a.units) * to_si(flow_in.unit, a.units)
    giver = _port(wiring, pair.effort.source, pair.flow.input, pair.effort.output, scale)
    taker = _port(wiring, pair.flow.source, pair.effort.input, pair.flow.output, scale * pair.flow.factor / pair.effort.factor)
    return Balance(pair.name, giver, taker), a.name, b.name


def _port(wiring: Wiring, component: str, given: str, own: str, scale: float) -> Port:
    part = wiring.parts[component]
    inputs, outputs = wiring.bound[component]
    return Port(view(part.u), inputs.index(given), view(part.y), outputs.index(own), scale)
