"""A sweep's description (TOML): which system, what varies, what is kept. docs/sweep.md has every key.

system = "robot.toml"
stop = 10.0
table = false                   # true: keep each run's whole table

[set]                           # for all runs; "= ..." is an expression over the varied parameters
"robot.track" = "belt"
"connections.rear_controller.angle.factor" = "= 1 / ratio"

[vary.friction]
set = ["front_reducer.friction_kinetic", "rear_reducer.friction_kinetic"]
values = [0.0, 0.01, 0.02]      # or grid = { from = 0, to = 0.06, count = 13 }, or range = [0.0, 0.06] for samples

[sample]                        # for the ranges
method = "sobol"                # lhs | sobol | saltelli
count = 256
seed = 1

[record]
energy = { integral = "rear_motor.electric_power", from = 2.0, to = 8.0, unit = "J" }
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date, time
from math import isfinite, prod
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from selflock.master import toml

from . import roles
from .errors import SweepError
from .record import Figure, check_window, evaluate, figure

KEYS = ("name", "description", "system", "stop", "table", "set", "vary", "list", "sample", "record", "report")
MOST = 1_000_000  # runs of a sweep
WAYS = ("values", "grid", "range", "choices")
METHODS = ("lhs", "sobol", "saltelli")
WORDS = ("unit", "label")
SPACINGS = ("linear", "log")


@dataclass
class Study:
    """A sweep's description, its runs laid out."""

    file: Path
    data: dict[str, Any]  # the file as it is
    system: Path
    stop: float | None
    table: bool
    record: list[Figure]
    parameters: pd.DataFrame  # a row for each run, a column for each varied parameter and each constant of a choice
    settings: list[dict[str, Any]]  # for each run: component.variable → value
    varied: list[str]  # names of varied parameters
    report: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return self.data.get("name", self.file.stem)

    @property
    def about(self) -> dict[str, Any]:
        """What makes a study this study: all but its words and how its report looks."""
        return {key: value for key, value in self.data.items() if key not in ("name", "description", "report", "system")}

    @property
    def items(self) -> list[dict[str, Any]]:
        return [{"parameters": p, "settings": s} for p, s in zip(self.parameters.to_dict("records"), self.settings)]


def read(path: str | Path) -> Study:
    """The study of a TOML file."""
    path = Path(path)
    try:
        data = toml.read(path)
    except OSError as error:
        raise SweepError(f"The study {path} cannot be read: {error.strerror}.") from None
    except ValueError as error:
        raise SweepError(f"The study {path} is not valid TOML: {error}.") from None
    if other := toml.of_another_kind(path, data, "sweep"):
        raise SweepError(other)
    try:
        return from_dict(data, path)
    except SweepError as error:
        raise SweepError(f"{path}: {error}") from None


def from_dict(data: dict[str, Any], file: Path) -> Study:
    for key in data:
        if key not in KEYS:
            raise SweepError(f"the key {key} is unknown; there is: {', '.join(KEYS)}.")
    _check_kinds(data)
    if not isinstance(data.get("system"), str):
        raise SweepError('name the system to run: system = "path/to/system.toml".')
    vary = data.get("vary", {})
    if not vary:
        raise SweepError("nothing varies: add a table [vary.NAME].")
    for name, table in vary.items():
        _check_vary(name, table)
    parameters = _lay_out(vary, data.get("list"), data.get("sample", {}))
    record = [figure(name, table) for name, table in data.get("record", {}).items()]
    table = data.get("table", False)
    if not record and not table:
        raise SweepError("nothing is kept of the runs: add a [record], or table = true.")
    _check_names(record, parameters, data.get("stop"))
    roles.check(data.get("report", {}), [*parameters, *(one.name for one in record)])
    return Study(
        file,
        data,
        file.parent / data["system"],
        data.get("stop"),
        table,
        record,
        parameters,
        _settings(data.get("set", {}), vary, parameters),
        list(vary),
        data.get("report", {}),
    )


def _check_kinds(data: dict[str, Any]) -> None:
    """What is no table, text or number where one is wanted."""
    _kind(data, "", {"set vary sample record report": dict, "name description": str, "table": bool, "stop": float, "list": list})
    for part in ("vary", "record"):
        for name, table in data.get(part, {}).items():
            where = f"[{part}.{name}] "
            _kind({where: table}, "", {where: dict})
            _kind(table, where, {"unit label": str, "values": list, "choices grid": dict, "from to": Real})
    for row in data.get("list", []):
        _kind({"an entry of list": row}, "", {"an entry of list": dict})
    for name, table in data.get("vary", {}).items():
        targets = table.get("set", [])
        if not isinstance(targets, str) and not (isinstance(targets, list) and all(isinstance(t, str) for t in targets)):
            raise SweepError(f"[vary.{name}] set: name a variable, or a list of variables.")
        for label, choice in table.get("choices", {}).items():
            _kind({label: choice}, f"[vary.{name}] choices ", {label: dict})
    seed = data.get("sample", {}).get("seed", 0)
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise SweepError("[sample] seed: a whole number from 0 on is wanted here.")


def _kind(table: dict[str, Any], where: str, wanted: dict[str, type]) -> None:
    told = {dict: "a table", str: "a text", bool: "true or false", float: "a finite number", Real: "a number", list: "a list"}
    for names, kind in wanted.items():
        for name in [names] if names in table else names.split():
            value = table.get(name)
            good = _numbers(value) if kind is float else isinstance(value, kind) and value == value
            if value is not None and not good:
                raise SweepError(f"{where}{name}: {told[kind]} is wanted here.")


def _check_vary(name: str, table: Any) -> None:
    where = f"[vary.{name}]"
    if not name.isidentifier():
        raise SweepError(f"{where}: the name is used in expressions; write it with letters, digits and _ only.")
    if not isinstance(table, dict) or set(table) - {"set", *WORDS, *WAYS}:
        raise SweepError(f"{where} knows set, unit, label and one of {', '.join(WAYS)}.")
    if sum(way in table for way in WAYS) > 1:
        raise SweepError(f"{where}: only one of {', '.join(way for way in WAYS if way in table)} can be.")
    for way in WAYS:
        if way in table and not table[way]:
            raise SweepError(f"{where}: {way} is empty.")
    grid, ends = table.get("grid", {}), table.get("range", [0.0, 1.0])
    if "grid" in table and not (
        isinstance(grid, dict)
        and set(grid) - {"spacing"} == {"from", "to", "count"}
        and _numbers(grid["from"], grid["to"])
        and _count(grid["count"])
    ):
        raise SweepError(
            f'{where}: write grid = {{ from = 0.0, to = 1.0, count = 11, spacing = "linear" }}; the count is 1 to {MOST}.'
        )
    if not (isinstance(ends, list) and len(ends) == 2 and _numbers(*ends) and ends[0] < ends[1]):
        raise SweepError(f"{where}: range = {table['range']} is empty; write range = [low, high].")


def _count(value: Any) -> bool:
    """Whether it is a number of runs."""
    return isinstance(value, int) and not isinstance(value, bool) and 0 < value <= MOST


def _numbers(*values: Any) -> bool:
    """Whether they are numbers, and finite."""
    return all(isinstance(value, (int, float)) and not isinstance(value, bool) and isfinite(value) for value in values)


def _lay_out(vary: Mapping[str, dict], listed: Any, sample: dict) -> pd.DataFrame:
    """Every combination of what is on a grid with every sample of what has a range; or the list."""
    bare = [name for name, table in vary.items() if not any(way in table for way in WAYS)]
    if listed is not None:
        if len(bare) != len(vary):
            raise SweepError("with a list, [vary.*] says only what is set; the values are in the list.")
        rows = [{name: _plain(row[name]) for name in vary if name in row} for row in listed]
        if not rows or any(set(row) != set(vary) for row in listed):
            raise SweepError(f"every entry of list needs a value for each of {', '.join(vary)}, and for nothing else.")
        return pd.DataFrame(rows)
    if bare:
        raise SweepError(f"[vary.{bare[0]}] needs one of {', '.join(WAYS)}.")
    axes = [_axis(name, table) for name, table in vary.items() if "range" not in table]
    ranges = {name: table["range"] for name, table in vary.items() if "range" in table}
    if ranges:
        axes.append(_samples(ranges, sample))
    elif sample:
        raise SweepError("[sample] is for ranges, and there is none: give a parameter range = [low, high].")
    if (runs := prod(map(len, axes))) > MOST:
        raise SweepError(f"these are {runs} runs; a sweep has at most {MOST}. Vary less, or in coarser steps.")
    rows = [{name: value for row in combination for name, value in row.items()} for combination in itertools.product(*axes)]
    return pd.DataFrame(rows)


def _axis(name: str, table: dict) -> list[dict[str, Any]]:
    if "values" in table:
        return [{name: _plain(value)} for value in table["values"]]
    if "grid" in table:
        grid = table["grid"]
        spacing = grid.get("spacing", "linear")
        if spacing not in SPACINGS:
            raise SweepError(f"[vary.{name}]: spacing is linear or log.")
        ends = grid["from"], grid["to"], grid["count"]
        return [{name: float(value)} for value in (np.geomspace(*ends) if spacing == "log" else np.linspace(*ends))]
    return [
        {name: label, **{key: _plain(value) for key, value in choice.items() if "." not in key}}
        for label, choice in table["choices"].items()
    ]


def _samples(ranges: dict[str, list[float]], sample: dict) -> list[dict[str, float]]:
    method, count, seed = sample.get("method"), sample.get("count", 0), sample.get("seed", 0)
    if method not in METHODS or not _count(count) or set(sample) - {"method", "count", "seed"}:
        raise SweepError(f"ranges need a [sample] with method ({', '.join(METHODS)}), count (1 to {MOST}) and seed.")
    low, high = np.array(list(ranges.values()), float).T
    if method == "saltelli":  # the design from which Sobol indices can be computed: count · (parameters + 2) runs
        from SALib.sample import sobol

        points = sobol.sample(problem(ranges), count, calc_second_order=False, seed=seed)
    else:
        from scipy.stats import qmc  # a second to load, for those who sample

        sampler = {"lhs": qmc.LatinHypercube, "sobol": qmc.Sobol}[method](len(ranges), rng=seed)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "The balance properties of Sobol", UserWarning)  # its count is the person's
            points = qmc.scale(sampler.random(count), low, high)
    return [dict(zip(ranges, map(float, point))) for point in points]


def problem(ranges: Mapping[str, list[float]]) -> dict[str, Any]:
    """The ranges in the words of SALib."""
    return {
        "num_vars": len(ranges),
        "names": list(ranges),
        "bounds": [list(map(float, bounds)) for bounds in ranges.values()],
    }


def _plain(value: Any) -> Any:
    if isinstance(value, (date, time)):
        raise SweepError(
            f"{value} is a date or a time of day: no parameter has one. Write a number of seconds, or a text in quotes."
        )
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else value


def _check_names(record: list[Figure], parameters: pd.DataFrame, stop: float | None) -> None:
    known = set(parameters)
    for one in record:
        if one.name in known:
            raise SweepError(f"[record] {one.name}: something else has this name already.")
        if unknown := one.names - known:
            raise SweepError(f"[record] {one.name}: {sorted(unknown)[0]} is no varied parameter and no figure above it.")
        if one.kind == "value" and one.columns:
            raise SweepError(
                f"[record] {one.name}: a value cannot contain {sorted(one.columns)[0]}; take its final, max or mean first."
            )
        if stop is not None:
            check_window(one, stop)
        known.add(one.name)


def _settings(fixed: dict[str, Any], vary: Mapping[str, dict], parameters: pd.DataFrame) -> list[dict[str, Any]]:
    """component.variable → value for each run."""
    runs: list[dict[str, Any]] = [{} for _ in range(len(parameters))]
    for name, value in _flat(fixed):
        column = evaluate(value[1:], parameters) if isinstance(value, str) and value.startswith("=") else None
        for number, run in enumerate(runs):
            run[name] = _plain(value) if column is None else column[number].item()
    for name, table in vary.items():
        targets = [table.get("set", [])] if isinstance(table.get("set", []), str) else table.get("set", [])
        for run, value in zip(runs, parameters[name]):
            run.update(dict.fromkeys(targets, value))
            if "choices" in table:
                run.update({key: _plain(entry) for key, entry in table["choices"][value].items() if "." in key})
    return runs


def _flat(table: dict[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    """Nested tables with dotted names: a.b = 1 and "a.b" = 1 mean the same."""
    entries = []
    for name, value in table.items():
        entries += _flat(value, f"{prefix}{name}.") if isinstance(value, dict) else [(prefix + name, value)]
    return entries
