"""What is kept of a run: figures, each one number from an expression over the run's table.

An expression is written over the columns of the table, `component.variable`, over `time`, over the varied parameters
and over the figures above it: "abs(rear_reducer.input_torque)", "(motor.electric_power > 0) * motor.electric_power".
What may stand in one is in master/expression.py.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from selflock.master.errors import DescriptionError
from selflock.master.expression import Expression
from selflock.master.expression import parse as read_expression

from .errors import SweepError

SLACK = 1e-9  # s: a communication point that lies on the edge of a window belongs to it


def _integral(time: np.ndarray, y: np.ndarray) -> float:
    return np.trapezoid(y, time)


def _mean(time: np.ndarray, y: np.ndarray) -> float:
    return np.trapezoid(y, time) / (time[-1] - time[0]) if len(time) > 1 else y[0]


KINDS: dict[str, Callable[[np.ndarray, np.ndarray], float]] = {
    "final": lambda time, y: y[-1],
    "first": lambda time, y: y[0],
    "min": lambda time, y: y.min(),
    "max": lambda time, y: y.max(),
    "mean": _mean,  # over time
    "rms": lambda time, y: np.sqrt(_mean(time, y * y)),
    "integral": _integral,  # over time, by trapezoids between communication points
    "value": lambda time, y: y[0],  # of parameters and figures alone
}


def parse(text: str) -> Expression:
    """An expression of a study; SweepError where it holds what has no place there."""
    try:
        return read_expression(text)
    except DescriptionError as error:
        raise SweepError(str(error)) from None


@dataclass(frozen=True)
class Figure:
    """One number of a run: `kind` of `expression` from time `begin` to `end` in s."""

    name: str
    kind: str
    expression: str
    begin: float = -np.inf
    end: float = np.inf
    unit: str = ""

    @property
    def columns(self) -> set[str]:
        return set(parse(self.expression).columns.values())

    @property
    def names(self) -> set[str]:
        """Parameters and figures in the expression."""
        return set(parse(self.expression).names) - {"time"}


def figure(name: str, table: Any) -> Figure:
    """A figure from its table in the study file."""
    where = f"[record] {name}"
    if not isinstance(table, Mapping):
        raise SweepError(f'{where}: write {name} = {{ max = "abs(component.variable)" }}; instead of max: {", ".join(KINDS)}.')
    kinds = [key for key in table if key in KINDS]
    if len(kinds) != 1 or set(table) - {*kinds, "from", "to", "unit"}:
        raise SweepError(
            f"{where}: one of {', '.join(KINDS)} is wanted, beside from, to and unit; there is {', '.join(table) or 'nothing'}."
        )
    made = Figure(
        name, kinds[0], str(table[kinds[0]]), table.get("from", -np.inf), table.get("to", np.inf), table.get("unit", "")
    )
    if made.end < made.begin:
        raise SweepError(f"{where}: the window from {made.begin} to {made.end} s is empty.")
    return made


def check_window(one: Figure, stop: float) -> None:
    """Refuse a window that the run is not there for: a figure of less than was asked for looks like any other."""
    for what, time in (("begins", one.begin), ("ends", one.end)):
        if stop + SLACK < time < np.inf:
            raise SweepError(f"[record] {one.name}: its window {what} at {time} s, after the end of the run at {stop} s.")


def evaluate(expression: str, table: pd.DataFrame, known: Mapping[str, Any] | None = None) -> np.ndarray:
    """The expression's value in each row of the table; SweepError where it has none."""
    columns = {name: column.to_numpy() for name, column in table.items()}
    try:
        value = parse(expression)(columns | dict(known or {}))
    except DescriptionError as error:
        raise SweepError(str(error)) from None
    found = np.asarray(value)
    if found.shape not in ((), (1,), (len(table),)):
        raise SweepError(f"{expression} is a list, and no value. Lists are for what something is in: a in [1, 2].")
    return np.broadcast_to(found, len(table))


def figures(wanted: list[Figure], table: pd.DataFrame, parameters: Mapping[str, Any]) -> dict[str, float]:
    """All figures of a run."""
    known = dict(parameters)
    time = table["time"].to_numpy()
    for one in wanted:
        if one.kind == "value":
            known[one.name] = float(evaluate(one.expression, pd.DataFrame(index=[0]), known)[0])
            continue
        window = (time >= one.begin - SLACK) & (time <= one.end + SLACK)
        if not window.any():
            raise SweepError(f"{one.name}: the run has no point between {one.begin} and {one.end} s.")
        y = evaluate(one.expression, table[window], known).astype(float)
        known[one.name] = float(KINDS[one.kind](time[window], y))
    return {one.name: known[one.name] for one in wanted}
