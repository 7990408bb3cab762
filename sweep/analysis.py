"""What the runs of a study say together: what a figure depends on, which runs no other run beats."""

from __future__ import annotations

import numpy as np
import pandas as pd

from .study import Study, problem


def pareto(costs: np.ndarray) -> np.ndarray:
    """Which rows no other row beats: none is at most as large in every column and smaller in one."""
    best = np.ones(len(costs), bool)
    for number, row in enumerate(costs):
        best[number] = not ((costs <= row).all(axis=1) & (costs < row).any(axis=1)).any()
    return best


def sensitivity(study: Study, table: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Share of each figure's variance that each parameter causes, and how it was found.

    Columns figure, parameter, first (alone), total (with all its interactions), error (95 %, of first); empty where the
    design does not tell. By Sobol's indices on the design of Saltelli; by random balance designs on other samples; on a
    full grid, variances of conditional means are sums over the grid itself.
    """
    good = table[table["status"] == "ok"]
    ranges = {name: study.data["vary"][name]["range"] for name in study.varied if "range" in study.data["vary"][name]}
    others = [name for name in study.varied if name not in ranges and table[name].nunique() > 1]
    if len(good) < 4:
        return _rows([]), "There are too few finished runs to tell what depends on what."
    if not ranges:
        if len(good) != np.prod([table[name].nunique() for name in others]) or not others:
            return _rows([]), "Only a full grid or samples tell what depends on what" + (
                ", and runs are missing or failed." if len(good) < len(table) else "."
            )
        return _rows(_on_grid(good, one.name, others) for one in study.record), "On the full grid, each value alike."
    if others:
        return _rows([]), "Indices are computed for samples alone, not for samples at each point of a grid."
    if study.data["sample"]["method"] == "saltelli":
        if len(good) < len(table):
            return _rows([]), f"Sobol indices need every run of their design; {len(table) - len(good)} failed or are missing."
        return _rows(_sobol(good, one.name, ranges) for one in study.record), "Sobol indices (SALib, design of Saltelli)."
    return (
        _rows(_balance(good, one.name, ranges) for one in study.record),
        "First-order Sobol indices by random balance designs (SALib). The method saltelli gives total ones too.",
    )


def _rows(groups) -> pd.DataFrame:
    columns = ["figure", "parameter", "first", "total", "error"]
    return pd.DataFrame([row for group in groups for row in group], columns=columns)


def _on_grid(good: pd.DataFrame, figure: str, names: list[str]) -> list[tuple]:
    """First: Var(E[y|x]) / Var(y). Total: E[Var(y|all but x)] / Var(y)."""
    y = good[figure].astype(float)
    variance = y.var(ddof=0)
    if not variance > 0.0:
        return []
    rows = []
    for name in names:
        alone = y.groupby(good[name]).transform("mean").var(ddof=0)
        rest = [good[other] for other in names if other != name]
        within = (y - y.groupby(rest).transform("mean")).pow(2).mean() if rest else variance
        rows.append((figure, name, alone / variance, within / variance, np.nan))
    return rows


def _sobol(good: pd.DataFrame, figure: str, ranges: dict) -> list[tuple]:
    from SALib.analyze import sobol

    y = good[figure].to_numpy(float)
    if not y.std() > 0.0:
        return []
    found = sobol.analyze(problem(ranges), y, calc_second_order=False, seed=1)
    return list(zip([figure] * len(ranges), ranges, found["S1"], found["ST"], found["S1_conf"]))


def _balance(good: pd.DataFrame, figure: str, ranges: dict) -> list[tuple]:
    from SALib.analyze import rbd_fast

    x, y = good[list(ranges)].to_numpy(float), good[figure].to_numpy(float)
    if not y.std() > 0.0 or len(y) <= 20:  # SALib's ten harmonics need more than twice as many points
        return []
    found = rbd_fast.analyze(problem(ranges), x, y, seed=1)
    return [(figure, name, s1, np.nan, error) for name, s1, error in zip(ranges, found["S1"], found["S1_conf"])]
