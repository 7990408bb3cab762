"""The robot climbs stairs with all four of its drives: approach, holders set, climb, over the edge; and the torques that it took.

python examples/climb.py [page.html]

What it does is the table climb.csv: the way that the tracks run, and the holders' angles. Nothing looks at the stairs: others
want other rows.
"""

import sys
from pathlib import Path

from selflock import master
from selflock.study.runs import SYSTEM
from selflock.vehicle import Robot
from selflock.view import view

MOVES = Path(__file__).with_name("climb.csv")
DRIVES = SYSTEM.with_name("four_drives.toml")
STAIRS = "stairs:0.17,0.29,4,1.0"  # rise, run and number of an ordinary staircase, m; from x = 1 m on
SHOWN = ("*_motor.torque", "robot.front_angle", "robot.rear_angle", "robot.chassis_pitch")


def system(ground: str = STAIRS, track: str = "belt") -> master.System:
    """The study's robot with four drives, its set-points from the table, on this ground."""
    made = master.load(DRIVES)
    made.name, made.run.stop = "climbing stairs", 28.0
    made.components["setpoints"] = master.Component(manoeuvre=str(MOVES.resolve()))
    made.components["robot"].start |= {"ground": ground, "track": track, "rear_start_angle": 3.141592653589793}
    made.connections = {to: given for to, given in made.connections.items() if "imposed" not in to}  # of another mode
    radius = Robot("robot", **made.components["robot"].start).get("sprocket_radius")
    for end in ("front", "rear"):
        made.components[f"{end}_reducer"].start |= {"imposed_angle": 0.0, "imposed_speed": 0.0}
        for to, source in (("angle", "setpoints.way"), ("speed", "setpoints.way_speed")):  # a negative turn drives forward
            connection = master.Connection(source, factor=-1.0 / radius, convert=False)
            made.connections[f"{end}_sprocket_controller.{to}_setpoint"] = connection
    return made


def main(page: str = "climb.html") -> None:
    result = master.run(system(), out=Path(page).with_suffix(".parquet"))
    print(result.summary())
    print(f"Open {view(result, page, show=SHOWN)}")


if __name__ == "__main__":
    main(*sys.argv[1:])
