"""One communication step after another: what a run does to its end, and a session step by step."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from copy import deepcopy
from typing import Any

from . import control
from .algorithms import Stepped
from .errors import PartFailed
from .running import Running

LEVELS = 10  # step_min = step / 2**LEVELS unless told


class Stepping(ABC):
    """The steps of a run that has been started. What is stepped are the seats of its parts, or several of them as one."""

    def __init__(self, running: Running):
        self.running = running
        self.seats = [seat for seat in running.seats if not seat.timed]
        assert running.coupling is not None  # it has been started
        self.coupling = running.coupling

    @property
    @abstractmethod
    def over(self) -> bool:
        """Whether the run is at its stop, or a part has ended it."""

    @abstractmethod
    def step(self) -> None:
        """On to the next communication point."""

    @abstractmethod
    def save(self) -> Any:
        """Where it is, beyond what `running` knows."""

    @abstractmethod
    def restore(self, state: Any) -> None:
        """Go on from there."""


class Fixed(Stepping):
    """Steps of one size: each ends at the very number that the next one begins at (FMI 2.0, 4.2.2: h = tc_i+1 - tc_i)."""

    def __init__(self, running: Running, stepped: Sequence[Stepped] = ()):
        super().__init__(running)
        run = running.system.run
        self.stepped = stepped or self.seats
        self.start, self.size = run.start, run.step
        steps = (running.stop - run.start) / run.step
        self.count: float = round(steps) if math.isfinite(steps) else steps
        self.every = run.every
        self.advance, self.windows = self.coupling.advance, running.faults

    @property
    def over(self) -> bool:
        return self.running.index >= self.count or bool(self.running.ended)

    def step(self) -> None:
        running = self.running
        index = running.index
        time = self.start + index * self.size
        if self.windows.parameters:
            self.windows.switch(time)
        end = self.start + (index + 1) * self.size
        self.advance(self.stepped, index, time, end - time)
        running.index = index = index + 1
        if running.ends and running.over(end):
            return
        running.arrive(end, self.every == 1 or bool(self.kept(index)))

    def kept(self, index: Any) -> Any:
        """Whether the row after so many steps is in the results: each after [run] interval, and the last."""
        return (index % self.every == 0) | (index == self.count)

    def save(self) -> Any:
        return self.coupling.save()

    def restore(self, state: Any) -> None:
        self.coupling.restore(state)


class Controlled(Stepping):
    """Steps that follow the error."""

    def __init__(self, running: Running):
        super().__init__(running)
        run = running.system.run
        self.levels = LEVELS if not run.step_min else max(0, math.ceil(math.log2(run.step / run.step_min) - 1e-9))
        self.start, self.tick = run.start, run.step / 2**self.levels
        steps = (running.stop - run.start) / run.step
        self.total: float = round(steps) * 2**self.levels if math.isfinite(steps) else steps
        self.estimate = control.CONTROLS[run.step_control](running.wiring, running.balances, self.seats, self.coupling.advance)
        self.position: float = 0  # in ticks, as the size
        self.size = 1

    @property
    def over(self) -> bool:
        return self.position >= self.total or bool(self.running.ended)

    def step(self) -> None:
        while not self._accepted():
            pass

    def _accepted(self) -> bool:
        """Make a step; whether it was good enough to stay."""
        running, estimate, size = self.running, self.estimate, self.size
        time, middle, end = (self.start + (self.position + share * size) * self.tick for share in (0.0, 0.5, 1.0))
        if running.faults.parameters:
            running.faults.switch(time)
        snapshot = control.Snapshot(self.seats) if estimate.goes_back else None
        try:
            error = estimate.step(running.index, (time, middle, end), snapshot)
        except PartFailed as failure:
            if snapshot is None or size == 1 or not failure.status.startswith("Discard"):
                raise
            error = math.inf
        if running.ends:
            running.index += 1
            running.over(end)
            self.position = self.total
            return True
        if error > 1.0 and size > 1 and snapshot is not None:
            snapshot.restore()
            running.rejected += 1
            self.size = size // 2
            return False
        self.position += size
        if error > 1.0 and size > 1:
            self.size = size // 2
        elif error < estimate.grow and size < 2**self.levels and self.position % (2 * size) == 0:
            self.size = size * 2
        running.index += 1
        running.arrive(self.start + self.position * self.tick)
        return True

    def save(self) -> Any:
        return self.coupling.save(), self.position, self.size, deepcopy(self.estimate.largest)

    def restore(self, state: Any) -> None:
        coupling, self.position, self.size, largest = state
        self.estimate.largest = deepcopy(largest)
        self.coupling.restore(coupling)
