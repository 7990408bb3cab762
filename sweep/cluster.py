"""Runs in processes of this machine or on an existing Dask cluster: the same code for both.

The parcel goes to the workers as a Dask plugin, so each gets it once, and one that is restarted or comes later gets it,
too.
"""

from __future__ import annotations

import logging
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

import dask
from distributed import Client, Future, LocalCluster, WorkerPlugin, get_worker

from selflock.master.stops import held

from .errors import SweepError
from .work import RUNS, Parcel, fingerprint, work

ANSWER = 10.0  # s that a scheduler has to answer
START = 120.0  # s that a process has to begin, on a busy machine, too: Dask's own wait for one that hangs as it begins has no end
UNSTARTED = (AssertionError, RuntimeError)  # all that Dask says where its loop or a process of its did not start
QUIET = {  # what Dask does beside the runs, many times a second if it is let: 6 % of a core, so 1 %
    "distributed.worker.profile.enabled": False,  # looks at the stack every 10 ms
    "distributed.admin.tick.interval": "1s",  # of each event loop, every 20 ms
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.scheduler.active-memory-manager.start": False,  # no result has copies
}


class Holder(WorkerPlugin):
    """Keeps the parcel on a worker as long as the worker, or the sweep, lives."""

    def __init__(self, parcel: Parcel):
        self.parcel = parcel

    def teardown(self, worker: Any) -> None:
        self.parcel.close()


class Pool:
    """Workers that hold the parcel."""

    def __init__(self, client: Client, name: str, function: Callable):
        self.client, self.name, self.function = client, name, function

    @property
    def slots(self) -> int:
        """How many runs can be made at once."""
        return sum(self.client.nthreads().values())

    @property
    def alive(self) -> bool:
        return self.client.status == "running"

    def send(self, items: list, key: str) -> Future:
        return self.client.submit(_work_there, self.name, self.function, items, key=key, pure=False)

    def gather(self, futures: list[Future]) -> list:
        """The results of finished futures, in one message."""
        return self.client.gather(futures) if futures else []


def _work_there(name: str, function: Callable, items: list) -> tuple:
    worker = get_worker()
    if worker.nanny:  # a process of its own: what is unpacked there goes with it, even if it is killed
        tempfile.tempdir = worker.local_directory
    held = worker.plugins[name]
    assert isinstance(held, Holder)
    return work(function, held.parcel.open(worker.local_directory), items)


@contextmanager
def pool(parcel: Parcel, function: Callable, workers: int, scheduler: str | None, folder: Path) -> Iterator[Pool]:
    """Workers of this machine, working in `folder`, or those of the cluster of `scheduler`."""
    with ExitStack() as stack:
        stack.enter_context(_quietly())
        address = scheduler or _local(workers, folder, stack)
        try:
            client = stack.enter_context(_patiently(Client, address, timeout=ANSWER, set_as_default=False))
        except (OSError, ValueError) as error:
            raise SweepError(
                f"No Dask scheduler answers at {address} ({type(error).__name__}). "
                "Start one with `dask scheduler`, or check the address. Nothing is lost."
            ) from error
        if scheduler:  # elsewhere something else may be installed
            _same_everywhere(client, scheduler, (*RUNS, "selflock.sweep", function.__module__))
        _patiently(client.register_plugin, Holder(parcel), name=parcel.name, wrong=OSError)  # a worker dies as it is given it
        stack.callback(_leave, client, parcel.name)
        if not scheduler:
            stack.callback(_all_back, client, workers)
        yield Pool(client, parcel.name, function)


def _local(workers: int, folder: Path, stack: ExitStack) -> str:
    """The address of a cluster of this machine, which ends with the stack."""
    _refuse_unguarded(getattr(sys.modules["__main__"], "__file__", None))
    # No failure is allowed here: whether a run is tried again is decided in engine.py, which knows who was to blame.
    given = {"distributed.scheduler.allowed-failures": 0, "temporary-directory": str(folder), **QUIET}
    stack.enter_context(dask.config.set(given))
    cluster = _begun(
        stack,
        LocalCluster,
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",
        local_directory=str(folder),
        silence_logs=logging.CRITICAL,
        death_timeout=START,
    )
    return cluster.scheduler_address


def _refuse_unguarded(script: str | None) -> None:
    """Refuse a script that each process of ours, which begins by importing it, would run again."""
    path = Path(script) if script else None
    if path and path.suffix == ".py" and path.is_file() and "__name__" not in path.read_text(encoding="utf-8", errors="replace"):
        raise SweepError(
            f"{path}: its processes begin by importing this script, and would do all of it again. Put what it does under "
            'if __name__ == "__main__": and start it again.'
        )


def _begun(stack: ExitStack, make: Callable, **given: Any) -> Any:
    """Begin processes that Ctrl-C is not meant for, whole: this one ends them. They take on what their thread does not hear.

    They are in the stack before a signal that came meanwhile is heard: else it would end this process, and not them.
    """
    with held():
        resource_tracker.ensure_running()  # which would let the thread hear again
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if hasattr(signal, "pthread_sigmask") else None
        try:
            return stack.enter_context(_patiently(make, wrong=(*UNSTARTED, TimeoutError), **given))
        finally:
            if before is not None:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _quietly() -> Iterator[None]:
    """Without what Dask's own tasks say of an end that we tell."""
    log = logging.getLogger("asyncio")
    level = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        log.setLevel(level)


def _patiently(
    make: Callable,
    *given: Any,
    wrong: type[Exception] | tuple[type[Exception], ...] = UNSTARTED,
    **more: Any,
) -> Any:
    """make(...), tried again once where something is `wrong`: Dask gives its own event loop 10 s to start, which a busy machine may not keep, and a process of its may be killed before it is there."""
    for _ in range(2):
        try:
            return make(*given, **more)
        except wrong:
            continue
    raise SweepError(
        "Dask did not start, twice: this machine is too busy, its disk is full, or something ends processes. Nothing is lost; "
        "give the same command again."
    )


def _all_back(client: Client, workers: int) -> None:
    """Wait for a worker that is being started again: Dask's own closing fails in between (a process not yet begun is joined)."""
    if client.status != "running":
        return
    try:
        client.wait_for_workers(workers, timeout=ANSWER)
    except Exception:  # it will not come back; what was computed is on disk
        logging.getLogger(__name__).debug("a worker did not come back", exc_info=True)


def _leave(client: Client, name: str) -> None:
    if client.status != "running":
        return
    try:
        client.unregister_worker_plugin(name)
    except Exception:  # the cluster may go at this very moment, and then it holds nothing of ours
        logging.getLogger(__name__).debug("the cluster did not answer", exc_info=True)


def _same_everywhere(client: Client, address: str, packages: tuple[str, ...]) -> None:
    """Refuse workers that would give other bits."""
    mine = fingerprint(*packages)
    try:
        theirs = client.run(fingerprint, *packages)
    except Exception as error:
        raise SweepError(
            f"A worker of {address} cannot use selflock ({type(error).__name__}: {error}). Install the same version there."
        ) from error
    if not theirs:
        raise SweepError(f"The scheduler at {address} has no workers. Start some with `dask worker {address} --nthreads 1`.")
    for worker, other in theirs.items():
        if differs := [f"{name} ({mine[name]} here, {other.get(name)} there)" for name in mine if mine[name] != other.get(name)]:
            raise SweepError(
                f"Worker {worker} would not give the same bits: it differs in {', '.join(differs)}. Install the same there."
            )
