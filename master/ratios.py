"""A gear's ratio that stands in several places of a system: sentences where they say different things.

A gear is a component with a parameter `gear_ratio`, an output `input_speed` and an output `output_torque`, as Reducer.fmu has
them. What comes from its input shaft and is used as the other shaft's goes through a factor of 1 / gear_ratio; who
has a `gear_ratio` of its own and is connected to one gear alone means that gear's.
"""

from __future__ import annotations

from math import isclose
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .wiring import Link, Wiring

RATIO = "gear_ratio"
GEAR = ("input_speed", "output_torque")
ANGLES = ("rad", "deg", "rad/s", "rpm", "deg/s")
SAME = 1e-6  # relative: digits that people write


def contrary(wiring: Wiring) -> list[str]:
    """A sentence for each place that contradicts the gear it belongs to."""
    gears = {name: ratio for name in wiring.parts if _is_gear(wiring, name) and (ratio := _ratio(wiring, name))}
    if not gears:
        return []
    said = []
    for link in wiring.links:
        if link.source in gears and link.target not in gears and _of_input_shaft(wiring, link):
            given = float(wiring.system.connections[f"{link.target}.{link.input}"].factor)
            ratio = gears[link.source]
            if abs(given) != 1.0 and not isclose(abs(given) * ratio, 1.0, rel_tol=SAME):
                said.append(
                    f"{link.target}.{link.input} = {given:.6g} · {link.source}.{link.output} takes a ratio of {1.0 / abs(given):.6g}, "
                    f"and {link.source}.{RATIO} is {ratio:.6g}: say the ratio once, under [values] (docs/system.md)"
                )
    for name in wiring.parts:
        mine = {link.source for link in wiring.into[name]} | {link.target for link in wiring.out_of[name]}
        mine &= set(gears)
        own = None if name in gears or len(mine) != 1 else _ratio(wiring, name)
        if own is not None and not isclose(own, gears[gear := mine.pop()], rel_tol=SAME):
            said.append(
                f"{name}.{RATIO} is {own:.6g}, and {gear}.{RATIO}, to which it is connected, is {gears[gear]:.6g}: "
                "say the ratio once, under [values] (docs/system.md)"
            )
    return said


def _is_gear(wiring: Wiring, name: str) -> bool:
    known = wiring.parts[name].variables
    return RATIO in known and all(output in known and known[output].causality == "output" for output in GEAR)


def _ratio(wiring: Wiring, name: str) -> float | None:
    """The ratio that a component is run with; None where it has none."""
    variable = wiring.parts[name].variables.get(RATIO)
    if variable is None or variable.causality != "parameter":
        return None
    value = wiring.values.get(name, {}).get(RATIO, variable.start)
    return float(value) if isinstance(value, (int, float)) and value else None


def _of_input_shaft(wiring: Wiring, link: Link) -> bool:
    """Whether it carries an angle or a speed of the gear's input shaft."""
    variable = wiring.parts[link.source].variables[link.output]
    return link.output.startswith("input_") and variable.unit in ANGLES
