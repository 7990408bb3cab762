"""Plants that only the tests know, beside FMUs that lack something of them: a heated body and a tank.

Nature is integrated by scipy (LSODA, tight tolerances) from formulas of its own: a heat balance in J and W, a volume in m3.
The FMUs are native, of tests/native, written otherwise. What hides is a function of state and time added somewhere.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.integrate import solve_ivp

sys.path.append(str(Path(__file__).parents[2] / "native"))

STEP = 0.05  # s
CAPACITY, LOSS = 40.0, 20.0  # J/K, W/K: a rate of 0.5 1/s

BODY = """
[rig]
system = "relaxation.fmu"
step = 0.05
{more}

[columns]
"relaxation.u" = "heater"
"relaxation.x" = "body"

[calibrate]
"relaxation.x" = {{ start = 0.0, low = -5.0, high = 5.0, each_run = true }}
{free}

[parameters]
{known}
"""


def stairs(rng, count, low=-2.0, high=2.0, length=25):
    """A command in stairs, a level held for `length` rows."""
    return np.repeat(rng.uniform(low, high, count // length + 1), length)[:count]


def body(rng, count=800, heat=lambda t, x: 0.0, loss=LOSS, heater=None, held=None, read=lambda t, x: x, noise=0.004):
    """A log of a heated body: its heater's temperature as it was wanted, and its own.

    heat: W that come from elsewhere. heater: what the heater made of what was wanted, of all rows. read: what a sensor makes.
    """
    time = STEP * np.arange(count)
    wanted = stairs(rng, count) if held is None else held
    real = wanted if heater is None else heater(time, wanted)
    x, seen = 0.3, []
    for t, u in zip(time, real):  # one stretch of held heater after another
        seen.append(x)
        change = lambda s, y, u=u: [(loss * (u - y[0]) + heat(s, y[0])) / CAPACITY]
        x = float(solve_ivp(change, (t, t + STEP), [x], method="LSODA", rtol=1e-8, atol=1e-10).y[0, -1])
    told = np.array(read(time, np.array(seen))) + noise * rng.standard_normal(count)
    return pd.DataFrame({"time": time, "heater": wanted, "body": told})


FREE = '"relaxation.rate" = { start = 0.5, low = 0.05, high = 5.0 }'


def rig(folder, fmu, free=FREE):
    """The rig of a body's FMU, which knows a rate and nothing else."""
    (folder / "relaxation.fmu").write_bytes(Path(fmu).read_bytes())
    path = folder / "rig.toml"
    path.write_text(BODY.format(free=free, more='inputs = "held"', known="" if free else '"relaxation.rate" = 0.5'))
    return path
