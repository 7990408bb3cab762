"""Every row of the claims holds on ideal tables, and fails when its own matter is spoilt."""

import json
import math
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from selflock.master.errors import ResultError
from selflock.study import StudyResult
from selflock.study.claims import ROWS, Check, Curves, evaluate
from selflock.study.claims.torque import least_admissible
from tests.study.synthetic import FACTS, TIME, ideal


@pytest.fixture(scope="module")
def perfect():
    return ideal()


@pytest.mark.parametrize("number", sorted(ROWS))
def test_holds_on_ideal_tables(perfect, number):
    claim = ROWS[number].evaluate(perfect)
    assert claim.holds, claim.measured


def test_all_nineteen_rows_are_there(perfect):
    assert [claim.number for claim in evaluate(perfect)] == list(range(1, 20))


def change(run: Curves, column: str, window, function) -> Curves:
    """The same run with one column changed within a window."""
    table = run.table.copy()
    inside = (TIME >= window[0]) & (TIME <= window[1])
    values = table[column].to_numpy(copy=True)
    values[inside] = function(values[inside])
    table[column] = values
    return Curves(table)


F, P = "rear_reducer.input_torque", "rear_reducer.output_torque"
WHOLE = (0.0, 10.0)

# For each claim: which run, which column, when, and what is done to it.
SPOIL = {
    1: ("dynamic", 0.0, F, (6.995, 7.005), lambda v: v * 1.001),
    2: ("kinematic", 0.02, P, WHOLE, lambda v: v * 1.02),
    3: ("dynamic", 0.01, P, (1.0, 2.0), lambda v: v * (1 + 0.05 * np.sin(np.arange(len(v))))),
    4: ("kinematic", 0.03, "robot.rear_pressure_x", (2.6, 2.7), lambda v: v + FACTS.sprocket_radius),
    5: ("dynamic", 0.03, "robot.rear_gravity_moment", (3.2, 3.7), lambda v: v * 1.2),
    6: ("kinematic", 0.0, P, (4.0, 5.0), lambda v: 0 * v + 7.0),
    7: ("kinematic", 0.01, F, (6.3, 7.7), lambda v: v * 1.011),
    8: ("kinematic", 0.02, F, (9.495, 9.505), lambda v: v + 1e-6),
    9: ("kinematic", 0.03, F, (3.295, 3.305), lambda v: -v),
    10: ("kinematic", 0.01, F, (5.0, 6.0), lambda v: v * 1.5),  # admissible, and not the least
    11: ("dynamic", 0.03, F, (8.01, 10.0), lambda v: 0 * v),
    12: ("dynamic", 0.01, F, (3.8, 4.4), lambda v: v * 2),
    13: ("dynamic", 0.02, "rear_motor.mechanical_power", (9.195, 9.205), lambda v: v + 1.0),
    14: ("dynamic", 0.02, "rear_motor.electric_power", (5.5, 6.0), lambda v: v + 1.0),
    15: ("dynamic", 0.03, "rear_motor.electric_power", (6.0, 8.0), lambda v: v * 0.2),
    16: ("dynamic", 0.0, "rear_motor.electric_power", (2.2, 2.8), lambda v: v * 1.3),
    17: ("dynamic", 0.02, "robot.rear_angle", WHOLE, lambda v: v + math.radians(0.6)),
    18: ("contact", ("ground_stiffness", 0.7), P, (9.0, 10.0), lambda v: v * 1.04),
    19: ("sweep", 0.03, "rear_motor.electric_power", (6.0, 8.0), lambda v: v * 0.1),
}


@pytest.mark.alike
@pytest.mark.parametrize("number", sorted(ROWS))
def test_fails_when_spoilt(perfect, number):
    group, key, column, window, function = SPOIL[number]
    runs = ideal()
    members = getattr(runs, group)
    members[key] = change(members[key], column, window, function)
    claim = ROWS[number].evaluate(runs)
    assert not claim.holds
    assert not claim.error


@pytest.mark.alike
@pytest.mark.parametrize("number", sorted(ROWS))
def test_not_a_number_never_holds(number):
    group, key, column, window, _ = SPOIL[number]
    runs = ideal()
    members = getattr(runs, group)
    members[key] = change(members[key], column, window, lambda v: v * math.nan)
    with np.errstate(invalid="ignore"):
        assert not ROWS[number].evaluate(runs).holds


def test_a_run_without_the_column_fails_with_a_reason(perfect):
    runs = ideal()
    runs.dynamic[0.0] = Curves(runs.dynamic[0.0].table.drop(columns=F))
    claim = ROWS[1].evaluate(runs)
    assert not claim.holds
    assert F in claim.error


def test_a_run_that_ended_early_says_so(perfect):
    short = Curves(perfect.dynamic[0.0].table[TIME < 5])
    with pytest.raises(ResultError, match="ends at"):
        short.mean(P, "hold C")


def test_claims_go_to_json(perfect):
    for claim in evaluate(perfect):
        told = json.loads(json.dumps(claim.as_dict(), allow_nan=False))
        assert told["holds"] is True
        assert all(check["holds"] for check in told["checks"])


@pytest.mark.parametrize(
    ("relation", "value", "holds"),
    [("<=", 1.0, True), ("<", 1.0, False), (">=", 1.0, True), (">", 1.0, False), ("<=", math.nan, False)],
)
def test_check(relation, value, holds):
    assert Check("x", value, relation, 1.0).holds is holds


@pytest.mark.parametrize("mu", [0.0, 0.005, 0.013, 0.02, 0.05])
@pytest.mark.parametrize("load", [7.3, -0.2])
def test_least_admissible_is_the_edge_of_the_cone(mu, load):
    alpha = FACTS.alpha
    edge = max(math.tan(alpha - math.atan(mu)), 0.0) * abs(load)
    assert least_admissible(load, mu, alpha, 0.0, 1e-4) == pytest.approx(edge, abs=1.01e-4 * abs(load) * math.tan(alpha))


def test_the_terminals_table_says_the_verdict_in_words():
    """The terminal reads no markup, for names come from strangers: colour must not be written as text."""
    good = evaluate(ideal())[0]
    claims = [good, replace(good, error="no data")]
    console = Console(markup=False, width=100, record=True, file=StringIO())
    console.print(StudyResult(Path("report.html"), claims).table())
    told = console.export_text()
    assert "holds" in told and "FAILS" in told and "[" not in told
