"""How outputs answer what is added at a place, so that all that might be added there is looked at without a simulation each.

To first order an output answers d(t), added at a place, by the sum of its steps times the answers to steps of 1 that begin
where they do (Duhamel). Answers are simulated for steps that begin at some times of a run, and taken to lie between two of them
as the time does: for linear systems that is exact, and one answer is enough; where the system changes as it goes on it is as
good as these times are close. What a law or path adds is computed from what it would be given, by the law itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from selflock.fmus.correction import law
from selflock.master.compiled import compiled_loops

from ..calibration.played import Settings
from ..rules import RULES
from . import kernels
from .extended import Extended, Extending
from .part import places as places_of
from .places import READ, Insert, Place

PROBE = "probe"


@cache
def _alone() -> Any:
    return compiled_loops(Path(kernels.__file__))["alone"]


@dataclass
class Kernel:
    """The answers of one run to a step of 1 at a place, (times, outputs, steps) as spectra."""

    outputs: tuple[str, ...]
    begins: np.ndarray  # steps at which they begin
    spectra: np.ndarray
    length: int

    def __call__(self, added: np.ndarray) -> dict[str, np.ndarray]:
        """What each output answers at the end of each step, and 0 where the run begins."""
        count, size = len(added), len(self.begins)
        rises = np.diff(added, prepend=0.0)
        shares = np.stack([np.interp(np.arange(count), self.begins, unit) for unit in np.eye(size)])
        spectrum = np.einsum("kf,kof->of", rfft(shares * rises, self.length, axis=-1), self.spectra)
        answers = irfft(spectrum, self.length, axis=-1)[:, :count]
        return {name: np.concatenate([[0.0], answer]) for name, answer in zip(self.outputs, answers)}


@dataclass
class Responses:
    """What would be added at each place, and how the outputs answer it, over a base with these values."""

    problem: Extending
    values: dict[str, float]
    inserts: tuple[Insert, ...]  # what was found before
    overs: Mapping[Place, Sequence[str]]  # what a law there may go with
    spreads: Mapping[Place, float]
    kept: dict[Place, tuple[list[Kernel], list[dict[str, np.ndarray]]] | None] = field(default_factory=dict)

    @property
    def played(self) -> Extended:
        assert isinstance(self.problem.played, Extended)
        return self.problem.played

    def change(self, one: Insert, settings: Sequence[Settings]) -> np.ndarray | None:
        """By how much a correction changes the misfit; None where a run breaks off on the way to know it."""
        if one.place not in self.kept:
            self.kept[one.place] = self._measured(one.place)
        known = self.kept[one.place]
        if known is None:
            return None
        problem, step = self.problem, self.played.parts.system.run.step
        answers: dict[str, list[np.ndarray]] = {name: [] for name in self.played.outputs}
        for i, kernel, heard in zip(problem.which, *known):
            added = self._added(one, settings[i], heard, step)
            if added is None:
                return None
            grid = step * np.arange(len(added) + 1)
            mine = kernel(added) if added.any() else {}
            for name, rows in answers.items():
                answer = mine.get(name)  # of what is corrected as it is recorded no other output knows
                times = self.played.times(i, name)
                rows.append(np.zeros(len(times)) if answer is None else np.interp(times, grid, answer))
        parts = [-a[t] / problem.units[name] for name in answers for a, t in zip(answers[name], problem.trusted[name])]
        return np.concatenate(parts)

    def steady(self, place: Place) -> bool:
        """Whether a step at a place is answered alike whenever it begins, so that any sum of steps is answered by their sum."""
        if place not in self.kept:
            self.kept[place] = self._measured(place)
        known = self.kept[place]
        return known is not None and all(len(kernel.begins) == 1 for kernel in known[0])

    def _added(self, one: Insert, settings: Settings, heard: dict[str, np.ndarray], step: float) -> np.ndarray | None:
        """What the correction adds to its signal in each step."""
        over = "" if one.own else one.over
        signal = heard[""]
        if over not in heard or one.beside not in heard:
            return None
        p = np.zeros(law.SIZE)
        p[law.LAW], p[law.MULTIPLIES], p[law.OVER] = law.BY_NAME[one.law].code, one.multiplies, one.taken
        p[law.OWN], p[law.COUNT], p[law.UNTIL] = one.own, one.points, 1e300
        where = places_of(one.law, one.points)
        given = {name.rpartition(".")[2]: value for name, value in settings.items() if name.startswith(f"{one.name}.")}
        for name, value in (dict(one.fixed) | given).items():
            p[where[name]] = value
        passed = np.empty(len(signal))
        _alone()(p, np.zeros(law.MEMORY), signal, heard[over], heard[one.beside], step, passed)
        added = passed - signal
        return added if np.isfinite(added).all() else None

    def _measured(self, place: Place) -> tuple[list[Kernel], list[dict[str, np.ndarray]]] | None:
        played, problem = self.played, self.problem
        played.extend(self.inserts)
        base = []
        for i in problem.which:
            found = played.steps(problem.settings(self.values), i, place, self.overs[place])
            if found is None:
                return None
            base.append(found)
        heard = [given for _, given in base]
        if place.where == READ:
            ones = [np.ones((1, 1, len(given[""]))) for given in heard]
            return [_kernel((place.variable,), np.zeros(1, int), one) for one in ones], heard
        size = RULES.naming.unit * self.spreads[place]
        probe = Insert(PROBE, place, "constant", fixed=(("a", size),))
        played.extend((*self.inserts, probe))
        kernels_of = []
        for i, (outputs, given) in zip(problem.which, base):
            answers = self._answers(i, outputs, len(given[""]), size)
            if answers is None:
                return None
            kernels_of.append(answers)
        played.extend(self.inserts)
        return kernels_of, heard

    def _answers(self, i: int, base: dict[str, np.ndarray], count: int, size: float) -> Kernel | None:
        """The answers of a run to steps that begin at its begin and middle, and where these differ at more times between."""
        step = self.played.parts.system.run.step

        def answer(begin: int) -> np.ndarray | None:
            settings = self.problem.settings(self.values)
            settings[i] = settings[i] | {f"{PROBE}.since": begin * step}
            found = self.played.steps(settings, i)
            if found is None:
                return None
            rows = np.stack([(found[0][name] - base[name])[begin + 1 :] / size for name in base])
            return rows if np.isfinite(rows).all() else None

        begins = np.unique(np.round(np.linspace(0, count, RULES.naming.edges + 1)[:-1]).astype(int))
        first, middle = answer(0), answer(int(begins[len(begins) // 2]))
        if first is None or middle is None:
            return None
        apart = np.linalg.norm(middle - first[:, : middle.shape[1]], axis=1)
        if (apart <= RULES.naming.unchanged * np.linalg.norm(first[:, : middle.shape[1]], axis=1)).all():
            return _kernel(tuple(base), np.zeros(1, int), first[None])
        found = []
        for begin in begins:
            one = first if begin == 0 else middle if begin == begins[len(begins) // 2] else answer(int(begin))
            if one is None:
                return None
            found.append(np.concatenate([one, np.repeat(one[:, -1:], count - one.shape[1], axis=1)], axis=1))
        return _kernel(tuple(base), begins, np.stack(found))


def _kernel(outputs: tuple[str, ...], begins: np.ndarray, answers: np.ndarray) -> Kernel:
    length = next_fast_len(2 * answers.shape[-1], real=True)
    return Kernel(outputs, begins, rfft(answers, length, axis=-1), length)
