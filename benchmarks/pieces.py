"""Measured drives in pieces: learned on one piece, judged on the other, with the rig said in other words. The same name?

    python -m benchmarks.pieces [--only lead_screw worm_drive emps xl330]

Each drive of ../shared/data is cut in two by its runs, in time or by its files, both ways; its rig is given as it is, with all
sensors trusted, with what it leaves open begun at half and at twice the value, and with half and twice the smoothing. A rig that
asks for what is asked already is left out. The end is docs/pieces.md. Minutes; the servo (--only xl330) an hour and more.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path

for threads in ("OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

import numpy as np
import pandas as pd
import scipy.io

from benchmarks.cases import rate
from selflock.diagnosis import diagnose
from selflock.diagnosis.errors import DataError

ROOT = Path(__file__).parents[1]
DATA, RIGS, KEPT = ROOT.parent / "shared" / "data", ROOT / "examples" / "rigs", ROOT / "out" / "pieces.json"
AUTHORS = {
    "lead_screw": "reducer stribeck", "worm_drive": "reducer stribeck", "emps": "reducer asymmetric",
    "xl330": "reducer load_dependent",
}  # fmt: skip
SEEN = (
    "- The worm drive's first runs go one way, its last the other: nothing in one piece tells of friction in the other direction.",
    "- Where EMPS is `unknown`, its asymmetry is the first cause of the best model each time, and is not believed because a free function "
    "of one variable explains more: what it leaves goes with the position, a wave that is named beside it elsewhere and here is below "
    "what chance finds. The rule that drops it (`judge.ahead`) has not been changed for this one drive.",
)
Piece = dict[str, pd.DataFrame]  # logs by the names of their files
RANGE = re.compile(r'^"([\w.]+)" = \[([-+\d.e]+), ([-+\d.e]+)\]$', re.MULTILINE)


def of_points(table: pd.DataFrame) -> dict[str, tuple[Piece, Piece]]:
    """Runs at constant speed, a column `run` telling them apart."""
    runs = list(dict.fromkeys(table["run"]))
    of = lambda names: {"log.csv": table[table["run"].isin(names)]}
    part = lambda first: {
        "log.csv": pd.concat(g[: len(g) // 2] if first else g[len(g) // 2 :] for _, g in table.groupby("run", sort=False))
    }
    half = len(runs) // 2
    return {
        "every second run": (of(runs[::2]), of(runs[1::2])),
        "first and last runs": (of(runs[:half]), of(runs[half:])),
        "halves of each run": (part(True), part(False)),
    }


def of_motion(table: pd.DataFrame, pieces: int = 7) -> dict[str, tuple[Piece, Piece]]:
    """One run: its halves; every second of some pieces, each a file."""
    cut = np.array_split(np.arange(len(table)), pieces)
    turns = [{f"piece{i}.csv": table.iloc[rows] for i, rows in enumerate(cut) if i % 2 == side} for side in (0, 1)]
    half = len(table) // 2
    return {
        "halves in time": ({"log.csv": table[:half]}, {"log.csv": table[half:]}),
        f"every second of {pieces} pieces": (turns[0], turns[1]),
    }


def of_files(folder: Path) -> dict[str, tuple[Piece, Piece]]:
    """Logs of several manoeuvres, named after them."""
    logs = {path.name: pd.read_csv(path) for path in sorted(folder.glob("*.csv"))}
    quiet = {name: log for name, log in logs.items() if name.endswith(("lift_and_drop.csv", "up_and_down.csv"))}
    return {"manoeuvres": (quiet, {name: log for name, log in logs.items() if name not in quiet})}


def cuts(drive: str) -> dict[str, tuple[Piece, Piece]]:
    """Pieces of a drive's data, by what they were cut by."""
    if drive == "emps":
        found = scipy.io.loadmat(DATA / drive / "DATA_EMPS.mat")
        return of_motion(pd.DataFrame({name: np.ravel(found[name]) for name in ("t", "qm", "vir", "qg")}))
    return of_files(DATA / drive) if drive == "xl330" else of_points(pd.read_csv(DATA / drive / "steady_state.csv"))


def rigs(text: str) -> Iterator[tuple[str, str]]:
    """The rig as it is, and in other words."""
    rig = tomllib.loads(text)
    yield "as it is", text
    yield "sensors trusted", text.replace("known = [", 'known = ["sensor.*", ', 1)
    for factor in (0.5, 2.0):
        moved = text
        for name, low, high in RANGE.findall(text[text.index("[uncertain]") :]):
            given, low, high = rig["parameters"].get(name), float(low), float(high)
            if given:
                value = min(max(factor * given, low), high)
                moved = re.sub(rf'^"{re.escape(name)}" = [-+\d.e]+$', f'"{name}" = {value:.6g}', moved, flags=re.MULTILINE)
            elif low >= 0.0:
                moved = moved.replace("[parameters]\n", f'[parameters]\n"{name}" = {low + 0.1 * factor * (high - low):.6g}\n', 1)
        yield f"begun at {factor:g} times", moved
    if smoothing := rig["rig"].get("smoothing"):
        for factor in (0.5, 2.0):
            yield (
                f"{factor:g} times the smoothing",
                text.replace(f"smoothing = {smoothing}", f"smoothing = {factor * smoothing:g}"),
            )


def one(text: str, train: Piece, test: Piece) -> dict:
    """What a diagnosis says."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "rig.toml").write_text(text)
        paths = []
        for side, piece in (("train", train), ("test", test)):
            (place / side).mkdir()
            for name, log in piece.items():
                log.to_csv(place / side / name, index=False)
            paths.append(sorted((place / side).glob("*.csv")))
        try:
            found = diagnose(place / "rig.toml", paths[0], test=paths[1], out=None)
        except DataError as error:
            return {"verdict": "refused", "causes": [], "why": str(error).replace(folder, "")}
    told = {"verdict": found.verdict, "causes": [(cause.label, cause.mark) for cause in found.causes]}
    best = [cause.label for cause in found.best.causes] if found.best else []
    return told | {"before": found.gain.before, "after": found.gain.after, "unit": found.gain.unit, "best": best}


def document(rows: list[dict]) -> str:
    """docs/pieces.md."""
    first = lambda row: row["causes"][0][0] if row["causes"] else ""
    lines = [
        "# Measured drives in pieces",
        "",
        "Regenerated by `python -m benchmarks.pieces`. Each measured drive of [measurements.md](measurements.md) is cut in two, learned "
        "on one piece and judged on the other, both ways, with its rig as it is and in other words: all sensors trusted, what it leaves "
        "open begun elsewhere, half and twice the smoothing. What its authors found should be named first each time. Where a piece "
        "cannot tell it, `unknown` is right, and another name is wrong.",
        "",
        "| drive | diagnoses | named as its authors do | `unknown` or `none` | another name |",
        "|---|---|---|---|---|",
    ]
    for drive, wanted in AUTHORS.items():
        mine = [row for row in rows if row["drive"] == drive]
        if mine:
            right, silent = [first(row) == wanted for row in mine], sum(not first(row) for row in mine)
            lines.append(f"| {drive} | {len(mine)} | {rate(right)} | {silent} | {len(mine) - sum(right) - silent} |")
    lines += ["", *SEEN]
    lines += ["", "| drive | cut by | learned on | rig | answer | held-out error |", "|---|---|---|---|---|---|"]
    for row in rows:
        named = ", ".join(f"{label}{' (weak)' if mark == 'weak' else ''}" for label, mark in row["causes"])
        best = f"; best model {', '.join(row['best'])}" if not named and row.get("best") else ""
        error = f"{row['before']:.3g} → {row['after']:.3g} {row['unit']}" if "before" in row else row["why"]
        told = f"| {row['drive']} | {row['cut']} | {row['learned']} | {row['rig']} "
        lines.append(told + f"| {row['verdict']}{': ' + named if named else best} | {error} |")
    return "\n".join([*lines, ""])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", choices=list(AUTHORS), default=["lead_screw", "worm_drive", "emps"])
    chosen = parser.parse_args()
    rows = [row for row in json.loads(KEPT.read_text()) if row["drive"] not in chosen.only] if KEPT.exists() else []
    for drive in chosen.only:
        for cut, pieces in cuts(drive).items():
            for learned, (train, test) in (("first", pieces), ("second", pieces[::-1])):
                for rig, text in rigs((RIGS / f"{drive}.toml").read_text()):
                    rows.append({"drive": drive, "cut": cut, "learned": learned, "rig": rig} | one(text, train, test))
                    print(*rows[-1].values(), sep=" | ", flush=True)
        KEPT.parent.mkdir(exist_ok=True)
        KEPT.write_text(json.dumps(rows))
        (ROOT / "docs" / "pieces.md").write_text(document(rows))


if __name__ == "__main__":
    main()
