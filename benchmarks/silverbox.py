"""A linear oscillator in C calibrated to the Silverbox in ../shared/data: its error on the multisine, and on the arrow.

    python -m benchmarks.silverbox [out/silverbox]
    python -m benchmarks.silverbox --name [out/silverbox]

Taught by samples 40 600 to 127 400, judged by the arrow (0 to 40 495), whose amplitude no teacher reached. Published linear
models leave 14.4 mV there (README beside the data). What is left is the spring's curve, which the FMU does not have: with
--name it is named, and the arrow judged again.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd

from selflock.diagnosis import Calibration, Naming, calibrate, name

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data" / "silverbox" / "SNLS80mV.csv"
SAMPLING = 2**14 / 1e7  # s
FINER = 4  # steps from row to row: an FMU holds its input for a step, the voltage goes on in between
RIG = """
[rig]
name = "Silverbox, linear"
system = "oscillator.fmu"
step = {step!r}

[columns]
"oscillator.force" = "V1"
"oscillator.position" = "V2"

[calibrate]
"oscillator.stiffness" = {{ start = 1e5, low = 1e4, high = 1e6 }}
"oscillator.damping" = {{ start = 30.0, low = 1.0, high = 1e3 }}
"oscillator.gain" = {{ start = 1e5, low = 1e4, high = 1e6 }}
"oscillator.offset" = [-1e4, 1e4]
"oscillator.position" = {{ low = -1.0, high = 1.0, each_run = true }}
"""


def prepared(out: Path, taught: tuple[int, int] = (40_600, 127_400), judged: tuple[int, int] = (0, 40_495)) -> list[Path]:
    """The FMU, the rig and the two logs in a folder: rig, log to learn from, log to judge by."""
    sys.path.append(str(ROOT / "tests" / "native"))
    from pack import pack

    pack("oscillator", out)
    table = pd.read_csv(DATA, usecols=["V1", "V2"])
    paths = [out / "rig.toml", out / "multisine.csv", out / "arrow.csv"]
    for path, (first, last) in zip(paths[1:], (taught, judged)):
        part = table.iloc[first:last].reset_index(drop=True)
        part.insert(0, "time", part.index * SAMPLING)
        part.to_csv(path, index=False)
    paths[0].write_text(RIG.format(step=SAMPLING / FINER))
    return paths


def calibrated(out: Path) -> Calibration:
    rig, log, test = prepared(out)
    return calibrate(rig, [log], test=[test], out=out / "calibration", progress=True)


def named(out: Path, progress: bool = True) -> Naming:
    """What the linear oscillator lacks. Its inputs are read on a smooth curve: a multisine goes on between the rows."""
    rig, log, test = prepared(out)
    rig.write_text(rig.read_text().replace("[rig]\n", '[rig]\ninputs = "smooth"\n'))
    return name(rig, [log], test=[test], out=out / "naming", progress=progress)


if __name__ == "__main__":
    if not DATA.exists():
        sys.exit(f"{DATA.parent} is absent: the measured data are not part of the project; docs/calibrate.md names their source.")
    given = [word for word in sys.argv[1:] if word != "--name"]
    folder = Path(given[0] if given else "out/silverbox")
    print((named if "--name" in sys.argv else calibrated)(folder))
