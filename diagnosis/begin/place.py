"""Which column is which variable of a drive: names claim, numbers confirm, contradict or find, and what is left stays a gap.

Each placed column says how sure that is: `sure` where a name or a unit and the numbers agree, or two relations do; `likely`
where one of them speaks; `unsure` where a letter does, or where a unit was taken because nobody said it.
"""

from __future__ import annotations

import numpy as np

from ..rules import RULES
from . import numbers as of
from . import words
from .driving import Driving
from .guess import LogGuess
from .raw import Raw
from .words import TEMPERATURE


def place(raw: Raw, only: str = "") -> LogGuess:
    """The guess. only: of columns that belong to one of several drives, those whose names hold this."""
    placing = Placing(raw)
    with np.errstate(all="ignore"):  # what is not finite holds for nothing
        placing.look(only)
        placing.motions()
        placing.electric()
        placing.beside()
    return placing.guess


class Placing(Driving):
    """One log, step by step: motions first, for everything else is told by them."""

    def beside(self) -> None:
        """Temperature and marks; then what is left, and what it looks like."""
        for name in self._of(TEMPERATURE):
            if "motor.temperature" not in self.guess.taken:
                taken = self._take("motor.temperature", name, unit=self.words[name].unit or "degC")
                x = self.columns.values[name]
                if not (-30.0 < float(np.nanmin(x)) and float(np.nanmax(x)) < 250.0):
                    taken.doubt("no temperature of a motor in degC, by its size")
        marks = [n for n in self.columns.values if self.words[n].quantity == words.FLAG]
        for name in marks:
            x = self.columns.values[name]
            good = x[np.isfinite(x)]
            says = {"enable", "enabled", "valid", "freigabe"} & set(words.tokens(name))
            if says and len(good) and set(np.unique(good)) == {0.0, 1.0} and np.mean(good) > 0.3 and not self.guess.valid:
                self.guess.valid = name
                self.guess.left.pop(name, None)
        self._rest()

    def _rest(self) -> None:
        """What has no place, and what it looks like."""
        placed = {one.column for one in self.guess.taken.values()}
        base = self._base()
        motion = {}
        w, a, _ = self._motion_parts()
        if w is not None:
            motion = {"the speed": w, "the acceleration": a}
        for name in self.varying:
            if name in placed or name == self.guess.valid:
                continue
            x = self.columns.values[name]
            step = of.grain(x)
            looks = [f"{np.nanmin(x):.4g} to {np.nanmax(x):.4g}", *([f"steps of {step:.4g}"] if step else [])]
            for one in self.guess.taken.values():
                tie = of.proportional(self.columns, name, one.column, True)
                if tie.holds(0.9):
                    looks.append(f"goes with {one.column!r} (r = {tie.r:.2f})")
                    break
            else:
                for what, part in motion.items():
                    tie = of.tie(self.columns.mean(name), part)
                    if tie.pieces >= RULES.begin.fewest and abs(tie.r) > 0.8 and base:
                        looks.append(f"goes with {what} of {self.guess.taken[base].column!r} (r = {tie.r:.2f})")
                        break
            claim = self.words[name]
            if name in self.guess.left:
                looks.insert(0, self.guess.left[name])
            elif claim.quantity:
                looks.insert(0, f"{claim.quantity}, by its name")
            self.guess.left[name] = "; ".join(looks)
