"""The time limit of a naming: what ends the looking, and never the answer."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

from selflock.master.stops import Stops


class Limit:
    """Called, it says whether time is up for looking further. `enough`: that; `stops`: what interrupts where even then much goes on."""

    def __init__(self, enough: Callable[[], bool] = lambda: False, stops: Stops | None = None):
        self._enough, self._stops, self._over = enough, stops, False
        self.cut = False  # whether it kept anybody from looking further

    def __call__(self) -> bool:
        self.cut = self.cut or self._over or self._enough()
        return self.cut

    def answering(self) -> AbstractContextManager[None]:
        """What was fitted is judged, or told: that is the answer, which comes a little later rather than never."""
        return nullcontext() if self._stops is None else self._stops.calm()

    def ends(self) -> bool:
        """Whether an interrupt is the time limit's own. Then it ends the search alone: what follows is asked for, and is told."""
        if self._over or self._stops is None or not self._stops.time_up:
            return False
        self._over = self.cut = True
        self._stops.asked = False
        return True
