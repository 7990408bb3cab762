"""Masters compared in one run on the same FMUs and the same step: ours, Ecos, libcosim and a plain FMPy loop.

    python benchmarks/masters.py [--instances 2 8 32 100] [--steps 1000]

A ring of equal FMUs, each given its neighbour's output, coupled by Jacobi with a fixed step of 1 ms; every master
reads the same .ssp. Timed from the first step to the last; loading and initialization are left out. The masters
take turns, the least of several turns counts. Ecos and libcosim are left out with a word where they are not
installed (extra `masters`; Ecos needs libtbb12). They can be called once for many steps, or once for each step, as
who wants to look or to steer between steps does. Our master is called once; it keeps a table of every output at every
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

import fmpy
from fmpy.fmi2 import FMU2Slave
from master_cost import bare
from rich.console import Console
from rich.table import Table

from selflock import master
from selflock.fmus.build import built
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


def ring(fmu: Path, count: int, given: str, taken: str, start: dict, folder: Path) -> Path:
    """The .ssp of `count` instances in a ring."""
    system = master.from_dict(
        {
            "run": {"step": STEP, "algorithm": "jacobi", "open_inputs": True},
            "components": {f"i{k}": {"fmu": str(fmu), "start": start} for k in range(count)},
            "connections": {f"i{k}.{given}": {"from": f"i{(k + 1) % count}.{taken}", "convert": False} for k in range(count)},
        }
    )
    return export(system, folder / f"{fmu.stem}_{count}.ssp")


def ours(ssp: Path, steps: int, count: int, given: str, taken: str) -> float:
    system = master.load(ssp)
    system.run.stop, system.run.record = steps * STEP, [f"*.{taken}"]
    system.run.coupling_tolerance = 0.0  # a loop through the ring lags, as it does in the others
    marks = []
    master.run(system, progress=lambda fraction: marks.append(time.perf_counter()))  # called at the start and at the end at least
    return marks[-1] - marks[0]


def _timed(step, steps: int, each: bool) -> float:
    """Seconds that `step(count)` takes for all steps, in one call or call by call."""
    began = time.perf_counter()
    if each:
        for _ in range(steps):
            step(1)
    else:
        step(steps)
    return time.perf_counter() - began


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
        slaves = []
        for k in range(count):
            slave = FMU2Slave(
                guid=described.guid,
                unzipDirectory=unpacked,
                modelIdentifier=described.coSimulation.modelIdentifier,
                instanceName=f"i{k}",
            )
            slave.instantiate()
            slave.setupExperiment(startTime=0.0)
            slave.enterInitializationMode()
            slave.exitInitializationMode()
            slaves.append(slave)
        began = time.perf_counter()
        values = [slave.getReal([reference[taken]])[0] for slave in slaves]
        for index in range(steps):
            for k, slave in enumerate(slaves):
                slave.setReal([reference[given]], [values[(k + 1) % count]])
                slave.doStep(currentCommunicationPoint=index * STEP, communicationStepSize=STEP)
            values = [slave.getReal([reference[taken]])[0] for slave in slaves]
        took = time.perf_counter() - began
        for slave in slaves:
            slave.terminate()
            slave.freeInstance()
        return took


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
    chosen = options.parse_args()
    sys.path.insert(0, str(ROOT / "tests" / "native"))
    from pack import pack

    peers = present({"ecos": "ecospy", "libcosim": "libcosimpy"})
    runners = {"ours": ours, "FMPy loop": fmpy_loop}
    for name in peers:
        runners |= {f"{name}, one call": globals()[name], f"{name}, call by call": partial(globals()[name], each=True)}
    table = Table("FMU", "instances", "bare calls", *runners, title="one FMU step: set, step, get, pass on; µs (× ours)")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cases = [
            ("pythonfmu, smallest", trivial(folder), "u", "y", {}),
            ("pythonfmu, Motor", built("Motor"), "voltage", "torque", {"speed": 0.0}),
            ("native C", pack("relaxation", folder), "u", "x", {"rate": 1.0}),
        ]
        for label, fmu, given, taken, start in cases:
            for count in chosen.instances:
                steps = max(50, chosen.steps * 8 // count) * (1 if "python" in label else 5)
                ssp = ring(fmu, count, given, taken, start, folder)
                least = {name: float("inf") for name in ("bare", *runners)}
                for _ in range(chosen.turns):
                    least["bare"] = min(least["bare"], bare(fmu, count, steps, STEP, given, taken))
                    for name, run in runners.items():
                        least[name] = min(least[name], run(ssp, steps, count, given, taken) / (steps * count))
                table.add_row(label, str(count), *(f"{1e6 * took:.2f} ({took / least['ours']:.2f})" for took in least.values()))
    Console(width=180).print(table)


if __name__ == "__main__":
    main()
