"""Two tanks in C beside the cascaded tanks in ../shared/data: what they lack is named on the first half, and judged on the second.

    python -m benchmarks.tanks [out/tanks]

The tanks are those of Bernoulli; the real upper one overflows, in part into the lower one. Published errors of the second
half: best linear model 0.757 V, polynomial state space 0.450, NLSS2 0.343 (README beside the data).
"""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd

from selflock.diagnosis import Naming, name

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT.parent / "shared" / "data" / "cascaded_tanks" / "dataBenchmark.csv"
SAMPLING = 4.0  # s
SYSTEM = """
[run]
stop = 4092.0
step = 1.0
open_inputs = true

[components.upper]
fmu = "tank.fmu"

[components.lower]
fmu = "tank.fmu"
start = { range = 10.0 }

[connections]
"lower.inflow" = "upper.flow"
"""
RIG = """
[rig]
name = "Cascaded tanks"
system = "tanks.toml"
inputs = "held"

[columns]
"upper.inflow" = "pump"
"lower.reading" = "level"

[calibrate]
"upper.gain" = { start = 0.05, low = 0.01, high = 0.3 }
"upper.outlet" = { start = 0.05, low = 0.01, high = 0.3 }
"lower.gain" = { start = 1.0, low = 0.2, high = 5.0 }
"lower.outlet" = { start = 0.05, low = 0.01, high = 0.3 }
"upper.level" = { start = 5.0, low = 0.0, high = 15.0, each_run = true }
"lower.level" = { start = 5.0, low = 0.0, high = 15.0, each_run = true }
"""


def prepared(out: Path) -> list[Path]:
    """The FMU, the system, the rig and the two logs in a folder: rig, log to learn from, log to judge by."""
    sys.path.append(str(ROOT / "tests" / "native"))
    from pack import pack

    pack("tank", out)
    table = pd.read_csv(DATA)
    paths = [out / "rig.toml", out / "first.csv", out / "second.csv"]
    for path, half in zip(paths[1:], ("Est", "Val")):
        columns = {"time": table.index * SAMPLING, "pump": table[f"u{half}"], "level": table[f"y{half}"]}
        pd.DataFrame(columns).to_csv(path, index=False)
    (out / "tanks.toml").write_text(SYSTEM)
    paths[0].write_text(RIG)
    return paths


def named(out: Path, progress: bool = True) -> Naming:
    rig, log, test = prepared(out)
    return name(rig, [log], test=[test], out=out / "naming", progress=progress)


if __name__ == "__main__":
    if not DATA.exists():
        sys.exit(f"{DATA.parent} is absent: the measured data are not part of the project; docs/name.md names their source.")
    print(named(Path(sys.argv[1] if len(sys.argv) > 1 else "out/tanks")))
