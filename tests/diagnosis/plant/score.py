"""What the product answered, and whether it is right. Names are `component.effect`, with a channel or parameter in brackets."""

from __future__ import annotations

from .bench import Case
from .causes import Cause
from .rig import signal


def expected(cause: Cause) -> str:
    """The right answer for a hidden cause."""
    if cause.effect == "unknown":
        return "unknown"
    if cause.component == "sensor":
        return f"sensor.{cause.effect}({signal(cause.what)})"
    if cause.effect == "parameter":
        return f"parameter({cause.component}.{cause.what})"
    return cause.name


def plain(diagnosis) -> dict:
    """What the product returns, as its diagnosis.json."""
    return diagnosis.data()


def answers(result: dict) -> list[str]:
    """The causes named in a diagnosis.json, in their order; the verdict alone where it names none."""
    if result["verdict"] in ("none", "unknown"):
        return [result["verdict"]]
    return [_name(cause) for cause in result["causes"]]


def _name(cause: dict) -> str:
    if cause["component"] == "sensor":
        return f"sensor.{cause['effect']}({cause['channel']})"
    if cause["effect"] == "parameter":
        return f"parameter({next(iter(cause['parameters']))})"
    return f"{cause['component']}.{cause['effect']}"


def right_first(result: dict, case: Case) -> bool:
    """The first cause named is one that is there; for a case without any: none is named."""
    found = answers(result)
    if not case.causes:
        return found == ["none"]
    if case.causes[0].effect == "unknown":
        return found == ["unknown"] and right_variable(result, case.causes[0])
    return found[0] in [expected(cause) for cause in case.causes]


def both(result: dict, case: Case) -> bool:
    """Every hidden cause is among those named."""
    return set(expected(cause) for cause in case.causes) <= set(answers(result))


def right_variable(result: dict, cause: Cause) -> bool:
    """The remainder is said to depend on what it does depend on."""
    said = " ".join(str(name) for name in result["remainder"]["depends_on"])
    return any(name in said for name in cause.depends_on)


def fault_found(result: dict, placed: dict, reach: int = 3) -> bool:
    """The fault that was put into the log is reported by kind and channel, in the right rows."""
    channel = placed["channel"] if placed["channel"] == "time" else signal(placed["channel"])
    return any(
        fault["kind"] == placed["kind"] and fault["channel"] == channel
        and abs(fault["first"] - placed["first"]) <= reach and abs(fault["last"] - placed["last"]) <= reach
        for fault in result["faults"]
    )
