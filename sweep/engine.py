"""Many independent runs: resumable, in any order, on as many workers as there are.

    rows = map_runs(function, items, context=..., folder="out/null", about={"what": "null distribution", "seed": 7})

`function(context, item)` is a module's function that gives a dictionary of figures; whatever chance it needs comes from
a seed in the item. Then the rows do not depend on the number of workers, on the order, or on interruptions.
"""

from __future__ import annotations

import logging
import os
import queue
import shutil
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from selflock.fmus import temporary
from selflock.master.stops import Stops, held

from .errors import Interrupted, SweepError
from .store import Row, Store, digest
from .work import Outcome, Parcel, fingerprint, work

log = logging.getLogger(__name__)

BATCH_SECONDS = 1.0  # a batch of short runs: what an interruption may cost, and what hides the cost of a message
TASKS_PER_SECOND = 200  # what the scheduler is to be burdened with at most: with more workers, batches grow
PATIENCE = 60.0  # s without any worker until the sweep gives up
GONE = "The scheduler is gone. What was finished is kept; start a scheduler and give the same command again."

Take = Callable[[list[int], list[Outcome]], None]


def map_runs(
    function: Callable[[Any, Any], Any],
    items: Sequence[Any],
    *,
    context: Any = None,
    folder: str | Path | None = None,
    about: Mapping[str, Any] | None = None,
    columns: Callable[[Any], Row] = lambda item: {},
    sources: Sequence[str] = (),
    growing: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: bool = False,
    title: str = "runs",
) -> list[Row]:
    """One row for each item, in their order: key, columns(item), status ("ok" or "failed"), reason, figures.

    items      plain data (what JSON can hold); equal items are run once
    context    what every run needs; pickled, shipped to each worker once. Its open(folder) and close() are called there
    folder     keeps each finished run at once; the same call goes on where it was. None: nothing is kept
    about      plain data that, with the items, tells this study from another
    sources    packages that decide a row: a folder made by another state of them is refused
    growing    the folder may hold runs of other items as well, and keeps them: a study made bit by bit
    workers    processes on this machine, all cores when not given; 0: in this process, without Dask
    scheduler  address of an existing Dask scheduler, instead of workers
    function   may give (figures, files) with files to be kept in the folder, {name: bytes}
    """
    if workers is not None and workers < 0:
        raise SweepError(f"{workers} workers: give how many processes make runs, 0 for this one alone.")
    keys = [digest(item) for item in items]
    with ExitStack() as stack:
        store = None
        if folder is not None:
            identity = {"function": f"{function.__module__}.{function.__qualname__}", **(about or {})}
            identity |= {} if growing else {"runs": digest(keys)}
            identity |= {"sources": fingerprint(*sources)} if sources else {}
            store = Store(folder, identity)
            stack.callback(store.close)
        rows: dict[str, Row] = {key: store.rows[key] for key in keys if key in store.rows} if store else {}
        order = list(dict.fromkeys(keys))
        item_of = dict(zip(keys, items))
        todo = deque(number for number, key in enumerate(order) if key not in rows)

        log.info("%s: %d of %d are to be done", title, len(todo), len(order))
        shown = stack.enter_context(_progress(progress))
        failed = sum(row["status"] == "failed" for row in rows.values())
        bar = shown.add_task(title, total=len(order), completed=len(order) - len(todo), failed=failed)

        def take(numbers: list[int], outcomes: list[Outcome]) -> None:
            new, files = [], {}
            for number, outcome in zip(numbers, outcomes):
                key = order[number]
                if outcome.reason is not None:
                    log.info("%s: number %d failed: %s", title, number, outcome.reason)
                status = {"status": "ok" if outcome.reason is None else "failed", "reason": outcome.reason}
                new.append({"key": key, **columns(item_of[key]), **status, **outcome.figures})
                files.update(outcome.files)
            if store:
                store.add(new, files)
                store.compact(keys)
            rows.update((row["key"], row) for row in new)
            shown.update(bar, advance=len(new), failed=sum(row["status"] == "failed" for row in rows.values()))

        try:
            if todo:
                with Stops():
                    _run(function, context, [item_of[key] for key in order], todo, take, folder, workers, scheduler)
        except KeyboardInterrupt:
            kept = f"{len(rows)} of {len(order)} runs are finished" + (
                " and kept; give the same command to go on." if store else "."
            )
            raise Interrupted(f"Interrupted: {kept}") from None
        if store:
            store.compact(keys, force=True)
        return [rows[key] for key in keys]


def _run(function, context, items, todo: deque, take: Take, folder, workers, scheduler) -> None:
    parcel = Parcel(context)
    with ExitStack() as stack:
        if folder is None:
            place = temporary.folder()
            stack.callback(temporary.remove, place)
        else:
            place = Path(folder) / "work"
            with held():
                place.mkdir()
                stack.callback(shutil.rmtree, place, ignore_errors=True)
        if workers == 0 and scheduler is None:
            stack.callback(parcel.close)
            for number in todo:
                take([number], work(function, parcel.open(place), [items[number]])[0])
            return
        try:
            from .cluster import pool
        except ImportError:
            raise SweepError("Several workers need Dask: pip install 'selflock[sweep]'.") from None
        count = min(workers or os.cpu_count() or 1, len(todo))
        with pool(parcel, function, count, scheduler, place) as there:
            _on_pool(there, items, todo, take)


def _on_pool(pool, items: list, todo: deque, take: Take) -> None:
    """Every run once; those whose worker died once more, each by itself; then it is known which of them kill."""
    suspects = _round(pool, items, todo, take)
    killers = _round(pool, items, deque(n for batch, _ in suspects for n in batch), take, single=True)
    deaths = Counter(worker for _, worker in killers)
    unclear = deque(n for batch, worker in killers if deaths[worker] > 1 for n in batch)  # shared a worker with another
    killers = [death for death in killers if deaths[death[1]] == 1] + _round(pool, items, unclear, take, single=True, at_once=1)
    for batch, _ in killers:
        take(batch, [Outcome("it killed its worker, twice (a crash of an FMU, or no memory left)", {}, {})])


def _round(
    pool, items: list, todo: deque, take: Take, single: bool = False, at_once: int | None = None
) -> list[tuple[list[int], str]]:
    """Send all of todo, no more at once than there are slots; give the batches whose worker died, with its address."""
    from distributed import KilledWorker

    done: queue.SimpleQueue = queue.SimpleQueue()
    flying: dict[Any, list[int]] = {}
    dead = []
    slots = pool.slots
    seconds, waited = BATCH_SECONDS, 0.0  # of a run as known so far; without workers
    while todo or flying:
        while todo and len(flying) < (at_once or slots):
            size = 1 if single else _batch(seconds, slots, len(todo))
            batch = [todo.popleft() for _ in range(size)]
            future = pool.send([items[n] for n in batch], key=f"run-{batch[0]}-{'again' if single else size}-{id(done)}")
            flying[future] = batch
            future.add_done_callback(done.put)
        came = _come(done)
        if not pool.alive:
            raise SweepError(GONE)
        good = [future for future in came if future.status == "finished"]
        try:
            results = pool.gather(good)
            slots = slots if came else pool.slots
        except (OSError, CancelledError):  # it went between what it told and what it was asked
            raise SweepError(GONE) from None
        if not came:
            waited = 0.0 if slots else waited + 1.0
            if waited > PATIENCE:
                raise SweepError(
                    "All workers are gone. What was finished is kept; start workers and give the same command again."
                )
        for future, (outcomes, took) in zip(good, results):
            seconds = took / len(flying[future])
            take(flying.pop(future), outcomes)
        for future in set(came) - set(good):
            try:
                future.result()
            except KilledWorker as death:
                dead.append((flying.pop(future), death.last_worker.address))
            except CancelledError:
                raise SweepError(
                    "The scheduler is gone or cancelled a run. What was finished is kept; give the same command again."
                ) from None
    return dead


def _come(done: queue.SimpleQueue) -> list:
    """All futures that are done, none after a second in vain."""
    came = []
    try:
        came.append(done.get(timeout=1.0))
        while True:
            came.append(done.get_nowait())
    except queue.Empty:
        return came


def _batch(seconds: float, slots: int, left: int) -> int:
    """Runs in one message: enough to last, never so many that workers stand idle in the end."""
    lasting = max(BATCH_SECONDS, slots / TASKS_PER_SECOND)
    return max(1, min(round(lasting / max(seconds, 1e-6)), left // (2 * max(slots, 1))))


def _progress(on: bool) -> Progress:
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[failed]} failed"),
        TimeElapsedColumn(),
        TextColumn("left:"),
        TimeRemainingColumn(),
        disable=not on,
        speed_estimate_period=600,
    )
