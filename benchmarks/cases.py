"""What the studies of hidden causes share: cases in step, rows kept as they come, rates with intervals, tables."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from selflock.sweep import SweepError, map_runs
from selflock.sweep.store import rows_in
from tests.diagnosis.plant import score
from tests.diagnosis.plant.causes import VOCABULARY

SOURCES = ("selflock.diagnosis", "selflock.fmus", "tests.diagnosis.plant")  # what decides a row
Names = tuple[str, ...]

SURE = (0.0, 0.5, 0.8, 0.95, 1.0001)  # edges of confidences


def in_step(kinds: list[tuple[Names, int]]) -> list[tuple[Names, int]]:
    """Names and number of each case, all kinds in step, so that a study stopped early has some of each."""
    listed = sorted(((number + 0.5) / count, names, number) for names, count in kinds for number in range(count))
    return [(names, number) for _, names, number in listed]


def pair(seed: int) -> tuple[str, str]:
    """Two effects of the vocabulary."""
    rng = np.random.default_rng([seed, 2])
    return tuple(str(name) for name in rng.choice(VOCABULARY, 2, replace=False))


def wanted(seed: int, names: list[str], strengths: tuple[float, float]) -> float | None:
    """How strongly a single cause is hidden; two are both strong."""
    rng = np.random.default_rng([seed, 3])
    return float(np.exp(rng.uniform(*np.log(strengths)))) if len(names) < 2 else None


def answered(result: dict, case) -> dict:
    """What a row says of an answer."""
    return {
        "verdict": result["verdict"], "answers": score.answers(result), "gain": result["gain"],
        "depends_on": result["remainder"]["depends_on"],
        "right": score.right_first(result, case), "all": score.both(result, case),
    }  # fmt: skip


def no_answer(reason: str) -> dict:
    """No answer is a wrong answer, and its strength counts."""
    return {"verdict": "error", "answers": [reason], "right": False, "all": False}


def collect(
    one: Callable, items: list[dict], folder: Path, about: dict, workers: int | None, scheduler: str | None = None
) -> None:
    """A row of each item in the folder; those that are there are not run again."""
    try:
        map_runs(
            one,
            items,
            folder=folder,
            about=about,
            columns=dict,
            sources=SOURCES,
            growing=True,
            workers=workers,
            scheduler=scheduler,
            progress=True,
            title=f"{len(items)} cases",
        )
    except SweepError as error:
        anew = " To begin again with the sources as they are: --anew." if "sources" in str(error) else ""
        raise SystemExit(f"{error}{anew}") from None


def rows(folder: Path) -> list[dict]:
    """All rows so far; a case that took its worker with it has only its reason."""
    found = []
    for kept in rows_in(folder).values():
        row = json.loads(kept["row"]) if kept["status"] == "ok" else {"ratio": [], **no_answer(kept["reason"])}
        found.append({name: value for name, value in kept.items() if name not in ("row", "key", "status", "reason")} | row)
    return found


def sources(folder: Path) -> str:
    """Which state of the sources made the rows."""
    about = folder / "study.json"
    return json.loads(about.read_text())["sources"]["sources"] if about.exists() else "unknown"


def table(found: list[dict]) -> pd.DataFrame:
    """A line for each case: what was hidden at which strength, what was answered, errors before and after."""
    gain = lambda row, key: row.get("gain", {}).get(key, np.nan)
    lines = [
        {"hidden": " + ".join(row["hidden"]) or "none", "seed": row["seed"], "ratio": min(row["ratio"], default=np.nan),
         "expected": "; ".join(map(str, row.get("expected", []))), "verdict": row["verdict"], "answers": "; ".join(row["answers"]),
         "right": row["right"], "all": row["all"], "depends_on": "; ".join(row.get("depends_on", [])),
         "before": gain(row, "before"), "after": gain(row, "after"), "noise_floor": gain(row, "noise_floor")}
        for row in found
    ]  # fmt: skip
    return pd.DataFrame(lines).sort_values(["hidden", "seed"], kind="stable")


def interval(hits: int, n: int) -> tuple[float, float]:
    """95 % interval of a rate (Wilson)."""
    if n == 0:
        return 0.0, 1.0
    z, p = 1.96, hits / n
    middle, half = p + z * z / (2 * n), z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    low, high = (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)
    return max(0.0, float(low)), min(1.0, float(high))  # none of so many is 0 but for its last digit


def rate(flags: Iterable[bool]) -> str:
    """A share in words, with its interval."""
    flags = list(flags)
    low, high = interval(sum(flags), len(flags))
    if not flags:
        return "not run"
    return f"{100 * np.mean(flags):.0f} % ({sum(flags)} of {len(flags)}; {100 * low:.0f} to {100 * high:.0f} %)"


def confidence_table(believed: list[tuple[float, bool]]) -> list[str]:
    """Of causes named with a confidence, the share that is there: calibrated where they agree within 5 %."""
    lines = ["| confidence | named | mean confidence | there |", "|---|---|---|---|"]
    for low, high in zip(SURE[:-1], SURE[1:]):
        here = [(c, right) for c, right in believed if low <= c < high]
        mean = f"{np.mean([c for c, _ in here]):.2f}" if here else "–"
        lines.append(f"| {low:g} to {min(high, 1.0):g} | {len(here)} | {mean} | {rate(right for _, right in here)} |")
    return lines


def strong(row: dict) -> bool:
    """Whether mending the cause at least halves the error."""
    return bool(row["ratio"]) and min(row["ratio"]) >= 2.0


def named(row: dict, every: bool = False) -> str:
    """What was named first, or all that was."""
    return "error" if row["verdict"] == "error" else ", ".join(row["answers"] if every else row["answers"][:1])


def counted(answers: list[str], most: int | None = None) -> str:
    """Answers and how often each was given, the most frequent first."""
    return ", ".join(f"{w} ({answers.count(w)})" for w in sorted(sorted(set(answers)), key=answers.count, reverse=True)[:most])


def by_effect(found: list[dict], names: Iterable[str]) -> list[str]:
    """The table of single causes."""
    lines = [
        "## Effect by effect",
        "",
        "| hidden | right, strong | right, weaker | instead, strong (times) |",
        "|---|---|---|---|",
    ]
    for name in names:
        own = [row for row in found if row["hidden"] == [name]]
        wrong = [named(row) for row in own if strong(row) and not row["right"]]
        weak = rate(r["right"] for r in own if not strong(r))
        lines.append(f"| {name} | {rate(r['right'] for r in own if strong(r))} | {weak} | {counted(wrong, 4)} |")
    return lines


def unanswered(found: list[dict]) -> str:
    """The cases without an answer, and why."""
    errors = sorted({f"{row['hidden']}, seed {row['seed']}: {row['answers'][0]}" for row in found if row["verdict"] == "error"})
    return "Cases without an answer: " + ("; ".join(errors) or "none") + "."


def arguments(doc: str, seeds: int = 30, none: int = 200, pairs: int = 60) -> argparse.ArgumentParser:
    """The options that the studies have in common."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=seeds, help="cases of each effect")
    parser.add_argument("--none", type=int, default=none, help="cases without any")
    parser.add_argument("--pairs", type=int, default=pairs, help="cases with two effects")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", nargs="*", default=[], help="names of effects, none, pairs")
    parser.add_argument("--draw", action="store_true", help="run nothing")
    parser.add_argument("--anew", action="store_true", help="forget all rows first")
    parser.add_argument("--scheduler", help="address of a Dask scheduler, instead of workers here")
    return parser
