"""The drive as a chain: set-point → controller → motor → reducer → load, and what goes back.

    controller  --voltage-->  motor  --torque-->  reducer  --torque-->  load
        ^  ^                    ^--- speed ---'     ^--- angle, speed --'
        |  '--- input speed, output torque --'                          |
        '---------------------- angle, speed ---------------------------'

Who couples the components by hand steps them in the order of `ORDER`, each on the newest outputs of the others: the
controller's voltage is that of a sample, and held until the next.
"""

CONNECTIONS = {
    "motor.voltage": "controller.voltage",
    "motor.speed": "reducer.input_speed",
    "reducer.motor_torque": "motor.torque",
    "reducer.output_angle": "load.angle",
    "reducer.output_speed": "load.speed",
    "load.torque": "reducer.output_torque",
    "controller.angle": "load.angle",
    "controller.speed": "load.speed",
    "controller.motor_speed": "reducer.input_speed",
    "controller.output_torque": "reducer.output_torque",
}
"""Input -> the output that it is given."""

ORDER = ("motor", "reducer", "load", "controller")
"""In which the components are stepped."""


def inputs(component: str) -> dict[str, str]:
    """The inputs of a component that the chain gives, by their own names, and where each comes from."""
    start = component + "."
    return {target[len(start) :]: source for target, source in CONNECTIONS.items() if target.startswith(start)}
