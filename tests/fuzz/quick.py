"""Small inputs, thousands a second: what is read of a file before anything of it is simulated, expressions, units.

`KINDS[kind](dice, folder)` draws one and asks for it; what may come back is that of inputs.py. Numbered dice draw the same again.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import inputs
import numpy as np
import pandas as pd

from selflock import master
from selflock.diagnosis.data.rig import load as load_rig
from selflock.diagnosis.data.table import table as read_table
from selflock.diagnosis.data.units import conversion
from selflock.fmus.errors import SelflockError
from selflock.master.expression import FUNCTIONS
from selflock.sweep.record import evaluate
from selflock.sweep.study import read as read_study

TABLE = pd.DataFrame({"a": [0.0, 1.0, -2.5], "motor.speed": [1e300, -1e-300, 3.0]})
KNOWN = {"n": 4, "flag": True, "name": "x"}
WORDS = "0 1 -1 0.5 1e308 1e-320 'x' \" `a pi @a __import__ a.b.c é \0 ..."
ATOMS = [*TABLE, *KNOWN, "9" * 40, *WORDS.split(" ")]
SIGNS = "+ - * / // % ** < <= == != and or & | , := if in . ; =".split()
SYMBOLS = [*"N m rad s deg rpm V A Ohm K degC kg 1 % Hz turn count Nm g µ k inf".split(), ""]
POWERS = ["", "", "", "2", "-1", "^2", "**3", "99999999", "0", "-", "1e9"]


def _expression(dice: random.Random, depth: int = 0) -> str:
    way = dice.randrange(8) if depth < 6 else 0
    more = lambda: _expression(dice, depth + 1)
    if way <= 2:
        return dice.choice(ATOMS)
    if way <= 5:
        return f"{more()} {dice.choice(SIGNS)} {more()}"
    if way == 6:
        return f"{dice.choice([*FUNCTIONS, 'open', 'exec', 'a'])}({', '.join(more() for _ in range(dice.randrange(4)))})"
    return dice.choice(["({})", "-{}", "not {}", "[{}]", "{}[0]", "{}.T", "(" * 40 + "{}" + ")" * 40, "{"]).replace("{}", more())


def expression(dice: random.Random, folder: Path) -> None:
    assert evaluate(_expression(dice), TABLE, KNOWN).shape == (3,)


def unit(dice: random.Random, folder: Path) -> None:
    def name() -> str:
        return dice.choice(["", ".", "/", "*", " "]).join(
            dice.choice(SYMBOLS) + dice.choice(POWERS) for _ in range(dice.randrange(1, 4))
        )

    try:
        factor, offset = conversion(name(), dice.choice(["rad", "N.m", "rad/s", "degC", "V", name()]))
    except ValueError as error:
        raise SelflockError(str(error)) from None
    assert np.isfinite([factor, offset]).all(), "a conversion by no number"


def _changed(dice: random.Random, text: str) -> bytes:
    """As inputs.changed: lines of a file with a few things wrong."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    for _ in range(dice.randrange(1, 5)):
        place, way = dice.randrange(len(lines)), dice.randrange(6)
        key, equals, _ = lines[place].partition("=")
        if way <= 2 and equals:
            lines[place] = f"{key}= {dice.choice(inputs.VALUES)}"
        elif way == 3 and len(lines) > 1:
            del lines[place]
        elif way == 4:
            lines.insert(place, f"{dice.choice(inputs.KEYS)} = {dice.choice(inputs.VALUES)}")
        else:
            lines.insert(place, f"[{dice.choice(inputs.KEYS)}]")
    whole = "\n".join(lines).encode() + b"\n"
    return whole if dice.randrange(10) else whole[: dice.randrange(len(whole))] + dice.choice(inputs.BYTES)


def _file(text: str, ending: str, read: Callable[[Path], object]) -> Callable[[random.Random, Path], None]:
    def ask(dice: random.Random, folder: Path) -> None:
        path = folder / f"x{ending}"
        path.write_bytes(_changed(dice, text))
        read(path)

    return ask


def table(dice: random.Random, folder: Path) -> None:
    rows = [["time", "speed", "torque"], *([f"{0.01 * k:g}", f"{k % 5}", "0.5"] for k in range(12))]
    for _ in range(dice.randrange(1, 6)):
        dice.choice(rows)[dice.randrange(3)] = dice.choice(inputs.WRONG)
    whole = "\n".join(dice.choice([",", ",", ";", "\t"]).join(row) for row in rows).encode()
    (folder / "x.csv").write_bytes(
        whole if dice.randrange(5) else whole[: dice.randrange(len(whole))] + dice.choice(inputs.BYTES)
    )
    read_table(folder / "x.csv")


KINDS = {
    "expression": expression,
    "unit": unit,
    "system, read": _file(inputs.MOTOR, ".toml", master.load),
    "rig, read": _file(inputs.RIG, ".toml", load_rig),
    "sweep, read": _file(inputs.SWEEP, ".toml", read_study),
    "table, read": table,
}


def ask(kind: str, number: str, folder: Path) -> str:
    """The input of this number: "answered" or "refused". Raises whatever else comes of it."""
    try:
        with inputs.bounded(), np.errstate(all="ignore"):
            KINDS[kind](random.Random(number), folder)
    except inputs.RIGHT as error:
        assert str(error).strip(), "an empty message"
        return "refused"
    return "answered"
