"""Masters compared in one run on the same FMUs and the same step: ours, Ecos, libcosim and a plain FMPy loop.

    python -m benchmarks.masters [--instances 2 8 32 100] [--steps 1000] [--processor]

A ring of equal FMUs, each given its neighbour's output, coupled by Jacobi with a fixed step of 1 ms; every master
reads the same .ssp. Timed from the first step to the last; loading and initialization are left out. The masters
take turns, the least of several turns counts. Ecos and libcosim are left out with a word where they are not
installed (extra `masters`; Ecos needs libtbb12). They can be called once for many steps, or once for each step, as
who wants to look or to steer between steps does. The same native FMU comes in FMI 3.0, and one for model exchange, which FMPy's loop integrates by
CVODE as ours does; the other masters take neither, or say so. --processor: processor time of all threads in place of the
clock's, where the machine has other work. Our master is called once; it keeps a table of every output at every
step and checks every number, which the others do not. Bare: the C calls alone, through ctypes.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import zipfile
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import fmpy
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.sundials import CVodeSolver
from rich.console import Console
from rich.table import Table

from benchmarks.master_cost import bare
from selflock import master
from selflock.fmus.build import built
from selflock.master import simulation
from selflock.master.ssp import export

ROOT = Path(__file__).parents[1]
STEP = 1e-3
TRIVIAL = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

class Trivial(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = self.y = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        self.y = 0.5 * self.u + 1.0
        return True
"""


def trivial(folder: Path) -> Path:
    """The smallest slave that pythonfmu packs."""
    from pythonfmu import FmuBuilder

    script = folder / "trivial.py"
    script.write_text(TRIVIAL)
    return FmuBuilder.build_FMU(script, dest=folder) or folder / "Trivial.fmu"


clock = time.perf_counter


def ring(fmu: Path, count: int, given: str, taken: str, start: dict, folder: Path, interface: str = "") -> Path:
    """The .ssp of `count` instances in a ring."""
    system = master.from_dict(
        {
            "run": {"step": STEP, "algorithm": "jacobi", "open_inputs": True},
            "components": {f"i{k}": {"fmu": str(fmu), "start": start, "interface": interface} for k in range(count)},
            "connections": {f"i{k}.{given}": {"from": f"i{(k + 1) % count}.{taken}", "convert": False} for k in range(count)},
        }
    )
    system.run.coupling_tolerance = 0.0  # a loop through the ring lags, as it does in the others
    return export(system, folder / f"{fmu.stem}_{count}.ssp")


def ours(ssp: Path, steps: int, count: int, given: str, taken: str, as_fmu: bool = True) -> float:
    system = master.load(ssp)
    system.run.stop, system.run.record = steps * STEP, [f"*.{taken}"]
    system.run.coupling_tolerance = 0.0  # a loop through the ring lags, as it does in the others
    marks = []
    master.run(
        system, progress=lambda fraction: marks.append(clock()), as_fmu=as_fmu
    )  # called at the start and at the end at least
    return marks[-1] - marks[0]


def _timed(step, steps: int, each: bool) -> float:
    """Seconds that `step(count)` takes for all steps, in one call or call by call."""
    began = clock()
    if each:
        for _ in range(steps):
            step(1)
    else:
        step(steps)
    return clock() - began


def ecos(ssp: Path, steps: int, count: int, given: str, taken: str, each: bool = False) -> float:
    from ecospy import EcosLib, EcosSimulation

    EcosLib.set_log_level("off")
    with EcosSimulation(step_size=STEP, ssp_path=str(ssp)) as simulation:
        simulation.init(parameter_set="parameters")
        return _timed(simulation.step, steps, each)


def libcosim(ssp: Path, steps: int, count: int, given: str, taken: str, each: bool = False) -> float:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level

    log_output_level(CosimLogLevel.ERROR)
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(ssp).extractall(folder)
        execution = CosimExecution.from_ssp_file(ssp_path=folder, step_size=round(STEP * 1e9))
        execution.step(1)
        took = _timed(execution.step, steps, each)
        del execution
        return took


def fmpy_loop(ssp: Path, steps: int, count: int, given: str, taken: str) -> float:
    """What a person writes with FMPy's own calls."""
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(ssp).extractall(folder)
        file = next(Path(folder, "resources").glob("*.fmu"))
        described, unpacked = fmpy.read_model_description(str(file), validate=False), fmpy.extract(str(file))
        reference = {v.name: v.valueReference for v in described.modelVariables}
        third, way = described.fmiVersion.startswith("3"), described.coSimulation or described.modelExchange
        if described.coSimulation and "lag" not in file.stem:
            kind = FMU3Slave if third else FMU2Slave
        else:
            kind, way = FMU2Model, described.modelExchange
        slaves, solvers = [], []
        for k in range(count):
            about = {"guid": described.guid, "unzipDirectory": unpacked, "instanceName": f"i{k}"}
            slave = kind(modelIdentifier=way.modelIdentifier, **about)
            slave.instantiate()
            if third:
                slave.enterInitializationMode(startTime=0.0)
            else:
                slave.setupExperiment(startTime=0.0)
                slave.enterInitializationMode()
            slave.exitInitializationMode()
            slaves.append(slave)
            if kind is FMU2Model:
                slave.newDiscreteStates()
                slave.enterContinuousTimeMode()
                solvers.append(_solver(slave, described))
        began = clock()
        get, put = ("getFloat64", "setFloat64") if third else ("getReal", "setReal")
        values = [getattr(slave, get)([reference[taken]])[0] for slave in slaves]
        for index in range(steps):
            for k, slave in enumerate(slaves):
                getattr(slave, put)([reference[given]], [values[(k + 1) % count]])
                if solvers:
                    solvers[k].reset(index * STEP)
                    solvers[k].step(index * STEP, (index + 1) * STEP)
                    slave.setTime((index + 1) * STEP)
                else:
                    slave.doStep(currentCommunicationPoint=index * STEP, communicationStepSize=STEP)
            values = [getattr(slave, get)([reference[taken]])[0] for slave in slaves]
        took = clock() - began
        solvers.clear()
        for slave in slaves:
            slave.terminate()
            slave.freeInstance()
        return took


def _solver(model: FMU2Model, described: fmpy.model_description.ModelDescription) -> CVodeSolver:
    """CVODE over a model, as FMPy's own simulation sets it up."""
    return CVodeSolver(
        nx=described.numberOfContinuousStates,
        nz=0,
        get_x=model.getContinuousStates,
        set_x=model.setContinuousStates,
        get_dx=model.getDerivatives,
        get_z=model.getEventIndicators,
        get_nominals=model.getNominalsOfContinuousStates,
        set_time=model.setTime,
        input=SimpleNamespace(apply=lambda time: None),
        startTime=0.0,
        maxStep=STEP,
        relativeTolerance=1e-8,
    )


def tried(run, *given) -> float:
    """Seconds that a master takes; inf where it does not take this FMU."""
    try:
        return run(*given)
    except Exception as error:
        Console().print(f"not run: {str(error).splitlines()[0][:120]}")
        return float("inf")


def present(names: dict[str, str]) -> dict[str, str]:
    """The masters whose module can be loaded; says which are left out."""
    found = {}
    for name, module in names.items():
        try:
            __import__(module)
            found[name] = module
        except (ImportError, OSError) as error:
            Console().print(f"{name} is left out: {error}")
    return found


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--instances", type=int, nargs="+", default=[2, 8, 32, 100])
    options.add_argument("--steps", type=int, default=1000, help="steps with 8 instances; fewer with more")
    options.add_argument("--turns", type=int, default=3)
    options.add_argument("--processor", action="store_true", help="processor time of all threads, not the clock's")
    options.add_argument("--only", nargs="+", default=[], help="FMUs whose label holds one of these")
    chosen = options.parse_args()
    simulation.TWINS = 0  # by law: as in long runs
    global clock
    clock = time.process_time if chosen.processor else time.perf_counter
    sys.path.insert(0, str(ROOT / "tests" / "native"))
    from pack import pack

    peers = present({"ecos": "ecospy", "libcosim": "libcosimpy"})
    runners = {"ours": ours, "ours, by law": partial(ours, as_fmu=False), "FMPy loop": fmpy_loop}
    for name in peers:
        runners |= {f"{name}, one call": globals()[name], f"{name}, call by call": partial(globals()[name], each=True)}
    table = Table("FMU", "instances", "bare calls", *runners, title="one FMU step: set, step, get, pass on; µs (× ours)")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cases = [
            ("pythonfmu, smallest", trivial(folder), "u", "y", {}),
            ("pythonfmu, Motor", built("Motor"), "voltage", "torque", {"speed": 0.0}),
            ("native C", pack("relaxation", folder), "u", "x", {"rate": 1.0}),
            ("native C, FMI 3.0", pack("relaxation3", folder), "u", "x", {"rate": 1.0}),
            ("native C, model exchange", pack("lag", folder), "u", "y", {"through": 0.0}),
        ]
        cases = [case for case in cases if not chosen.only or any(word in case[0] for word in chosen.only)]
        for label, fmu, given, taken, start in cases:
            plain = label.startswith("pythonfmu") or label == "native C"  # FMI 2.0 for co-simulation, which all take
            way = "me" if "exchange" in label else ""
            for count in chosen.instances:
                steps = max(50, chosen.steps * 8 // count) * (1 if "python" in label else 5)
                ssp = ring(fmu, count, given, taken, start, folder, way)
                least = {name: float("inf") for name in ("bare", *runners)}
                for _ in range(chosen.turns):
                    if plain:
                        least["bare"] = min(least["bare"], bare(fmu, count, steps, STEP, given, taken))
                    for name, run in runners.items():
                        if plain or name in ("ours", "ours, by law", "FMPy loop") or "ecos" in name and not way:
                            least[name] = min(least[name], tried(run, ssp, steps, count, given, taken) / (steps * count))
                shown = (
                    f"{1e6 * took:.2f} ({took / least['ours']:.2f})" if took < float("inf") else "—" for took in least.values()
                )
                table.add_row(label, str(count), *shown)
    Console(width=180).print(table)


if __name__ == "__main__":
    main()
