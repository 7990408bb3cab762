"""The real measurements in ../shared/data, diagnosed: writes docs/measurements.md and the figures beside it.

    python -m benchmarks.measurements [lead_screw | worm_drive | emps | xl330 ...]

Each is diagnosed with its rig in examples/rigs. Numbers go to docs/measurements/<name>.json and the page is written
from these, so that one measurement can be done again without the others. Seeds of the draws are fixed.
"""

from __future__ import annotations

import json
import re
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.pictures import picture
from selflock.diagnosis import diagnose
from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.output.extend import with_fmus
from selflock.diagnosis.pipeline.run import gather
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data"
DOCS = ROOT / "docs"
LOGS = {
    "lead_screw": (("lead_screw/steady_state.csv",), ()),
    "worm_drive": (("worm_drive/steady_state.csv",), ()),
    "emps": (("emps/DATA_EMPS.mat",), ()),
    "xl330": (("xl330/kp100*.csv", "xl330/kp800*.csv"), ("xl330/kp200*.csv",)),
}
TARGETS = {  # effect, unit, before and after as required
    "lead_screw": ("stribeck", "mN.m", 0.134, 0.044),
    "worm_drive": ("stribeck", "mN.m", 0.071, 0.040),
    "emps": ("asymmetric", "% of the force", 4.04, 3.06),
    "xl330": ("load_dependent", "rad", 0.063, 0.0315),
}


def logs(name: str) -> tuple[list[Path], list[Path]]:
    """Logs to learn from, and to judge on."""
    return tuple([path for pattern in patterns for path in sorted(DATA.glob(pattern))] for patterns in LOGS[name])


def rig(name: str) -> Path:
    return ROOT / "examples" / "rigs" / f"{name}.toml"


def answer(name: str, out: Path, progress: bool = False):
    """The diagnosis of one measurement."""
    return diagnose(rig(name), *logs(name), out=out, seed=1, progress=progress)


def fitted(folder: Path) -> tuple[dict, dict]:
    """Parameters before and after the extension, from parameters.toml."""
    text = (folder / "parameters.toml").read_text()
    after = tomllib.loads(text)["parameters"]
    old = dict(re.findall(r'"([^"]+)" = \S+  # was (\S+)', text))
    new = re.findall(r'"([^"]+)" = \S+  # new', text)
    return {k: float(old.get(k, v)) for k, v in after.items() if k not in new}, after


def relative(name: str, before: dict, after: dict) -> dict:
    """Norm of the force's error over the norm of the force, in %: on the held-out blocks, and on all samples."""
    from selflock.diagnosis.pipeline.hold_out import split

    given = load(rig(name))
    runs, _, held = gather(given, *logs(name))
    bench = DriveExperiment(given, runs)
    train, _ = split(bench, runs, held)
    found = {}
    for key, values in (("before", before), ("after", after)):
        simulated, measured, good = bench.compare(bench.residuals[0], values)[0]
        unseen = good & ~train[bench.layout.block(0)]
        for where, mask in (("", unseen), ("_all", good)):
            found[key + where] = 100.0 * float(np.linalg.norm((measured - simulated)[mask]) / np.linalg.norm(measured[mask]))
    return found


def angles(name: str, before: dict, after: dict) -> dict:
    """Mean absolute angle error of the closed loop on the logs left out, rad; the mean over logs, and each."""
    given = load(rig(name))
    _, tests = logs(name)
    runs, _, _ = gather(given, tests, ())
    bench = DriveExperiment(given, runs)
    found: dict = {"each": {run.log: [] for run in runs}}
    for key, values in (("before", before), ("after", after)):
        errors = [float(np.mean(abs(m - s)[good])) for s, m, good in bench.compare(bench.residuals[0], values)]
        found[key] = float(np.mean(errors))
        for run, error in zip(runs, errors):
            found["each"][run.log].append(error)
    return found


def start_stop(folder: Path, picture: Path | None) -> dict:
    """The worm drive started and stopped at 10 rpm: its extended reducer FMU on that motion, fitted to steady points alone."""
    import matplotlib.pyplot as plt

    from selflock.diagnosis.output.figures import AFTER, BEFORE, MEASURED, save

    given = replace(load(rig("worm_drive")), kind="inverse", run="", hold_out="")
    runs = read(DATA / "worm_drive/start_stop.csv", given)
    faults = check(runs, given)
    bench = DriveExperiment(given, runs)
    gear = next(residual for residual in bench.residuals if residual.kind == "gear")
    before, after = fitted(folder)
    old, measured, good = bench.compare(gear, before)[0]
    new = with_fmus(bench, {"reducer": folder / "reducer.fmu"}, gear).compare(gear, after)[0][0]
    law = bench.compare(gear, after)[0][0]
    error = lambda x: 1e3 * float(np.sqrt(np.mean((measured - x)[good] ** 2)))
    speed = bench.channels[0, ""].raw("reducer.input_speed")
    sides = {
        side: [1e3 * float(np.mean(x[good & way])) for x in (measured, old, new) if (good & way).any()]
        for side, way in (("forward", speed > 0), ("backward", speed < 0))
    }
    if picture:
        figure, axis = plt.subplots(figsize=(9, 3.6))
        hide = lambda x: np.where(good, 1e3 * x, np.nan)
        axis.plot(runs[0].time, 1e3 * measured, color=MEASURED, lw=0.5, alpha=0.5, label="measured (rest included)")
        axis.plot(runs[0].time, hide(old), color=BEFORE, lw=1.2, label="Coulomb of the steady runs")
        axis.plot(runs[0].time, hide(new), color=AFTER, lw=1.2, label="extended Reducer.fmu")
        axis.set(xlabel="time in s", ylabel="motor torque in mN.m")
        low, high = np.nanquantile(hide(measured), [0.01, 0.99])
        axis.set_ylim(low - 0.7 * (high - low), high + 0.7 * (high - low))
        axis.legend(loc="upper right", fontsize=8)
        save(figure, picture)
    return {
        "before": error(old),
        "after": error(new),
        "law": error(law),
        "samples": int(good.sum()),
        "of": len(good),
        "faults": len(faults),
        "means": sides,
    }


def one(name: str) -> dict:
    """Diagnose one measurement, keep its figures, give its numbers."""
    with TemporaryDirectory() as place:
        folder = Path(place)
        result = answer(name, folder, progress=True)
        found = {
            "verdict": result.verdict,
            "causes": [{"label": c.label, "parameters": c.parameters, "rivals": c.indistinguishable_from} for c in result.causes],
            "before": 1e3 * result.gain.before,
            "after": 1e3 * result.gain.after,
            "low": 1e3 * result.gain.low,
            "high": 1e3 * result.gain.high,
            "faults": result.faults,
            "remainder": result.remainder,
            "regimes": result.gain.regimes,
            "promised": result.extension.get("promised"),
            "fmu": result.extension.get("fmu"),
        }
        if result.causes:
            values = fitted(folder)
            if name == "emps":
                found |= relative(name, *values)
            if name == "xl330":
                found |= angles(name, *values)
            if name == "worm_drive":
                found["start_stop"] = start_stop(folder, DOCS / "measurements" / "start_stop.png")
        report = folder / "report.html"
        for old in (DOCS / "measurements").glob(f"{name}_*.png"):  # those that the page shows
            figure = old.stem.removeprefix(f"{name}_")
            shown = f'data-figure="{figure}"' if figure != "search" else 'class="bars"'
            if shown in report.read_text(encoding="utf-8"):
                picture(report, old, f"[{shown}]")
    return found


def page(found: dict[str, dict]) -> str:
    """docs/measurements.md"""
    from jinja2 import Template

    template = Template((DOCS / "measurements" / "page.md.j2").read_text(), trim_blocks=True, lstrip_blocks=True)
    return template.render(found=found, targets=TARGETS).rstrip() + "\n"


def main(names: list[str]) -> None:
    if not DATA.exists():
        sys.exit(f"{DATA} is absent: the measured data are not part of the project; their sources are in docs/measurements.md.")
    kept = DOCS / "measurements"
    for name in names or list(LOGS):
        found = one(name)
        (kept / f"{name}.json").write_text(json.dumps(found, indent=1) + "\n")
        print(name, found["verdict"], [c["label"] for c in found["causes"]], f"{found['before']:.4g} -> {found['after']:.4g}")
    found = {name: json.loads((kept / f"{name}.json").read_text()) for name in LOGS if (kept / f"{name}.json").exists()}
    (DOCS / "measurements.md").write_text(page(found))


if __name__ == "__main__":
    main(sys.argv[1:])
