"""Both motors fail while the robot stands on its tips: a self-locking gear holds it up, a back-drivable one does not.

python examples/motor_failure.py [picture.png]
"""

import sys
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt

from selflock import master
from selflock.study import figures
from selflock.study.figures import COLOURS, STYLE, sketch

ROBOT = Path(figures.__file__).parent / "robot.toml"
FAILS_AT = 8.5  # s; the robot was lifted from 6 to 8 s


def run(friction: float, track: str = "segmented", observe=None) -> master.Result:
    """The study's manoeuvre with gears of this friction and motors that give no torque from FAILS_AT on."""
    system = master.load(ROBOT)
    system.faults = [master.Fault(f"{side}_motor.torque", "drop-out", FAILS_AT) for side in ("front", "rear")]
    settings: dict[str, Any] = {"robot.track": track}
    for side in ("front", "rear"):
        settings |= {f"{side}_reducer.friction_kinetic": friction, f"{side}_reducer.friction_static": friction}
        settings |= {f"{side}_controller.friction_static": friction, f"{side}_controller.irreversible": friction > 0.02}
    return master.run(system, settings, observe=observe)


def main(picture: str = "motor_failure.png") -> None:
    plt.rcParams.update(STYLE)
    figure, grid = plt.subplot_mosaic(
        [["curve", 0.0], ["curve", 0.03]], figsize=(8, 3.2), width_ratios=(2, 1), layout="constrained"
    )
    axes = grid["curve"]
    for friction, label in ((0.0, "μ = 0: the gear can be driven back"), (0.03, "μ = 0.03: the gear locks itself")):
        last: dict[str, Any] = {}
        table = run(
            friction, observe=lambda time, parts: last.update(posture=parts["robot"].posture()) if time > 9.9985 else None
        ).table
        axes.plot(table["time"], 1e3 * table["robot.chassis_y"], color=COLOURS[friction], label=label)
        sketch(grid[friction], last["posture"])
        grid[friction].set_title(f"μ = {friction:g} at 10 s", fontsize=9, color=COLOURS[friction])
    axes.axvline(FAILS_AT, color="#4c5560", linestyle=":")
    axes.text(FAILS_AT - 0.06, 170, "both motors fail", rotation=90, va="center", ha="right", color="#4c5560")
    axes.set(xlabel="time in s", ylabel="height of the chassis in mm", xlim=(5, 10))
    axes.legend(loc="upper left")
    figure.savefig(picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
