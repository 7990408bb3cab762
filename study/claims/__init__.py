"""The published study's claims as checks on the tables of the runs: one function per row.

Nothing here is fitted: windows, tolerances and definitions are those of the study's claims, and a row that does
not hold says so.
"""

from . import drive, torque  # noqa: F401  (they fill ROWS)
from .check import ROWS, Check, Claim
from .curves import LIMIT, Curves, Facts, Runs

__all__ = ["LIMIT", "ROWS", "Check", "Claim", "Curves", "Facts", "Runs", "evaluate"]


def evaluate(runs: Runs) -> list[Claim]:
    """All rows, by number."""
    return [ROWS[number].evaluate(runs) for number in sorted(ROWS)]
