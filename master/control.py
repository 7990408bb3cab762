"""Communication steps of changing size, on a grid of powers of two so that time never drifts.

- **power**: from the energy that the coupling lost or made at the bonds in the step (master.energy), relative to
  the largest power seen there. Needs no rollback, but uses it where every part can.
- **doubling**: every step is made once in full and once in two halves; the difference of the outputs estimates the
  error, of second order in the step for a method of first order. The halves count. Every part must roll back.

A step whose error is beyond the tolerance, or that a part discards, is made again with half of it; an error far
below lets the step double.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from array import array
from typing import Any

import numpy as np

from .algorithms import Advance
from .energy import Balance, Pair
from .errors import DescriptionError
from .seat import Seat
from .system import CONTROLS as NAMES
from .wiring import Wiring


def check(wiring: Wiring, pairs: list[Pair]) -> None:
    """Refuse a step control that these parts cannot have."""
    run = wiring.system.run
    if not run.step_control:
        return
    where = f'[run] step_control = "{run.step_control}"'
    if not run.tolerance > 0.0:
        raise DescriptionError(f"[run] tolerance = {run.tolerance:g}: it must be above zero.")
    if run.interval:
        raise DescriptionError(f"{where} records every communication point; leave out interval.")
    for name, component in wiring.system.components.items():
        if component.step:
            raise DescriptionError(f"{where}: {name} has a step of its own; own steps need a fixed communication step.")
        if not wiring.parts[name].variable_step:
            raise DescriptionError(f"{where}: {name} takes steps of one size only. Use a fixed step.")
    CONTROLS[run.step_control].check(where, wiring, pairs)


class Snapshot:
    """All parts at one instant, to come back to."""

    def __init__(self, seats: list[Seat]):
        self.seats = [(seat, seat.part.save(), seat.part.u.copy(), seat.part.y.copy()) for seat in seats]
        self.ports = [(port, array("d", port.state)) for seat in seats for port in seat.ports]
        own = [seat for seat in seats if not seat.even or seat.keep]  # these remember more than their part
        self.shown = [(values, array("d", values)) for seat in own for values in (seat.shown, seat.before, seat.origin)]

    def restore(self) -> None:
        for seat, state, u, y in self.seats:
            seat.part.ends.clear()
            seat.part.restore(state)
            seat.part.u[:], seat.part.y[:] = u, y
        for port, state in self.ports:
            port.state[:] = state
        for values, old in self.shown:
            values[:] = old


Times = tuple[float, float, float]  # where a step begins, its middle and its end, s


class Control(ABC):
    """Makes a step and estimates its error."""

    grow: float  # below this error, in tolerances, the step may double
    goes_back: bool  # whether a step can be made again
    largest: list[Any]  # what was seen so far, by which errors are judged

    def __init__(self, wiring: Wiring, balances: list[Balance], stepped: list[Seat], advance: Advance):
        self.tolerance, self.stepped = wiring.system.run.tolerance, stepped
        self.advance, self.balances = advance, balances

    @staticmethod
    @abstractmethod
    def check(where: str, wiring: Wiring, pairs: list[Pair]) -> None:
        """Refuse parts that this control cannot do with. Raises DescriptionError."""

    @abstractmethod
    def step(self, index: int, times: Times, snapshot: Snapshot | None) -> float:
        """Make a step; gives its error in tolerances. `snapshot`: all parts at its start, where this goes back."""


class Power(Control):
    """How much power the coupling lost or made in a step, at the worst bond, in tolerances."""

    grow = 0.25  # the loss of power grows with the step

    def __init__(self, wiring: Wiring, balances: list[Balance], stepped: list[Seat], advance: Advance):
        super().__init__(wiring, balances, stepped, advance)
        self.largest = [0.0] * len(balances)  # power at each bond, W
        self.goes_back = all(seat.part.can_roll_back for seat in stepped) and not wiring.system.faults

    @staticmethod
    def check(where: str, wiring: Wiring, pairs: list[Pair]) -> None:
        if not pairs:
            raise DescriptionError(f"{where}: there are no bonds at which to see power. Declare them as [[bonds]].")

    def step(self, index: int, times: Times, snapshot: Snapshot | None) -> float:
        time, size = times[0], times[2] - times[0]
        old = [(b.lost, b.turnover) for b in self.balances]
        self.advance(self.stepped, index, time, size)
        worst = 0.0
        for k, (bond, (lost, turnover)) in enumerate(zip(self.balances, old)):
            self.largest[k] = max(self.largest[k], (bond.turnover - turnover) / size)
            if self.largest[k]:
                worst = max(worst, abs(bond.lost - lost) / (size * self.largest[k] * self.tolerance))
        return worst


class Doubling(Control):
    """The difference between one step and two half ones at the worst output, in tolerances."""

    grow = 0.2  # the error of a step grows with its square
    goes_back = True

    def __init__(self, wiring: Wiring, balances: list[Balance], stepped: list[Seat], advance: Advance):
        super().__init__(wiring, balances, stepped, advance)
        self.largest = [np.array([_nominal(seat, name) for name in seat.outputs]) for seat in stepped]

    @staticmethod
    def check(where: str, wiring: Wiring, pairs: list[Pair]) -> None:
        fixed = [part.name for part in wiring.parts.values() if not part.can_roll_back and not part.timed]
        if fixed:
            raise DescriptionError(f'{where}: {", ".join(fixed)} cannot roll back. Use step_control = "power".')
        if wiring.system.faults:
            raise DescriptionError(f"{where} does not go with [[faults]], which do not roll back. Use a fixed step.")

    def step(self, index: int, times: Times, snapshot: Snapshot | None) -> float:
        begin, middle, end = times
        self.advance(self.stepped, index, begin, end - begin)
        coarse = [seat.part.y.copy() for seat in self.stepped]
        assert snapshot is not None  # it goes back
        snapshot.restore()
        self.advance(self.stepped, index, begin, middle - begin)
        self.advance(self.stepped, index, middle, end - middle)
        worst = 0.0
        for seat, rough, scale in zip(self.stepped, coarse, self.largest):
            fine = seat.part.y
            np.maximum(scale, np.abs(fine), out=scale)
            error = np.abs(fine - rough) / (self.tolerance * np.where(scale > 0.0, scale, 1.0))
            worst = max(worst, float(np.max(error[seat.smooth], initial=0.0)))
        return worst


CONTROLS: dict[str, type[Control]] = dict(zip(NAMES, (Power, Doubling)))
"""By the name that a system gives."""


def _nominal(seat: Seat, name: str) -> float:
    return abs(seat.part.variables[name].nominal or 0.0)
