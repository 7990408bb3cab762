"""Expressions that a person writes in a file: over named values of a system, columns and figures of a study, and nothing else.

    abs(rear_reducer.input_torque)        (motor.electric_power > 0) * motor.electric_power        friction * ratio >= 1

Numbers, names, dotted names of columns (any other in backquotes), texts to compare with, + - * / // % **, comparisons,
& | ~ and or not (& and | bind as loosely as `and` and `or`, as in pandas), in and not in, and the FUNCTIONS below. Every
number is a float64. Files come from others, so what is not in this list is refused, and never looked up in Python.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from .errors import DescriptionError

LONGEST, NODES, DEPTH = 10_000, 2_000, 150
"""Characters, syntax nodes and levels of nesting that an expression may have."""

_NAMES = "abs sqrt exp expm1 log log1p log10 sin cos tan sinh cosh tanh arcsin arccos arctan arctan2 arcsinh arccosh arctanh floor ceil"
FUNCTIONS: dict[str, np.ufunc] = {name: getattr(np, name) for name in _NAMES.split()}

CONSTANTS = {"inf": np.inf, "True": True, "False": False}

_BINARY: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow,
}  # fmt: skip
_COMPARE: dict[type, Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.In: lambda left, right: np.isin(left, right), ast.NotIn: lambda left, right: ~np.isin(left, right),
}  # fmt: skip
_WORDS = re.compile(
    r"""(?P<text>'[^']*'|"[^"]*")|`(?P<quoted>[^`]+)`|(?<![\w.])(?P<dotted>[^\W\d]\w*(?:\.[^\W\d]\w*)+)|(?P<sign>[&|])"""
)


@dataclass(frozen=True)
class Expression:
    """An expression read and found harmless: its tree, the names in it and the columns that they stand for."""

    text: str
    tree: ast.expr
    columns: Mapping[str, str]  # stand-in in the tree → column
    names: frozenset[str]  # all others: time, parameters, figures

    def __call__(self, known: Mapping[str, Any]) -> Any:
        """The value; `known` gives each name and column a number, a text or an array."""
        try:
            with np.errstate(all="ignore"):
                value = self._value(self.tree, known)
        except (ArithmeticError, TypeError, ValueError) as error:
            raise self._wrong(f"{error}") from None
        if np.iscomplexobj(value):
            raise self._wrong("its value is not real")
        return value

    def _wrong(self, why: str) -> DescriptionError:
        return DescriptionError(f"The expression {self.text} cannot be evaluated: {why}.")

    def _value(self, node: ast.expr, known: Mapping[str, Any]) -> Any:
        match node:
            case ast.Constant(value=bool() | str() as value):
                return value
            case ast.Constant(value=int() | float() as value):
                return float(value)
            case ast.Name(id=name):
                return self._named(self.columns.get(name, name), known)
            case ast.List(elts=items) | ast.Tuple(elts=items):
                return [self._value(item, known) for item in items]
            case ast.UnaryOp(op=ast.USub(), operand=part):
                return -self._number(part, known)
            case ast.UnaryOp(op=ast.UAdd(), operand=part):
                return +self._number(part, known)
            case ast.UnaryOp(operand=part):  # ~ and not
                return np.invert(self._truth(part, known))
            case ast.BinOp(op=op, left=left, right=right):
                return _BINARY[type(op)](self._number(left, known), self._number(right, known))
            case ast.BoolOp(op=op, values=parts):
                join = np.logical_and if isinstance(op, ast.And) else np.logical_or
                return join.reduce(np.broadcast_arrays(*(self._truth(part, known) for part in parts)))
            case ast.Compare(left=left, ops=ops, comparators=others):
                sides = [self._value(side, known) for side in (left, *others)]
                each = [_COMPARE[type(op)](a, b) for op, a, b in zip(ops, sides, sides[1:])]
                return each[0] if len(each) == 1 else np.logical_and.reduce(np.broadcast_arrays(*each))
            case ast.Call(func=ast.Name(id=name), args=given):
                return FUNCTIONS[name](*(self._number(one, known) for one in given))
        raise self._wrong(f"{ast.unparse(node)} has no place here")

    def _named(self, name: str, known: Mapping[str, Any]) -> Any:
        for names in (known, CONSTANTS):
            if name in names:
                return names[name]
        raise self._wrong(f"there is nothing called {name}")

    def _number(self, node: ast.expr, known: Mapping[str, Any]) -> Any:
        """Not a text: one times a number, or one filled in with %, can be of any size."""
        value = self._value(node, known)
        if isinstance(value, (str, list)) or getattr(value, "dtype", None) == "object":
            raise self._wrong(f"{ast.unparse(node)} is no number")
        return value

    def _truth(self, node: ast.expr, known: Mapping[str, Any]) -> Any:
        value = np.asarray(self._value(node, known))
        if value.dtype != bool:
            raise self._wrong(f"{ast.unparse(node)} is neither true nor false")
        return value


@lru_cache(maxsize=1024)
def parse(text: str) -> Expression:
    """Read an expression; DescriptionError where it holds anything that is not in the list above."""
    shown = text if len(text) <= 200 else f"{text[:200]}…"
    if len(text) > LONGEST:
        raise DescriptionError(f"The expression {shown} has {len(text)} characters; at most {LONGEST} are read.")
    stand_in = "_"
    while stand_in in text:
        stand_in += "_"
    columns: dict[str, str] = {}

    def word(found: re.Match[str]) -> str:
        if found["text"]:
            return found[0]
        if found["sign"]:
            return " and " if found["sign"] == "&" else " or "
        name = f"{stand_in}{len(columns)}"
        columns[name] = found["quoted"] or found["dotted"]
        return name

    try:
        tree = ast.parse(_WORDS.sub(word, text).strip(), mode="eval").body
    except SyntaxError as error:
        raise DescriptionError(f"The expression {shown} cannot be read: {error.msg}.") from None
    except (ValueError, RecursionError, MemoryError, OverflowError) as error:
        raise DescriptionError(f"The expression {shown} cannot be read: {error or 'it is nested too deep'}.") from None
    names: set[str] = set()
    _look_through(tree, shown, names)
    return Expression(shown, tree, columns, frozenset(names - set(columns) - set(CONSTANTS)))


def _look_through(tree: ast.expr, shown: str, names: set[str]) -> None:
    """Refuse what is not in the list, what is too large, and what is nested too deep; gather the names."""
    waiting: list[tuple[ast.AST, int]] = [(tree, 1)]
    count = 0
    while waiting:
        node, depth = waiting.pop()
        count += 1
        if count > NODES or depth > DEPTH:
            raise DescriptionError(
                f"The expression {shown} is too large: at most {NODES} terms, nested {DEPTH} deep, are evaluated."
            )
        below: list[ast.AST] = []
        match node:
            case ast.Constant(value=bool() | int() | float() | str()):
                pass
            case ast.Name(id=name):
                names.add(name)
            case ast.UnaryOp(operand=part):
                below = [part]
            case ast.BinOp(op=op, left=left, right=right) if type(op) in _BINARY:
                below = [left, right]
            case ast.BoolOp(values=parts):
                below = [*parts]
            case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in _COMPARE for op in ops):
                below = [left, *others]
            case ast.List(elts=items) | ast.Tuple(elts=items) if all(isinstance(item, ast.Constant) for item in items):
                below = [*items]
            case ast.Call(func=ast.Name(id=name), args=given, keywords=[]) if name in FUNCTIONS:
                if len(given) != FUNCTIONS[name].nin:
                    raise DescriptionError(
                        f"The expression {shown}: {name} takes {FUNCTIONS[name].nin} value(s), not {len(given)}."
                    )
                below = [*given]
            case _:
                raise DescriptionError(
                    f"The expression {shown} holds {_said(node)}, which has no place there: numbers, names, component.variable, "
                    f"arithmetic, comparisons, & | ~ and the functions {', '.join(FUNCTIONS)}."
                )
        waiting += [(one, depth + 1) for one in below]


def _said(node: ast.AST) -> str:
    try:
        said = ast.unparse(node)
    except (RecursionError, ValueError):
        said = type(node).__name__
    return said if len(said) <= 60 else f"{said[:60]}…"
