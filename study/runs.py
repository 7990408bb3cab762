"""The runs of the study: eight of the paper, and those that its claims about standstill, contact and advice need."""

from __future__ import annotations

import hashlib
import json
import signal
import tempfile
import time as clock
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import ExitStack
from dataclasses import dataclass, field
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from selflock.fmus import temporary
from selflock.fmus.build import built
from selflock.fmus.cache import write
from selflock.master import PartFailed, load, read, run
from selflock.master.isolation import with_parent
from selflock.master.system import System
from selflock.master.values import resolved
from selflock.vehicle import Robot

from .claims import LIMIT, Curves, Facts, Runs

SYSTEM = Path(__file__).with_name("robot.toml")
FRICTION = (0.0, 0.01, 0.02, 0.03)
SWEEP = (0.0, 0.005, 0.01, 0.015, 0.0175, 0.02, 0.0225, 0.025, 0.03, 0.035, 0.04, 0.05, 0.06)
CONTACT = ("ground_stiffness", "ground_damping", "ground_depth")
POSTURE_EVERY = 0.04  # s


@dataclass(frozen=True)
class Case:
    """One run: what it varies, its settings beyond the system file, and whether its postures are kept."""

    group: str  # kinematic | dynamic | standstill | contact | sweep
    key: Any
    mode: str
    friction: float
    settings: dict[str, Any] = field(default_factory=dict)
    postures: bool = False

    @property
    def name(self) -> str:
        key = "_".join(str(part) for part in self.key) if isinstance(self.key, tuple) else self.key
        return f"{self.group}_{key}"


def cases() -> list[Case]:
    """All runs, the long ones first."""
    dynamic = [Case("dynamic", mu, "dynamic", mu, postures=mu == FRICTION[-1]) for mu in FRICTION]
    kinematic = [Case("kinematic", mu, "kinematic", mu) for mu in FRICTION]
    standstill = [Case("standstill", 0, "kinematic", 0.0, {"setpoints.sprocket_speed_set": 0.0})]
    contact = [Case("contact", (name, factor), "kinematic", 0.0) for name in CONTACT for factor in (0.7, 1.3)]
    sweep = [Case("sweep", mu, "dynamic", mu, {"robot.track": "belt"}) for mu in SWEEP]
    return dynamic + sweep + kinematic + standstill + contact


def system(mode: str = "dynamic", path: Path = SYSTEM) -> System:
    """The robot's system. In kinematic mode the motion is imposed on the reducers' input shafts: no motors, no controllers."""
    robot = load(path)
    if mode == "kinematic":
        gone = {name for name in robot.components if name.endswith(("_controller", "_motor"))}
        robot.components = {name: component for name, component in robot.components.items() if name not in gone}
        robot.connections = {
            target: connection
            for target, connection in robot.connections.items()
            if not gone & {_owner(target), _owner(connection.source)}
        }
        robot.bonds = [bond for bond in robot.bonds if not gone & {_owner(bond.effort), _owner(bond.flow)}]
        robot.run.order = [name for name in robot.run.order if name not in gone]
        robot.run.open_inputs = True  # no motor drives the reducers
        for name in reducers(robot):
            robot.components[name].start["kinematic"] = True
    return robot


def reducers(robot: System) -> list[str]:
    return [name for name in robot.components if name.endswith("_reducer")]


def _owner(name: str) -> str:
    return name.partition(".")[0]


def settings_of(case: Case, robot: System) -> dict[str, Any]:
    """Everything that makes this run differ from the system file."""
    mu = case.friction
    settings: dict[str, Any] = {f"{name}.friction_{kind}": mu for name in reducers(robot) for kind in ("kinetic", "static")}
    for name in robot.components:
        if name.endswith("_controller"):
            settings |= {f"{name}.friction_static": mu, f"{name}.irreversible": mu >= LIMIT}
    if case.group == "contact":
        parameter, factor = case.key
        settings[f"robot.{parameter}"] = factor * robot.components["robot"].start[parameter]
    return settings | case.settings


@dataclass
class Done:
    """A finished run: its table's file, the coupling's energy error, and the postures by time."""

    case: Case
    path: Path
    energy: Any
    postures: dict[float, dict]
    seconds: float


def run_case(case: Case, folder: Path, identity: str = "") -> Done:
    """Run one case and write its table as Parquet; what was run before by the same study is taken as it is."""
    if (known := _kept(case, folder, identity)) is not None:
        return known
    robot = system(case.mode)
    postures: dict[float, dict] = {}

    def observe(time: float, parts) -> None:
        if time >= len(postures) * POSTURE_EVERY - 1e-9:
            postures[round(time, 6)] = parts["robot"].posture()

    path = folder / f"{case.name}.parquet"
    began = clock.perf_counter()
    try:
        result = run(robot, settings=settings_of(case, robot), out=path, observe=observe if case.postures else None)
    except PartFailed as failed:
        failed.args = (f"run {case.name}: {failed}",)
        raise
    done = Done(case, path, result.energy, postures, clock.perf_counter() - began)
    _keep(done, identity)
    return done


def _keep(done: Done, identity: str) -> None:
    """Beside its table, what else there is of a run; the table is there whole by then."""
    told = {
        "study": identity,
        "energy": done.energy.to_dict("split"),
        "postures": [
            [time, {name: points.tolist() for name, points in posture.items()}] for time, posture in done.postures.items()
        ],
        "seconds": done.seconds,
    }
    write(done.path.with_suffix(".json"), json.dumps(told).encode())


def _kept(case: Case, folder: Path, identity: str) -> Done | None:
    """A run of this very study that is in the folder."""
    path = folder / f"{case.name}.parquet"
    try:
        told = json.loads(path.with_suffix(".json").read_text("utf-8"))
        if not path.is_file() or told["study"] != identity or not identity:
            return None
        postures = {time: {name: np.array(points) for name, points in posture.items()} for time, posture in told["postures"]}
        return Done(case, path, pd.DataFrame(**told["energy"]), postures, told["seconds"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def identity() -> str:
    """What decides the bits of the runs: sources, systems, libraries."""
    whole = hashlib.sha256()
    for room in ("fmus", "master", "vehicle", "study"):
        spec = find_spec(f"selflock.{room}")
        if spec is not None and spec.origin is not None:
            for file in sorted(path for path in Path(spec.origin).parent.rglob("*") if path.suffix in (".py", ".toml", ".c")):
                whole.update(file.name.encode() + b"\0" + file.read_bytes())
    whole.update(repr([version(name) for name in ("numpy", "numba", "pymunk", "pyarrow")]).encode())
    return whole.hexdigest()


def _alone(room: str) -> None:
    """In each process of the study: who stops it is heard by the first, which ends the others and takes `room` away."""
    tempfile.tempdir = room
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    with_parent()


def run_all(folder: Path, progress: Callable[[str, int, int], None] | None = None, workers: int = 2) -> list[Done]:
    """All cases, side by side in processes of their own. `progress` is told each finished case, how many, of how many."""
    folder.mkdir(parents=True, exist_ok=True)
    todo = cases()
    for name in ("Reducer", "Motor", "Controller"):
        built(name)  # once, before the processes ask for them
    done = []
    mine = identity()
    with ExitStack() as stack:
        room = temporary.folder("study_")
        stack.callback(temporary.remove, room)
        pool = stack.enter_context(ProcessPoolExecutor(workers, initializer=_alone, initargs=(str(room),)))
        futures = [pool.submit(run_case, case, folder, mine) for case in todo]
        try:
            for future in as_completed(futures):
                done.append(future.result())
                if progress:
                    progress(done[-1].case.name, len(done), len(todo))
        except BaseException as error:
            for process in list(pool._processes.values()):
                process.terminate()
            pool.shutdown(cancel_futures=True)
            if isinstance(error, KeyboardInterrupt):
                finished = len(list(folder.glob("*.json")))
                error.args = (
                    f"The study was stopped; {finished} of its {len(todo)} runs are finished and kept in {folder}, and the same command goes on.",
                )
            raise
    return sorted(done, key=lambda one: todo.index(one.case))


def facts(robot: System) -> Facts:
    """The parameters that the claims need, as the system file has them."""
    robot = resolved(robot)
    reducer, motor = robot.components["rear_reducer"].start, robot.components["rear_motor"].start
    return Facts(
        gear_ratio=reducer["gear_ratio"],
        resistance=motor["resistance"],
        torque_constant=motor["torque_constant"],
        sprocket_radius=Robot("robot", **robot.components["robot"].start).get("sprocket_radius"),
    )


def read_runs(done: list[Done]) -> Runs:
    """The tables of finished runs, ordered for the claims."""
    runs = Runs(facts(system()))
    for one in done:
        curves = Curves(read(one.path)[0])
        if one.case.group == "standstill":
            runs.standstill = curves
        else:
            getattr(runs, one.case.group)[one.case.key] = curves
    return runs
