"""What belongs to a run: where an angle is counted from anywhere, whatever goes with the place begins anywhere, too.

A wave cos(n angle + phase) goes with the place of a shaft. An encoder that counts from where it was switched on, or a
speed that is integrated from 0, tells that place but for a constant, which is another in each run. So the phase is
known for no run, like the state that a run begins in; it says nothing of the drive, and belongs to the run. In `values`
it is a number `run.<run>.<component>.<phase>`. A run without one has the phase of the drive's own name, `<component>.<phase>`:
that of the first run to learn from.

Where speeds alone tell of a motion nobody knows either where a load that gravity pulls at was at first: each run has
`run.<run>.load.arm_angle`, the angle of the arm where the run's own angle is 0.

Two waves of one shaft could share one zero of its angle. Here each has a phase of its own in each run: one number more,
and no search through the n places of a turn between which a wave of order n cannot choose.
"""

from __future__ import annotations

from ..data.log import MeasuredRun
from ..data.signals import RELATIVE
from .channels import Channels

RUN = "run."


def name(run: MeasuredRun, parameter: str) -> str:
    """What a parameter of a run alone is called."""
    return f"{RUN}{run.key}.{parameter}"


def parameter(name: str) -> str:
    """The parameter that a value stands for, of a run alone or not."""
    return ".".join(name.rsplit(".", 2)[1:]) if name.startswith(RUN) else name


def own(values: dict[str, float], run: MeasuredRun) -> dict[str, float]:
    """Parameters that `values` say of this run alone."""
    start = f"{RUN}{run.key}."
    return {key[len(start) :]: value for key, value in values.items() if key.startswith(start)}


def relative(ch: Channels, component: str, shaft: str) -> bool:
    """Whether the angle of a shaft, "input" or "output", over which waves of a component go is counted from anywhere."""
    if component == "motor" and not ch.has("motor.current"):  # simulated from its voltage, it counts from 0
        return True
    sides = ("reducer.input_", "load.")
    for side in sides if shaft == "input" else reversed(sides):
        if ch.has(side + "angle"):
            return side + "angle" in RELATIVE
        if ch.has(side + "speed"):
            return True
    return False
