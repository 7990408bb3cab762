"""What is to be told of a search beside its answer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..rules import RULES
from .extended import gone_through
from .guesses import CURVE, points_of
from .rows import followed

if TYPE_CHECKING:
    from .run import Search


def beyond(found: Search) -> list[str]:
    """What is to be told of a curve whose variable goes beyond what taught in what judges: nothing can be closed there."""
    winner, work = found.outcomes[0].winner if found.outcomes else None, found.work
    if winner is None or winner.guess.kind != CURVE or not work.judges:
        return []
    table = winner.guess.inserts[0]
    low, high = points_of(table)[[0, -1]]
    series = work.played.series(found.best.problem.settings(found.best.values), sorted(work.judges))
    x = gone_through(series, table.over, table.taken, table.beside)
    share = float(np.mean((x < low) | (x > high)))
    if share < RULES.naming.goes_beyond:
        return []
    return [
        f"{table.goes_with} lies beyond what taught ({low:.4g} to {high:.4g}) in {100.0 * share:.0f} % of what judges: there the "
        "curve stays as at its last point, and says nothing. Let a log that teaches go as far"
    ]


def at_once(found: Search) -> list[str]:
    """What is to be told of outputs that were recorded in the row of what they follow at once, where something else hid it before."""
    told = followed(found.best.problem, found.best.values)
    return [
        f"{name} fits what the model computes for the next row better ({now:.3g} -> {then:.3g}), as where an FMU follows an input "
        "at once and both were read in one row: what is held from a row on acts in the row behind it. Move such a column down by "
        "a row, and name again"
        for name, (now, then) in told.items()
    ]
