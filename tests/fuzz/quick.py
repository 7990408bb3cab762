"""Small inputs, thousands a second: what is read of a file before anything of it is simulated, expressions, units.

`KINDS[kind](dice, folder)` draws one and asks for it; what may come back is that of inputs.py. Numbered dice draw the same again.
"""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path

import inputs
import numpy as np
import pandas as pd

from selflock import master
from selflock.diagnosis.data.rig import load as load_rig
from selflock.diagnosis.data.table import table as read_table
from selflock.diagnosis.data.units import conversion
from selflock.diagnosis.planning.run import opened
from selflock.diagnosis.tracking.series import read as read_answers
from selflock.fmus.errors import SelflockError
from selflock.master.expression import FUNCTIONS
from selflock.sweep.record import evaluate
from selflock.sweep.study import read as read_study
from selflock.view import view as make_page

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


ANSWER = {
    "verdict": "ambiguous",
    "causes": [{"component": "load", "effect": "wave", "channel": "", "parameters": {"load.wave": {"value": 1.0, "low": 0.5, "high": 2.0, "unit": "N.m"}}}],
    "uncertain": [{"name": "load.mass", "unit": "kg", "value": 1.0, "low": 0.5, "high": 2.0}],
    "about": {"recorded": "2026-01-01T10:00:00", "unit": "u", "rig": "r", "told_by": "name", "version": "1", "logs": [{"sha256": "a"}]},
    "sources": {"rig": "rig.toml", "logs": ["log.csv"]},
    "models": [{"label": name, "values": {"load.mass": 2.0}, "free": {"load.mass": [1.0, 3.0]}} for name in "ab"],
}  # fmt: skip
ODD = [
    None,
    True,
    0,
    -1,
    1e308,
    10**400,
    float("nan"),
    float("inf"),
    "",
    "\0",
    "../../x",
    "9999-12-31",
    "0001-01-01",
    "é\u202e",
    [],
    {},
    [[]],
    [1, 2],
    {"a": 1},
]


def _places(told: object, way: tuple = ()) -> list[tuple]:
    """The ways to all that a document holds."""
    inside = told.items() if isinstance(told, dict) else enumerate(told) if isinstance(told, list) else ()
    return [found for key, value in inside for found in ((*way, key), *_places(value, (*way, key)))]


def answer(dice: random.Random, folder: Path) -> None:
    """A diagnosis.json as another might have written it: what `track` and `plan` make of it."""
    told = json.loads(json.dumps(ANSWER))
    for _ in range(dice.randrange(1, 4)):
        *way, last = dice.choice(_places(told))
        place = told
        for key in way:
            place = place[key]
        if dice.randrange(5) or isinstance(place, list):
            place[last] = deepcopy(dice.choice(ODD))  # else one may come to hold itself
        else:
            del place[last]
        if not _places(told):
            break
    whole = json.dumps(told).encode()
    path, rig = folder / "diagnosis.json", folder / "rig.toml"
    path.write_bytes(whole if dice.randrange(10) else whole[: dice.randrange(len(whole))] + dice.choice(inputs.BYTES))
    rig.write_text(inputs.RIG)
    refused = []
    for ask in (lambda: read_answers([folder]), lambda: opened(folder, None)):
        try:
            ask()
        except inputs.RIGHT as error:
            refused.append(error)
    path.unlink()
    if refused:
        raise refused[0]


def view(dice: random.Random, folder: Path) -> None:
    """A table of results as a page, with words of strangers in it."""
    names = [
        dice.choice(
            ["time", "time", "time", "a.b", "</script><b>", "a [rad]", "robot.chassis_x [m]", "é\x1b[2J", "a.b", "x [<i>]"]
        )
        for _ in range(3)
    ]
    rows = [[f"{0.01 * k:g}" if name == "time" else f"{k % 5}" for name in names] for k in range(8)]
    for _ in range(dice.randrange(4)):
        dice.choice(rows)[dice.randrange(3)] = dice.choice(inputs.WRONG)
    (folder / "x.csv").write_text("\n".join(",".join(row) for row in [names, *rows]) + "\n")
    page = make_page(folder / "x.csv", show=["*"]).read_text("utf-8")
    assert "<b>" not in page and "<i>" not in page, "words of a stranger as elements of a page"


KINDS = {
    "expression": expression,
    "unit": unit,
    "system, read": _file(inputs.MOTOR, ".toml", master.load),
    "rig, read": _file(inputs.RIG, ".toml", load_rig),
    "sweep, read": _file(inputs.SWEEP, ".toml", read_study),
    "table, read": table,
    "answer, read": answer,
    "view": view,
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
