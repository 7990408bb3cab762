"""What a search is about: the misfit of one experiment, its noise and folds, fits, and what fits leave unseen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..residuals import sheet, stepping
from ..residuals.dilution import of_driving
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.experiment import Experiment
from ..residuals.mending import excess
from ..residuals.noise import of_bins, of_formulas, of_quiet_bins, of_rounding, of_written
from ..residuals.phase import name, parameter
from ..residuals.propagated import of_inputs
from ..residuals.whole import HOLD, MOVING
from ..rules import RULES
from .candidate import Candidate
from .fit import Fit, Misfit, fit, held_out, jacobian, rho, weight
from .hypotheses import Free, Hypothesis, recorder, uncertain, vocabulary
from .kept import Kept
from .phases import beside, best, losses, marked, settled, zeros
from .starts import Ending, starts


@dataclass(frozen=True, eq=False)
class Problem:
    """One experiment, the blocks that teach, and all hypotheses about it. It does not change: another is made of it."""

    experiment: DriveExperiment
    train: np.ndarray  # bool, of each block
    base_free: tuple[Free, ...]  # what no data sheet says
    hypotheses: tuple[Hypothesis, ...]
    nominal: dict[str, float]  # values of `base_free`
    noise: np.ndarray  # of each residual's bins
    quiet: np.ndarray  # noise where there is least of it, over the usual noise of a residual
    present: np.ndarray  # (blocks, bins of all residuals): which entries of the misfit there are
    loss_scale: float = np.inf  # where the robust loss turns, in units of noise
    endings: tuple[Ending, ...] = ()  # of fits of `base_free` from several starts
    kept: Kept | None = None  # where fits are kept
    shift: np.ndarray | float = 0.0  # added to the misfit: a simulated log is a measured one with other errors

    @classmethod
    def of(cls, experiment: DriveExperiment, train: np.ndarray, kept: Kept | None = None) -> Problem:
        """The problem of an experiment whose noise is not known yet."""
        free = tuple(
            p
            for p in uncertain(experiment.rig)
            if (p.name.rpartition(".")[0] in experiment.components or p.name.startswith("sensor.")) and not p.on_request
        )
        free = marked(experiment, free) + recorder(experiment)
        known = vocabulary(experiment.rig, experiment.components, experiment.measured, experiment)
        hypotheses = tuple(replace(h, free=marked(experiment, h.free)) for h in known)
        nominal = {p.name: p.nominal for p in free}
        ones = np.ones(len(experiment.residuals))
        present = experiment.present(nominal)
        return cls(experiment, train, free, hypotheses, nominal, ones, ones, present, kept=kept)._with_zeros()

    def _with_zeros(self) -> Problem:
        """With where each run begins, where nothing that is measured says it."""
        new = zeros(self.experiment, self.teaching)
        nominal = self._found(new, self.nominal)
        new = [replace(p, nominal=nominal[p.name]) for p in new]
        return replace(self, base_free=(*self.base_free, *new), nominal=nominal) if new else self

    def on(self, experiment: DriveExperiment) -> Problem:
        """The same problem where other samples are simulated."""
        return replace(self, experiment=experiment, present=experiment.present(self.nominal))

    def glance(self, drifting: bool) -> Problem:
        """The same problem for a first look at a hypothesis; at what drifts it takes longer."""
        if not self.by_channel:
            return self if drifting or self.whole else self._excerpt
        return replace(
            self, experiment=self.experiment.glance(self.experiment.seconds if drifting else RULES.residuals.whole_glance)
        )

    def near(self, base: Fit) -> Problem:
        """The problem for a first look, over a base, at what does not drift.

        Of a whole drive its first seconds, but where these show little of what the base leaves: what acts later (a play once the
        load comes to pull the other way) does nothing in them, and no look would see it.
        """
        near = self.glance(False)
        return near if not self.by_channel or self._shown_by(near, base) else self.glance(True)

    def longer(self, base: Fit) -> Problem | None:
        """The problem over as many more seconds of a whole drive's log as show that it is off; None where its own do, or all do not.

        In a part that is sound nothing would be looked for. Where some of what is off is seen, more of it costs more and tells no more.
        """
        at = self.absolute(base.values)
        sound = lambda experiment: excess(experiment, at, self.train).max() <= RULES.search.sound
        if not self.by_channel or not sound(self.experiment):
            return None
        if (whole := self.experiment.whole()) is self.experiment or sound(whole):
            return None
        found = self.experiment
        while found.seconds < RULES.residuals.whole_longest and sound(found):
            found = self.experiment.over(2.0 * found.seconds)
        return self.on(found)

    def _shown_by(self, part: Problem, base: Fit) -> bool:
        """Whether a part of the log shows what the base leaves in all of it, in the channel that is farthest off."""
        every, shown = (problem.excess(base.values) ** 2 - 1.0 for problem in (self, part))
        worst = int(np.argmax(every))
        return bool(shown[worst] >= RULES.residuals.whole_shows * every[worst])

    def with_noise(self) -> Problem:
        """With the noise of each residual's bins, and what no data sheet says as it fits best from several starts.

        Values that are off make noise of their own: it is asked for again where they fit best.
        """
        found = self.with_noise_at(self.nominal)
        if not self.base_free:
            return found
        if self.by_channel:
            found = found.with_noise_at(found._read_when(found.nominal))
        endings = [found._ending(found.nominal | start) for start in starts(self.asked, found.nominal)]
        best = min(endings, key=lambda e: e.loss).end
        if (
            self.whole
        ):  # what it leaves is hardly noise, and it is far from linear: what ends as low as from the start given is left
            apart = min(e.loss for e in endings) < (1.0 - RULES.search.ends_alike) * endings[0].loss
            return replace(found, nominal=best if apart else found.nominal, endings=tuple(endings))
        near = tuple(replace(p, nominal=best[p.name]) for p in self.base_free)  # a guess far off is no scale to fit on
        found = replace(found, base_free=near).with_noise_at(best)
        endings = [replace(found._ending(e.end), start=e.start) for e in endings]
        return replace(found.with_noise_at(min(endings, key=lambda e: e.loss).end), endings=tuple(endings))

    def _read_when(self, values: dict[str, float]) -> dict[str, float]:
        """Values with each channel's shift where it fits best by itself: a signal in steps has slopes that lead nowhere.

        Of a controller of which nothing is said, as it is first taken to be, and as one that acts all the time: whichever fits better.
        """
        loss = lambda values: self.loss(self.misfit(values))
        ends = []
        for found in [values, values | {HOLD: 0.0}] if HOLD in values else [values]:
            for p in self.base_free:
                if p.of_recorder and p.name.endswith(".shift"):
                    places = [found[p.name], *map(float, np.linspace(p.low, p.high, RULES.search.shift_places))]
                    found = min((found | {p.name: place} for place in places), key=loss)
            ends.append(found)
        return min(ends, key=loss)

    @property
    def asked(self) -> tuple[Free, ...]:
        """What no data sheet says, without what recorders did and what belongs to a run."""
        return tuple(p for p in self.base_free if not (p.part or p.of_recorder))

    def _ending(self, start: dict[str, float]) -> Ending:
        """Where a fit of the nominal drive from this start ends."""
        fitted = self.fit(self.base_free, start, RULES.search.effort_first)
        return Ending(start, fitted.values, self.loss(fitted.misfit))

    def with_noise_at(self, values: dict) -> Problem:
        """With the noise of each residual's bins from neighbouring differences, and where the robust loss turns.

        values: of what no data sheet says.
        """
        experiment, known = self.experiment, self.absolute(values)
        stepping.anew(experiment, known)
        sheet.anew(experiment)
        noise, quiet = self.noise.copy(), self.quiet.copy()
        for number, residual in enumerate(experiment.residuals):
            r, count = experiment.binned(residual, known)
            told = count > 0
            if residual.kind == "shafts":  # the mean of a stretch stands in all its bins, and is one value
                told[:, 1:] &= np.diff(r, axis=1) != 0.0
            lag = 1 + experiment.reach(residual) // experiment.layout.per_bin
            recorded = max(of_inputs(experiment, residual)[1], of_written(experiment, residual, known))
            noise[number] = max(of_bins(r, told, experiment.steady, lag), recorded)
            if residual.kind == "whole":
                rounding = of_rounding(experiment, residual, known)[1]
                driving = of_driving(experiment, residual, known)[1]
                formulas = of_formulas(experiment, residual, known)
                steps = stepping.of_steps(experiment, residual, known)[2]
                noise[number] = max(noise[number], rounding, formulas, driving, steps)
            if not experiment.steady:
                quiet[number] = min(1.0, max(of_quiet_bins(r, told, lag), recorded) / noise[number])
        found = replace(self, noise=noise, quiet=quiet, nominal=self.nominal | values)
        r = found.misfit(found.nominal)[self.rows]
        return replace(found, loss_scale=max(RULES.search.loss_scale, RULES.search.loss_median * float(np.median(abs(r)))))

    @property
    def shape(self) -> tuple[int, int]:
        """Of a misfit: blocks, bins of all residuals."""
        return self.present.shape

    @cached_property
    def rows(self) -> np.ndarray:
        """Which entries of a flat misfit teach."""
        return (self.present & self.train[:, None]).ravel()

    def alike(self, a: Fit, b: Fit) -> bool:
        """Whether two fits leave the same of what teaches: within a share of a usual misfit (root mean square)."""
        difference = (a.misfit - b.misfit)[self.rows]
        return bool(np.sqrt(np.mean(difference**2)) < RULES.search.same_law * self.loss_scale / RULES.search.same_misfit)

    def done(self, amounts: Sequence[Free], fitted: Fit) -> float:
        """How much these amounts do to the misfit where a fit ended: the length of the change of what teaches."""
        change = self.misfit({**fitted.values, **{p.name: p.nominal for p in amounts}}) - fitted.misfit
        return float(np.linalg.norm(change[self.rows]))

    @cached_property
    def blocks(self) -> np.ndarray:
        """The block of each entry of a flat misfit."""
        return np.repeat(np.arange(self.shape[0]), self.shape[1])

    @cached_property
    def fold_of_block(self) -> np.ndarray:
        """The fold of each block; of those that do not teach 0."""
        found = np.zeros(self.shape[0], int)
        found[self.train] = np.arange(self.train.sum()) % RULES.search.folds
        return found

    @cached_property
    def folds(self) -> np.ndarray:
        """The fold of each entry of a flat misfit."""
        return np.repeat(self.fold_of_block, self.shape[1])

    @property
    def whole(self) -> bool:
        """Whether a whole drive is simulated and seen in its motion alone, which is far from linear in its parameters."""
        return any(residual.kind == "drive" for residual in self.experiment.residuals)

    @property
    def by_channel(self) -> bool:
        """Whether every channel is compared with a whole drive's."""
        return self.experiment.by_channel

    def excess(self, values: dict, without: dict | None = None) -> np.ndarray:
        """Error of each residual's samples over their noise, in the blocks that teach; see residuals.mending.excess."""
        return excess(self.experiment, self.absolute(values), self.train, None if without is None else self.absolute(without))

    def misfit(self, values: dict) -> np.ndarray:
        """Flat, in units of the noise; values counted above another are put back on it."""
        return self.experiment.misfit(self.absolute(values), self.noise).ravel() + self.shift

    def misfit_of(self, values: dict, of: Sequence[int], columns: np.ndarray) -> np.ndarray:
        """The misfit of the residuals at these places alone, (blocks, bins); columns: where their bins stand among all."""
        shift = np.reshape(self.shift, self.shape)[:, columns] if np.ndim(self.shift) else self.shift
        return self.experiment.misfit(self.absolute(values), self.noise, of) + shift

    def absolute(self, values: dict) -> dict:
        """Values as the laws have them, those counted above another put back on it."""
        out = dict(values)
        for p in self._above:
            if p.name in values:
                out[p.name] = self.experiment.setting.value(p.above, values) + values[p.name]
        return out

    @cached_property
    def _above(self) -> list[Free]:
        """What is counted above another number."""
        return [p for hypothesis in self.hypotheses for p in hypothesis.free if p.above]

    def fit(self, free: tuple[Free, ...], start: dict, effort: int = RULES.search.effort) -> Fit:
        """Robust least squares on the samples that teach; what recorders did is a matter of a few last steps.

        What `start` has beside what is free stays as it is. A phase that each run has of its own is freed for each of them,
        started where it fits best.
        """
        free, start = self._with_phases(free, start)
        if self.kept is None:
            return self._fit(free, start, effort)
        begin = {p.name: float(start[p.name]) for p in free}
        at = start | {p.name: begin[p.name] if np.isfinite(begin[p.name]) else p.nominal for p in free}
        key = self.kept.key(self.misfit(at), free, begin, effort, self.loss_scale, self.by_channel, self.rows.tobytes())
        if found := self.kept.get(key):
            values = {p.name: float(value) for p, value in zip(free, found["values"])}
            return Fit(free, values, found["misfit"], found["jacobian"], found["weights"], self.by_channel)
        fitted = self._fit(free, start, effort)
        at_end = np.array([fitted.values[p.name] for p in free])
        self.kept.put(key, values=at_end, misfit=fitted.misfit, jacobian=fitted.jacobian, weights=fitted.weights)
        return fitted

    def to_its_end(self, fitted: Fit) -> Fit:
        """A fit made again from where it ended, as long as what it leaves then differs."""
        for _ in range(RULES.search.again):
            further = self.fit(fitted.free, dict(fitted.values))
            if self.loss(fitted.misfit) < RULES.search.alike * self.loss(further.misfit):
                break
            fitted = further
        return fitted

    def _fit(self, free: tuple[Free, ...], start: dict, effort: int) -> Fit:
        """Of a long log by an excerpt, where what that ends with is the same in all of the log; else by all of it."""
        if free and self._told_nearby:
            found = self._fitted(self._nearby, free, start, effort)
            values = start | found.values
            r = self.misfit(values)
            if _same(r, found.misfit) and _same(slopes := jacobian(self.misfit, values, free, found.values, r), found.jacobian):
                return replace(found, misfit=r, jacobian=slopes, weights=weight(r, self.loss_scale))
        return self._fitted(self.misfit, free, start, effort)

    def _fitted(self, misfit: Misfit, free: tuple[Free, ...], start: dict, effort: int) -> Fit:
        rules = RULES.search
        tolerances = rules.tolerances_whole if self.whole or self.by_channel else rules.tolerances
        drive = of_drive(free)
        if 0 < len(drive) < len(free):
            first = fit(misfit, start, drive, start, self.rows, self.loss_scale, effort, tolerances, self.by_channel)
            start, effort = start | first.values, min(effort, rules.effort_recorders)
            beside = tuple(p for p in free if p not in drive)  # of which none asks for a simulation
            read = fit(misfit, start, beside, start, self.rows, self.loss_scale, effort, tolerances, self.by_channel)
            start = start | read.values
        return fit(misfit, start, free, start, self.rows, self.loss_scale, effort, tolerances, self.by_channel)

    @cached_property
    def _excerpt(self) -> Problem:
        return replace(self, experiment=self.experiment.excerpt())

    @cached_property
    def _told_nearby(self) -> frozenset[int]:
        """Places of the residuals of which an excerpt of a long log says the same as all of it, of the nominal drive."""
        near = self if self.by_channel else self.glance(False)
        if near.experiment is self.experiment:
            return frozenset()
        at = self.absolute(self.nominal)
        own, others = self.experiment.misfit(at), near.experiment.misfit(at)
        parts = map(self.experiment.slice, self.experiment.residuals)
        return frozenset(i for i, part in enumerate(parts) if _same(own[:, part].ravel(), others[:, part].ravel()))

    def _seen_nearby(self, fitted: Fit) -> bool:
        """Whether an excerpt says the same of where a fit ended, and of all ways from there."""
        at = self._nearby(fitted.values)
        return _same(fitted.misfit, at) and _same(
            fitted.jacobian, jacobian(self._nearby, fitted.values, fitted.free, fitted.values, at)
        )

    def _nearby(self, values: dict) -> np.ndarray:
        """The misfit, of an excerpt where that says the same."""
        at, near = self.absolute(values), self.glance(False).experiment
        of = lambda i: (near if i in self._told_nearby else self.experiment).misfit(at, self.noise, [i])
        return np.concatenate([of(i) for i in range(len(self.noise))], axis=1).ravel() + self.shift

    def _with_phases(self, free: tuple[Free, ...], start: dict) -> tuple[tuple[Free, ...], dict]:
        """What a fit frees and where it starts, with the phases of single runs."""
        new = [p for p in beside(self.experiment, free, self.teaching) if p.name not in {q.name for q in free}]
        return (*free, *new), self._found(new, start)

    def _found(self, new: list[Free], start: dict) -> dict:
        """Where a fit starts, with these numbers of single runs where they fit best; those that have a start keep it."""
        for whose in dict.fromkeys(parameter(p.name) for p in new):
            every = self.experiment.runs
            mine = [i for i, run in enumerate(every) if name(run, whose) in {p.name for p in new}]

            def loss(values: dict, mine: list[int] = mine) -> np.ndarray:
                return losses(self.experiment, self.misfit(values) * self.rows, self.loss_scale)[mine]

            start = best(loss, start, [every[i] for i in mine], whose) | start
        return start

    @cached_property
    def teaching(self) -> list[int]:
        """Runs with blocks that teach."""
        return sorted({int(i) for i in self.experiment.layout.run_of[self.train]})

    def settled(self, experiment: Experiment, values: dict, free: tuple[Free, ...], seen: np.ndarray | None = None) -> dict:
        """Values of a fit that freed these, for an experiment that may have runs that did not teach: with what is theirs.

        seen: blocks to which that is fitted; all.
        """
        taught = {self.experiment.runs[i].key for i in self.teaching}
        return settled(experiment, values, free, taught, self.noise, self.loss_scale, seen)

    def with_these(self, causes: list[Candidate], fitted: Fit) -> Fit:
        """What is fitted, fitted again with these causes alone."""
        names = {p.name for c in causes for p in c.free} | {p.name for p in self.base_free}
        free = tuple(p for p in fitted.free if p.name in names)
        return self.fit(free, {p.name: fitted.values[p.name] for p in free})

    def held_out(self, fitted: Fit) -> np.ndarray:
        """Misfit of each fold under the fit to the others: linear where that can be believed, else simulated."""
        linear = held_out(fitted, self.rows, self.folds)
        if not self.whole and self.block_loss(linear).sum() < RULES.search.wild * self.block_loss(fitted.misfit).sum():
            return linear
        misfit = self._nearby if self._told_nearby and self._seen_nearby(fitted) else self.misfit
        return held_out(fitted, self.rows, self.folds, misfit, self.loss_scale)

    def loss(self, misfit: np.ndarray) -> float:
        """The robust loss of a flat misfit's entries that teach."""
        return float(rho(misfit[self.rows], self.loss_scale).sum())

    def block_loss(self, misfit: np.ndarray) -> np.ndarray:
        """What each residual adds to the mean loss of each training block, (blocks, residuals)."""
        loss = (rho(misfit, self.loss_scale) * self.rows).reshape(self.shape)
        sums = np.stack([loss[:, self.experiment.slice(residual)].sum(1) for residual in self.experiment.residuals], 1)
        return sums[self.train] / np.maximum(self.rows.reshape(self.shape).sum(1)[self.train, None], 1)

    @cached_property
    def new(self) -> np.ndarray:
        """Share of each residual's entries that are independent of their neighbours.

        A moving mean over `reach` samples has as many independent values as it is times shorter than the log, so that a bin of
        fewer samples is a part of one.
        """
        layout, reach = self.experiment.layout, self.experiment.reach
        return np.array([min(1.0, layout.per_bin / reach(residual)) for residual in self.experiment.residuals])

    @cached_property
    def entries(self) -> np.ndarray:
        """How many entries of each residual teach, (training blocks, residuals)."""
        rows = self.rows.reshape(self.shape)[self.train]
        return np.stack([rows[:, self.experiment.slice(residual)].sum(1) for residual in self.experiment.residuals], 1)

    def residual_errors(self, misfit: np.ndarray) -> np.ndarray:
        """Root of the mean loss over training blocks, for each residual."""
        loss, rows = (rho(misfit, self.loss_scale) * self.rows).reshape(self.shape), self.rows.reshape(self.shape)
        residuals = map(self.experiment.slice, self.experiment.residuals)
        return np.array([np.sqrt(loss[:, s].sum() / max(1, rows[:, s].sum())) for s in residuals])

    def taught(self, samples: np.ndarray) -> np.ndarray:
        """Samples of the training blocks, (blocks, bins of all residuals)."""
        return (samples * self.rows).reshape(self.shape)[self.train]


def of_drive(free: Sequence[Free]) -> tuple[Free, ...]:
    """Of what a fit frees, what moves the drive; the rest is what recorders make of it."""
    return tuple(p for p in free if p.name in MOVING or not p.of_recorder)


def _same(all_of_it: np.ndarray, part: np.ndarray) -> bool:
    """Whether what an excerpt says (each column of it) misses what all of a log does by no more than ends a fit."""
    missed = np.sum((all_of_it - part) ** 2, axis=0)
    return bool(np.all(missed <= RULES.search.tolerances[0] ** 2 * np.sum(all_of_it**2, axis=0)))
