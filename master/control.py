"""Communication steps of changing size, on a grid of powers of two so that time never drifts.

- **power**: from the energy that the coupling lost or made at the bonds in the step (master.energy), relative to
  the largest power seen there. Needs no rollback, but uses it where every part can.
- **doubling**: every step is made once in full and once in two halves; the difference of the outputs estimates the
  error, of second order in the step for a method of first order. The halves count. Every part must roll back.

A step whose error is beyond the tolerance, or that a part discards, is made again with half of it; an error far
below lets the step double.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from array import array
from typing import TYPE_CHECKING

import numpy as np

from .errors import DescriptionError, PartFailed

if TYPE_CHECKING:
    from .energy import Pair
    from .seat import Seat
    from .simulation import _Simulation
    from .wiring import Wiring

LEVELS = 10  # step_min = step / 2**LEVELS unless told


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

    def restore(self) -> None:
        for seat, state, u, y in self.seats:
            seat.part.restore(state)
            seat.part.u[:], seat.part.y[:] = u, y
        for port, state in self.ports:
            port.state[:] = state


class Control(ABC):
    """Makes a step and estimates its error."""

    grow: float  # below this error, in tolerances, the step may double
    goes_back: bool  # whether a step can be made again

    def __init__(self, simulation: _Simulation, stepped: list[Seat]):
        self.tolerance, self.stepped = simulation.system.run.tolerance, stepped
        self.algorithm = simulation.wiring.algorithm

    @staticmethod
    @abstractmethod
    def check(where: str, wiring: Wiring, pairs: list[Pair]) -> None:
        """Refuse parts that this control cannot do with. Raises DescriptionError."""

    @abstractmethod
    def step(self, index: int, time: float, size: float, snapshot: Snapshot | None) -> float:
        """Make a step; gives its error in tolerances. `snapshot`: all parts at its start, where this goes back."""


class Power(Control):
    """How much power the coupling lost or made in a step, at the worst bond, in tolerances."""

    grow = 0.25  # the loss of power grows with the step

    def __init__(self, simulation: _Simulation, stepped: list[Seat]):
        super().__init__(simulation, stepped)
        self.balances = simulation.balances
        self.largest = [0.0] * len(self.balances)  # power seen at each bond, W
        self.goes_back = all(seat.part.can_roll_back for seat in stepped) and not simulation.system.faults

    @staticmethod
    def check(where: str, wiring: Wiring, pairs: list[Pair]) -> None:
        if not pairs:
            raise DescriptionError(f"{where}: there are no bonds at which to see power. Declare them as [[bonds]].")

    def step(self, index: int, time: float, size: float, snapshot: Snapshot | None) -> float:
        old = [(b.lost, b.turnover) for b in self.balances]
        self.algorithm.step(self.stepped, index, time, size)
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

    def __init__(self, simulation: _Simulation, stepped: list[Seat]):
        super().__init__(simulation, stepped)
        self.scales = [np.array([_nominal(seat, name) for name in seat.outputs]) for seat in stepped]

    @staticmethod
    def check(where: str, wiring: Wiring, pairs: list[Pair]) -> None:
        fixed = [part.name for part in wiring.parts.values() if not part.can_roll_back and not part.timed]
        if fixed:
            raise DescriptionError(f'{where}: {", ".join(fixed)} cannot roll back. Use step_control = "power".')
        if wiring.system.faults:
            raise DescriptionError(f"{where} does not go with [[faults]], which do not roll back. Use a fixed step.")

    def step(self, index: int, time: float, size: float, snapshot: Snapshot | None) -> float:
        self.algorithm.step(self.stepped, index, time, size)
        coarse = [seat.part.y.copy() for seat in self.stepped]
        assert snapshot is not None  # it goes back
        snapshot.restore()
        self.algorithm.step(self.stepped, index, time, size / 2)
        self.algorithm.step(self.stepped, index, time + size / 2, size / 2)
        worst = 0.0
        for seat, rough, scale in zip(self.stepped, coarse, self.scales):
            fine = seat.part.y
            np.maximum(scale, np.abs(fine), out=scale)
            error = np.abs(fine - rough) / (self.tolerance * np.where(scale > 0.0, scale, 1.0))
            worst = max(worst, float(np.max(error[seat.smooth], initial=0.0)))
        return worst


CONTROLS: dict[str, type[Control]] = {"power": Power, "doubling": Doubling}
"""By the name that a system gives."""


def _nominal(seat: Seat, name: str) -> float:
    return abs(seat.part.variables[name].nominal or 0.0)


def run(simulation: _Simulation) -> None:
    """Step from start to stop with a step that follows the error."""
    description = simulation.system.run
    stepped = [seat for seat in simulation.seats if not seat.timed]
    levels = LEVELS if not description.step_min else max(0, math.ceil(math.log2(description.step / description.step_min) - 1e-9))
    tick = description.step / 2**levels
    total = round((simulation.stop - description.start) / description.step) * 2**levels
    estimate = CONTROLS[description.step_control](simulation, stepped)
    position, size = 0, 1
    while position < total:
        time = description.start + position * tick
        if simulation.faults.parameters:
            simulation.faults.switch(time)
        snapshot = Snapshot(stepped) if estimate.goes_back else None
        try:
            error = estimate.step(simulation.index, time, size * tick, snapshot)
        except PartFailed as failure:
            if snapshot is None or size == 1 or not failure.status.startswith("Discard"):
                raise
            error = math.inf
        if error > 1.0 and size > 1 and snapshot is not None:
            snapshot.restore()
            simulation.rejected += 1
            size //= 2
            continue
        position += size
        if error > 1.0 and size > 1:
            size //= 2
        elif error < estimate.grow and size < 2**levels and position % (2 * size) == 0:
            size *= 2
        simulation.index += 1
        simulation.arrive(description.start + position * tick)
