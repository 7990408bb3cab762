"""What [report] of a sweep may say: which parameter and which figure plays which role in the charts."""

from __future__ import annotations

from collections.abc import Collection
from numbers import Real
from typing import Any

from .errors import SweepError

PARTS = {  # of a role that is a table; what may be left out is in brackets
    "moving": ("figure", "(time)"),
    "holding": ("figure",),
    "pareto": ("holding", "moving", "torque"),
    "margins": ("by", "figures"),
}
ROLES = ("friction", "ratio", "hold_times", *PARTS)


def check(report: dict[str, Any], known: Collection[str]) -> None:
    """Refuse roles that no chart has, parts that they lack, and names that no run has. known: parameters and figures."""
    for role, told in report.items():
        if role not in ROLES:
            raise SweepError(f"[report] {role}: no chart has this role. There are: {', '.join(ROLES)}.")
        if role in PARTS:
            parts = PARTS[role]
            if (
                not isinstance(told, dict)
                or {p for p in parts if p[0] != "("} - set(told)
                or set(told) - {p.strip("()") for p in parts}
            ):
                shape = ", ".join(f"{part} = ..." for part in parts if part[0] != "(")
                raise SweepError(f"[report] {role} = {told!r}: write {role} = {{ {shape} }}.")
            names = [
                name for key, value in told.items() if key != "time" for name in (value if isinstance(value, list) else [value])
            ]
        elif role == "hold_times":
            if not isinstance(told, list) or not told or not all(isinstance(t, (int, float)) and t >= 0.0 for t in told):
                raise SweepError(f"[report] hold_times = {told!r}: write times in s, such as [0, 60, 600].")
            names = []
        else:
            names = [] if role == "ratio" and isinstance(told, Real) else [told]
        for name in names:
            if name not in known:
                raise SweepError(f"[report] {role}: there is no parameter and no figure {name!r}. There are: {', '.join(known)}.")
