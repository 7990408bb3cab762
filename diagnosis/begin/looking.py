"""Looking at columns one by one, and at what they say of each other: which may be channels, of which drive, which are motions."""

from __future__ import annotations

from collections import Counter

import numpy as np

from ..errors import DataError
from ..rules import RULES
from . import numbers as of
from . import words
from .guess import LogGuess, Taken
from .numbers import Tie
from .raw import LIKELY, UNSURE, Raw
from .words import ANGLE, CURRENT, DUTY, SETPOINT, SPEED, SUPPLY, TORQUE, VOLTAGE, Word


class Looking:
    """A log, its guess so far, and what its columns claim."""

    def __init__(self, raw: Raw):
        self.raw, self.columns, self.guess = raw, raw.columns, LogGuess(raw)
        self.words = dict(raw.words)
        self.ties: dict[tuple[str, str], Tie] = {}
        self.varying: list[str] = []

    def look(self, only: str) -> None:
        """Which columns may be channels of one drive, and which of them are motions."""
        self._alike_letters()
        self.varying = [name for name, x in self.columns.values.items() if self._look(name, x)]
        self._one_drive(only)
        self._claims_by_numbers()

    def _alike_letters(self) -> None:
        """x1, x2, x3 are no claims: a letter that many columns have says nothing of one."""
        bare = {
            n: w
            for n, w in self.words.items()
            if w.strength == 1 and not w.side and not w.role and all(t.isdigit() for t in w.rest)
        }
        letters = Counter(words.tokens(w.header)[0] for w in bare.values())
        for name, word in bare.items():
            if letters[words.tokens(word.header)[0]] >= 3:
                self.words[name] = Word(name, rest=())

    def _look(self, name: str, x: np.ndarray) -> bool:
        """Whether a column may be a channel: it changes, and is more than a switch."""
        good = x[np.isfinite(x)]
        distinct = len(np.unique(good[: RULES.begin.looked_at]))
        if distinct == 1 and self.words[name].quantity == SUPPLY and good[0] > 0.0:
            return True  # nobody records how a supply stays as it is, and the duty is a share of it
        if distinct < 2:
            self.guess.left[name] = f"always {good[0]:.6g}" if len(good) else "no numbers"
        elif self.words[name].quantity in (words.FLAG, words.RUN, words.INDEX):
            self.guess.left[name] = "a mark, by its name"
        elif distinct < 4 and self.words[name].strength < 2:
            self.guess.left[name] = f"a switch: {', '.join(f'{v:g}' for v in np.unique(good)[:3])}"
        elif _counts_rows(good):
            self.guess.left[name] = "it counts rows"
        else:
            return True
        return False

    def _of(self, *quantities: str, role: str | None = None) -> list[str]:
        """Columns that still have no place and claim to be one of these, the strongest claims first."""
        found = [n for n in self.varying if self.words[n].quantity in quantities and n not in self.guess.left]
        found = [n for n in found if n not in {t.column for t in self.guess.taken.values()}]
        if role is not None:
            found = [n for n in found if (self.words[n].role == SETPOINT) == (role == SETPOINT)]
        return sorted(found, key=lambda n: -self.words[n].strength)

    def _take(self, signal: str, column: str, **more) -> Taken:
        word = self.words[column]
        why = more.pop("why", None) or [
            "its unit"
            if word.said
            else "its name"
            if word.strength >= 2
            else "a letter of its name"
            if word.strength
            else "its numbers"
        ]
        sure = more.pop("sure", LIKELY if word.strength >= 2 or word.strength == 0 else UNSURE)
        self.guess.taken[signal] = Taken(column, signal, why=why, sure=sure, **more)
        return self.guess.taken[signal]

    def _one_drive(self, only: str) -> None:
        """Columns whose names differ in what is no word (a number, a joint's name) are of several drives: one is taken."""
        if only:
            wanted = [n for n in self.varying if only.lower() in n.lower()]
            if not wanted:
                raise self._no(only)
            shared = (SUPPLY, words.FLAG, words.TIME)
            for name in self.varying:
                if name not in wanted and self.words[name].quantity not in shared:
                    self.guess.left[name] = "not of the drive that was asked for"
            self.varying = [n for n in self.varying if n not in self.guess.left]
        slots: dict[tuple[str, ...], set] = {}
        for name in self.varying:
            word = self.words[name]
            quantity = word.quantity or (DUTY if word.role == SETPOINT else "")  # what a command asks for
            if word.rest and quantity in (ANGLE, SPEED, TORQUE, CURRENT, VOLTAGE, DUTY):
                slots.setdefault(word.rest, set()).add((quantity, word.side, word.role))
        several = [
            rest for rest, mine in slots.items() if len({q for q, _, _ in mine}) > 1 and {ANGLE, SPEED} & {q for q, _, _ in mine}
        ]
        alike = [rest for rest in several if any(slots[rest] & slots[other] for other in several if other != rest)]
        if len(alike) < 2:
            return
        most = max(len(slots[rest]) for rest in alike)
        best = [rest for rest in alike if len(slots[rest]) == most]
        chosen = max(best, key=lambda rest: (self._motion(rest), -best.index(rest)))
        names = {rest: " ".join(rest) for rest in slots}
        self.guess.drives = [names[chosen], *(names[rest] for rest in alike if rest != chosen)]
        for name in self.varying:
            rest = self.words[name].rest
            if rest in alike and rest != chosen:
                self.guess.left[name] = f"of another drive ({names[rest]})"
        self.varying = [n for n in self.varying if n not in self.guess.left]
        self.guess.notes.append(
            f"the log holds {len(alike)} drives ({', '.join(names[r] for r in alike[:8])}): taken is {names[chosen]!r}; "
            "for another: --only with what its columns have in their names"
        )

    def _motion(self, rest: tuple[str, ...]) -> float:
        """How much a drive's named motion changes, in its own range: which of several tells most."""
        best = 0.0
        for name in self.varying:
            if self.words[name].rest == rest and self.words[name].quantity in (SPEED, ANGLE):
                best = max(best, float(np.nansum(abs(self.columns.change(name)))))
        return best

    def _no(self, only: str):

        return DataError(f"--only {only}: no column has that in its name. There are: {', '.join(list(self.raw.words)[:20])}.")

    def integral(self, angle: str, speed: str) -> Tie:
        """Tie of an angle to a speed, remembered."""
        if (angle, speed) not in self.ties:
            self.ties[angle, speed] = of.integral(self.columns, angle, speed)
        return self.ties[angle, speed]

    def _tie(self, name: str, other: str, a: str, b: str) -> Tie:
        """How a motion follows another, of these quantities: angles by their changes, speeds by their means."""
        if a == b:
            return of.proportional(self.columns, name, other, a == ANGLE)
        if a == ANGLE:
            return self.integral(name, other)
        back = self.integral(other, name)
        return Tie(1.0 / back.factor if back.factor else float("nan"), back.r, back.centred, back.pieces, back.spread)

    def _clocked(self) -> bool:
        """Whether the time is told in s."""
        return bool(self.raw.clock.factor) and bool(self.raw.clock.column or self.raw.clock.step)

    def _forget(self) -> None:
        """What was told by another time."""
        self.columns.__dict__.pop("lasting", None)
        self.columns._memory.clear()
        self.ties.clear()

    def _claims_by_numbers(self) -> None:
        """Columns without a claim that are the derivative or the integral of one with a claim; then pairs without any."""
        known = {ANGLE: self._of(ANGLE), SPEED: self._of(SPEED)}
        free = [n for n in self.varying if self.words[n].strength == 0 and n not in self.guess.left]
        for name in free:
            partner = [s for s in known[SPEED] if self.integral(name, s).holds(RULES.begin.kinematic)]
            if partner:
                self._claim(name, ANGLE)
                continue
            partner = [a for a in known[ANGLE] if self.integral(a, name).holds(RULES.begin.only_numbers)]
            if partner and not any(self.integral(a, s).holds(RULES.begin.same) for a in partner for s in known[SPEED]):
                self._claim(name, SPEED)
        free = [n for n in free if self.words[n].quantity == ""]
        self._claim_same(free, known)
        free = [n for n in free if self.words[n].quantity == ""]
        if known[ANGLE] or known[SPEED] or len(free) > 60:
            return
        pairs = [
            (a, s) for a in free for s in free
            if a != s and self.integral(a, s).holds(RULES.begin.only_numbers) and self.integral(a, s).pieces >= 30 and not abs(self.integral(s, a).r) > RULES.begin.borne_out
        ]  # fmt: skip
        speeds = {s for _, s in pairs}
        for angle, speed in pairs:
            if angle not in speeds:  # which would be the integral of an acceleration
                self._claim(angle, ANGLE)
                self._claim(speed, SPEED)
        self._claim_same([n for n in free if self.words[n].quantity == ""], {ANGLE: self._of(ANGLE), SPEED: self._of(SPEED)})

    def _claim_same(self, free: list[str], known: dict[str, list[str]]) -> None:
        """Columns that go as a known motion does, in its own size or as the other shaft's."""
        for name in free:
            for quantity, mine in known.items():
                least = (
                    0.9 if self.words[name].role == SETPOINT else RULES.begin.kinematic
                )  # what was asked for is not followed at once
                if any(of.proportional(self.columns, name, other, quantity == ANGLE).holds(least) for other in mine):
                    self._claim(name, quantity)
                    break

    def _claim(self, name: str, quantity: str) -> None:
        word = self.words[name]
        self.words[name] = Word(name, quantity, word.side, word.role, word.unit if word.said else "", word.said, 0, word.rest)


def _counts_rows(x: np.ndarray) -> bool:
    steps = np.diff(x)
    return len(x) > 10 and bool(np.all(steps[:10000] == 1.0))
