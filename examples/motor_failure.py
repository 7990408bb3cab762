"""Both motors fail while the robot stands on its tips: a self-locking gear holds it up, a back-drivable one does not.

python examples/motor_failure.py [picture.png]
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt

import master

ROBOT = Path(master.__file__).parent / "study" / "robot.toml"
FAILS_AT = 8.5  # s; the robot was lifted from 6 to 8 s


def run(friction: float, track: str = "segmented") -> master.Result:
    """The study's manoeuvre with gears of this friction and motors that give no torque from FAILS_AT on."""
    system = master.load(ROBOT)
    system.faults = [master.Fault(f"{side}_motor.torque", "drop-out", FAILS_AT) for side in ("front", "rear")]
    settings = {"robot.track": track}
    for side in ("front", "rear"):
        settings |= {f"{side}_reducer.friction_kinetic": friction, f"{side}_reducer.friction_static": friction}
        settings |= {f"{side}_controller.friction_static": friction, f"{side}_controller.irreversible": friction > 0.02}
    return master.run(system, settings)


def main(picture: str = "motor_failure.png") -> None:
    figure, axes = plt.subplots(figsize=(8, 3.2), layout="constrained")
    for friction, colour, label in ((0.0, "tab:red", "μ = 0: back-drivable"), (0.03, "tab:blue", "μ = 0.03: self-locking")):
        table = run(friction).table
        axes.plot(table["time"], 1e3 * table["robot.chassis_y"], colour, label=label)
    axes.axvline(FAILS_AT, color="k", linestyle=":")
    axes.annotate(" both motors fail", (FAILS_AT, axes.get_ylim()[0]), va="bottom", ha="left")
    axes.set(xlabel="time, s", ylabel="height of the chassis, mm", xlim=(5, 10))
    axes.legend(loc="upper left")
    figure.savefig(picture, dpi=150)


if __name__ == "__main__":
    main(*sys.argv[1:])
