"""Expressions come from others: what they may hold, what they are worth (as pandas says), and that they run no code."""

import os
import re
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from selflock import examples
from selflock.master.errors import DescriptionError
from selflock.master.expression import FUNCTIONS
from selflock.sweep.errors import SweepError
from selflock.sweep.record import KINDS, evaluate, parse

DOTTED = re.compile(r"(?<![\w.`])[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+")
ATTACKS = (
    "a + 0*(@pd).io.common.os.system('touch {mark}')",
    "@evaluate.__globals__",
    "__import__('os').system('touch {mark}')",
    "m.y.__class__",
    "m.y.to_csv('{mark}')",
    "(m.y).to_csv('{mark}')",
    "a.__class__.__mro__",
    "abs.__self__",
    "open('{mark}', 'w')",
    "exec('1')",
    "list(a)",
    "datetime.datetime",
    "[x for x in (1, 2)]",
    "(lambda: 1)()",
    "f'{{a}}'",
    "(b := a)",
    "a[0]",
    "a if a else a",
    "abs(x=a)",
    "abs(*a)",
    "sqrt(a, a)",
    "'%99999999999f' % a",
    "'ab' * a",
    "label * a",
    "label % a",
    "b'ab'",
    "1j * a",
    "a ** 1j",
    "a @ a",
    "a << 100000000000",
    "a is a",
    "",
    "a +",
    "a\0",
    "nothing",
    "not a",
    "10 ** 400",
    "9" * 5000,
    "(" * 3000 + "a" + ")" * 3000,
    "-" * 5000 + "a",
    "+".join("a" * 5000),
    "a " * 100000,
    "abs(" * 180 + "a" + ")" * 180,
    "9 ** 9 ** 9",
    "9 ** 9 ** 9 ** 9 ** 9",
    "(-8) ** 0.5",
    "1 / 0",
)


def table():
    time = np.linspace(0.0, 1.0, 5)
    return pd.DataFrame({"time": time, "m.y": np.sin(7.0 * time), "m.z": 2.0 - time, "a": 1.5})


@pytest.mark.parametrize("attack", ATTACKS, ids=range(len(ATTACKS)))
def test_what_is_no_expression_is_one_message_and_does_nothing(attack, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "system", lambda command: pytest.fail(f"ran {command}"))
    with pytest.raises(SweepError) as caught:
        evaluate(attack.replace("{mark}", str(tmp_path / "mark")), table(), {"label": "%99999999999f"})
    assert len(str(caught.value)) < 700
    assert not list(tmp_path.iterdir())


def as_pandas(expression: str, rows: pd.DataFrame, known: dict) -> np.ndarray:
    """The value as pandas has it, which evaluated the expressions before."""
    quoted = DOTTED.sub(lambda found: f"`{found[0]}`", expression)
    value = rows.eval(quoted, local_dict={}, resolvers=(known,), engine="python")
    return np.broadcast_to(np.asarray(value), len(rows))


def of_examples():
    """Every expression in the examples."""
    for path in sorted(Path(examples.__file__).parent.rglob("*.toml")):
        data = tomllib.loads(path.read_text())
        for name, entry in data.get("record", {}).items():
            for kind in KINDS.keys() & entry.keys():
                yield f"{path.stem} {name}", entry[kind]
        for name, entry in data.get("set", {}).items():
            if isinstance(entry, str) and entry.startswith("="):
                yield f"{path.stem} {name}", entry[1:]


@pytest.mark.parametrize(("name", "expression"), list(of_examples()))
def test_the_examples_are_worth_what_they_were(name, expression):
    rng = np.random.default_rng(len(expression))
    read = parse(expression)
    rows = pd.DataFrame({column: rng.normal(size=20) for column in read.columns.values()}, index=range(20))
    known = {name: float(rng.uniform(0.1, 3.0)) for name in read.names}
    np.testing.assert_array_equal(evaluate(expression, rows, known), as_pandas(expression, rows, known))


NUMBERS = st.one_of(
    st.sampled_from(["m.y", "m.z", "time", "a", "k", "`m.z`"]),
    st.integers(0, 9).map("{}.0".format),  # as ours are: of whole ones pandas makes 0 of 0 % 0, and no -0
    st.floats(0.01, 100.0).map(lambda value: f"{value:.3g}"),
)
ONE = sorted(name for name, function in FUNCTIONS.items() if function.nin == 1)


def larger(inner):
    """One more operation. A truth is counted as 1.0 at once: pandas reckons with whole numbers there, and 0 % 0 is 0 in them."""
    column = inner.map(lambda one: f"m.z + {one}")  # of scalars alone, ~ is Python's in pandas: ~False is -1 there, true here
    truth = st.tuples(column, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), inner).map(" ".join)
    return st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/", "//", "%"]), inner).map(lambda made: f"({' '.join(made)})"),
        st.tuples(inner, st.sampled_from(["2", "0.5", "3"])).map(lambda made: f"({made[0]}) ** {made[1]}"),
        inner.map(lambda one: f"-({one})"),
        st.tuples(st.sampled_from(ONE), inner).map(lambda made: f"{made[0]}({made[1]})"),
        st.tuples(inner, inner).map(lambda made: f"arctan2({made[0]}, {made[1]})"),
        st.tuples(truth, st.sampled_from(["&", "|", "and", "or"]), truth, inner).map(
            lambda made: f"(1.0 * ({made[0]} {made[1]} {made[2]}) * ({made[3]}))"
        ),
        st.tuples(truth, inner).map(lambda made: f"(1.0 * (~({made[0]})) * ({made[1]}))"),
        st.tuples(inner, inner, inner, inner).map(lambda made: f"(1.0 * ({made[0]} < {made[1]} <= {made[2]}) * ({made[3]}))"),
    )


@given(st.recursive(NUMBERS, larger, max_leaves=6))
@pytest.mark.slow
def test_values_are_those_of_pandas(expression):
    """Over columns: with one in it at every place, no integer arithmetic of Python's decides."""
    expression = f"m.y + ({expression})"
    known = {"k": 0.7}
    try:
        expected = as_pandas(expression, table(), known)
    except Exception:  # whatever pandas makes of it: nothing to compare with, but ours is one message or a value
        try:
            evaluate(expression, table(), known)
        except (SweepError, DescriptionError):
            pass
        return
    try:
        got = evaluate(expression, table(), known)
    except (SweepError, DescriptionError):  # between constants alone: Python's own arithmetic said no, or left the real numbers
        assert not np.all(np.isreal(expected)) or not np.all(np.isfinite(expected))
        return
    np.testing.assert_allclose(got.astype(float), np.real(expected).astype(float), rtol=1e-13, atol=1e-300)


def test_names_of_choices_are_compared():
    rows = pd.DataFrame({"ground": ["flat", "steps", "a.b & c"], "k": [1.0, 2.0, 3.0]})
    assert list(evaluate("(ground == 'flat') * k", rows)) == [1.0, 0.0, 0.0]
    assert list(evaluate("ground in ['flat', 'a.b & c']", rows)) == [True, False, True]
    assert list(evaluate("ground not in ('flat', 'steps')", rows)) == [False, False, True]


def test_names_that_python_has_words_for_and_names_with_signs():
    rows = pd.DataFrame({"motor.in": [1.0], "m.x[1]": [2.0], "m.der(x)": [3.0], "_0": [4.0]})
    assert list(evaluate("motor.in + `m.x[1]` * `m.der(x)` + _0", rows)) == [11.0]
