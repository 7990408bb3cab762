"""The power study of the diagnosis: what is hidden, how often it is found, how often something is found in nothing.

    python -m benchmarks.power [--seeds 30] [--none 200] [--pairs 60] [--workers 2] [--only reducer.stribeck ...]
    python -m benchmarks.power --anew          forget the rows of other sources and begin again
    python -m benchmarks.power --draw          only draw and write the document from the rows at hand

Every case is a row in the folder out/power; a case that has its row is not run again, so an interrupted study goes on
where it stopped, and may grow. A folder holds rows of one state of the sources: another state is refused. The end is
docs/power.md with its figures, and docs/power.csv with a line for each case. Seeds are the numbers of the cases: a row
can be repeated.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import tempfile
import time
from pathlib import Path

for threads in ("OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):  # each worker, which inherits them, is busy enough
    os.environ.setdefault(threads, "1")

import numpy as np
import pandas as pd

from selflock.sweep import SweepError, map_runs
from selflock.sweep.store import rows_in
from tests.diagnosis.plant import bench, score
from tests.diagnosis.plant.causes import DRAWS, OUTSIDE, VOCABULARY

ROOT = Path(__file__).parents[1]
ROWS = ROOT / "out" / "power"
DOCS = ROOT / "docs"
STRENGTHS = (1.2, 12.0)  # error without the cause's model over the error with it, drawn evenly in its logarithm
SOURCES = ("selflock.diagnosis", "selflock.fmus", "tests.diagnosis.plant")  # what decides a row


def cases(seeds: int, none: int, pairs: int, only: list[str]) -> list[tuple[tuple[str, ...], int]]:
    """What to hide, and the seed, of every case of the study."""
    kinds = [((name,), seeds) for name in DRAWS if not only or name in only]
    if not only or "none" in only:
        kinds.append(((), none))
    if not only or "pairs" in only:
        kinds.append((("pairs",), pairs))
    # all kinds in step, so that a study stopped early has some of each
    listed = sorted(((seed + 0.5) / count, names, seed) for names, count in kinds for seed in range(count))
    return [(pair(seed) if names == ("pairs",) else names, seed) for _, names, seed in listed]


def pair(seed: int) -> tuple[str, str]:
    """Two effects of the vocabulary."""
    rng = np.random.default_rng([seed, 2])
    return tuple(str(name) for name in rng.choice(VOCABULARY, 2, replace=False))


def one(_, item: dict) -> dict:
    """Hide, diagnose, judge: a row of the study, as one text, for its lists differ from verdict to verdict."""
    from selflock.diagnosis import diagnose

    names, seed = item["hidden"], item["seed"]
    rng = np.random.default_rng([seed, 3])
    target = float(np.exp(rng.uniform(*np.log(STRENGTHS)))) if len(names) < 2 else None
    case = bench.hide(names, seed, target=target)
    row = {"expected": [score.expected(c) for c in case.causes], "strength": case.strengths, "ratio": case.ratios}
    with tempfile.TemporaryDirectory() as folder:
        rig, train, test = case.write(Path(folder))
        began = time.perf_counter()
        try:
            result = score.plain(diagnose(rig, [train], test=[test], out=None, seed=seed))
        except Exception as error:  # no answer is a wrong answer, and its strength counts
            return {"row": json.dumps(row | _no_answer(f"{type(error).__name__}: {error}"))}
        row["seconds"] = round(time.perf_counter() - began, 2)
    return {"row": json.dumps(row | {
        "verdict": result["verdict"], "answers": score.answers(result), "gain": result["gain"],
        "depends_on": result["remainder"]["depends_on"],
        "right": score.right_first(result, case), "all": score.both(result, case),
    })}  # fmt: skip


def _no_answer(reason: str) -> dict:
    return {"verdict": "error", "answers": [reason], "right": False, "all": False}


def collect(listed, workers: int, scheduler: str | None = None) -> None:
    # by the name under which workers find it, not as a part of __main__
    from benchmarks.power import one

    items = [{"hidden": list(names), "seed": seed} for names, seed in listed]
    try:
        map_runs(one, items, folder=ROWS, about={"strengths": STRENGTHS}, columns=dict, sources=SOURCES, growing=True,
                 workers=workers, scheduler=scheduler, progress=True, title=f"{len(items)} cases")  # fmt: skip
    except SweepError as error:
        anew = " To begin again with the sources as they are: --anew." if "sources" in str(error) else ""
        raise SystemExit(f"{error}{anew}") from None


def rows() -> list[dict]:
    """All rows so far; a case that took its worker with it has only its reason."""
    found = []
    for kept in rows_in(ROWS).values():
        row = json.loads(kept["row"]) if kept["status"] == "ok" else {"ratio": [], **_no_answer(kept["reason"])}
        found.append({"hidden": kept["hidden"], "seed": kept["seed"], **row})
    return found


def sources() -> str:
    """Which state of the sources made the rows."""
    about = ROWS / "study.json"
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
    return pd.DataFrame(lines).sort_values(["hidden", "seed"])


def interval(hits: int, n: int) -> tuple[float, float]:
    """95 % interval of a rate (Wilson)."""
    if n == 0:
        return 0.0, 1.0
    z, p = 1.96, hits / n
    middle, half = p + z * z / (2 * n), z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return float((middle - half) / (1 + z * z / n)), float((middle + half) / (1 + z * z / n))


def rate(flags) -> str:
    flags = list(flags)
    low, high = interval(sum(flags), len(flags))
    if not flags:
        return "not run"
    return f"{100 * np.mean(flags):.0f} % ({sum(flags)} of {len(flags)}; {100 * low:.0f} to {100 * high:.0f} %)"


def strong(row: dict) -> bool:
    """Whether mending the cause at least halves the error."""
    return bool(row["ratio"]) and min(row["ratio"]) >= 2.0


def document(found: list[dict]) -> str:
    """docs/power.md."""
    singles = [row for row in found if len(row["hidden"]) == 1 and row["hidden"][0] not in OUTSIDE]
    outside = [row for row in found if len(row["hidden"]) == 1 and row["hidden"][0] in OUTSIDE]
    none = [row for row in found if not row["hidden"]]
    two = [row for row in found if len(row["hidden"]) == 2]
    kept = [row for row in singles if row["right"] and strong(row) and row["gain"]["noise_floor"]]
    lines = [
        "# The power of the diagnosis",
        "",
        "Regenerated by `python -m benchmarks.power`; the plant that hides the causes is tests/diagnosis/plant. "
        "Case by case: [power.csv](power.csv). "
        "Each case is one hidden drive: a 12 s log at 500 Hz to learn from, another to judge by, and the data sheet. "
        "A cause is strong where mending it at least halves the error. Intervals are 95 % (Wilson).",
        "",
        f"Cases here: {len(found)} of the {len(cases(30, 200, 60, []))} of a full study, by the sources {sources()}.",
        "",
        "| asked | target | measured |",
        "|---|---|---|",
        f"| right name first, strong causes | 95 % | {rate(row['right'] for row in singles if strong(row))} |",
        f"| something named although nothing is hidden | ≤ 5 % | {rate(row['verdict'] != 'none' for row in none)} |",
        f"| both of two found, both strong | 80 % | {rate(row['all'] for row in two if strong(row))} |",
        f"| first of two right | | {rate(row['right'] for row in two if strong(row))} |",
        "| outside the vocabulary: `unknown` with the right variable, strong | 90 % "
        f"| {rate(row['right'] for row in outside if strong(row))} |",
    ]
    if kept:
        excess = [row["gain"]["after"] / row["gain"]["noise_floor"] for row in kept]
        lines.append(
            "| error left, over the noise floor (which is what the true model leaves), median and 90 % quantile "
            f"| ≤ 1.3 | {np.median(excess):.2f}, {np.quantile(excess, 0.9):.2f} |"
        )
    lines += [
        "",
        "![power against strength](power_strength.png)",
        "",
        "![confusion](power_confusion.png)",
        "",
        "## Effect by effect",
        "",
        "| hidden | right, strong | right, weaker | instead, strong (times) |",
        "|---|---|---|---|",
    ]
    for name in DRAWS:
        own = [row for row in found if row["hidden"] == [name]]
        wrong = [named(row) for row in own if strong(row) and not row["right"]]
        instead = ", ".join(f"{w} ({wrong.count(w)})" for w in sorted(set(wrong), key=wrong.count, reverse=True)[:4])
        weak = rate(r["right"] for r in own if not strong(r))
        lines.append(f"| {name} | {rate(r['right'] for r in own if strong(r))} | {weak} | {instead} |")
    false = [row for row in none if row["verdict"] != "none"]
    alarms = [named(row, every=True) for row in false]
    lines += [
        "",
        "False alarms named: " + (", ".join(f"{w} ({alarms.count(w)})" for w in sorted(set(alarms))) or "none") + ".",
    ]
    errors = sorted({f"{row['hidden']}, seed {row['seed']}: {row['answers'][0]}" for row in found if row["verdict"] == "error"})
    lines += ["", "Cases without an answer: " + ("; ".join(errors) or "none") + ".", ""]
    extra = DOCS / "power-notes.md"
    if extra.exists():
        lines += [extra.read_text().strip(), ""]
    return "\n".join(lines)


def named(row: dict, every: bool = False) -> str:
    """What was named first, or all that was."""
    return "error" if row["verdict"] == "error" else ", ".join(row["answers"] if every else row["answers"][:1])


def draw(found: list[dict]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    singles = [row for row in found if len(row["hidden"]) <= 1]
    hidden = [*DRAWS, "none"]
    answers = [*[n for n in DRAWS if n not in OUTSIDE], "unknown", "none", "error"]
    matrix = np.zeros((len(hidden), len(answers)))
    for row in singles:
        if row["hidden"] and not strong(row):
            continue
        answer = named(row).split("(")[0]  # without channel or parameter
        if answer in answers:
            matrix[hidden.index((row["hidden"] or ["none"])[0]), answers.index(answer)] += 1
    share = matrix / np.maximum(matrix.sum(1, keepdims=True), 1)
    figure, axes = plt.subplots(figsize=(11, 10.5))
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1)
    for i, j in zip(*np.nonzero(share)):
        color = "white" if share[i, j] > 0.5 else "black"
        axes.text(j, i, f"{100 * share[i, j]:.0f}", ha="center", va="center", fontsize=7, color=color)
    axes.set_xticks(range(len(answers)), answers, rotation=90, fontsize=8)
    axes.set_yticks(range(len(hidden)), hidden, fontsize=8)
    axes.set_xlabel("named first")
    axes.set_ylabel("hidden")
    axes.set_title("Strong causes: named first, % of the cases in a row")
    figure.tight_layout()
    figure.savefig(DOCS / "power_confusion.png", dpi=110)
    plt.close(figure)

    edges = np.array([1.0, 1.25, 1.6, 2.0, 3.0, 5.0, 8.0, 15.0])
    figure, axes = plt.subplots(figsize=(8, 4.8))
    groups = (
        ("vocabulary", VOCABULARY, "C0"),
        ("a wrong parameter", ("parameter",), "C2"),
        ("outside: unknown", OUTSIDE, "C1"),
    )
    for label, names, color in groups:
        own = [row for row in singles if row["hidden"] and row["hidden"][0] in names]
        points = []
        for low, high in zip(edges[:-1], edges[1:]):
            inside = [row["right"] for row in own if row["ratio"] and low <= row["ratio"][0] < high]
            if inside:
                points.append((np.sqrt(low * high), np.mean(inside), *interval(sum(inside), len(inside))))
        if points:
            x, y, lower, upper = np.array(points).T
            axes.errorbar(
                x,
                y,
                [np.maximum(y - lower, 0), np.maximum(upper - y, 0)],
                fmt="o-",
                color=color,
                label=label,
                capsize=2,
            )
    axes.axvline(2.0, color="0.6", lw=1)
    axes.text(2.05, 0.03, "mending halves the error", color="0.4", fontsize=8)
    axes.set(xscale="log", ylim=(0, 1.03), xlabel="error without the true model / error with it", ylabel="right name first")
    axes.set_xticks([1, 1.5, 2, 3, 5, 10], ["1", "1.5", "2", "3", "5", "10"])
    axes.minorticks_off()
    axes.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(DOCS / "power_strength.png", dpi=110)
    plt.close(figure)


def main() -> None:
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=formatter)
    parser.add_argument("--seeds", type=int, default=30, help="cases of each effect")
    parser.add_argument("--none", type=int, default=200, help="cases without any")
    parser.add_argument("--pairs", type=int, default=60, help="cases with two effects")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", nargs="*", default=[], help="names of effects, none, pairs")
    parser.add_argument("--draw", action="store_true", help="run nothing")
    parser.add_argument("--anew", action="store_true", help="forget all rows first")
    parser.add_argument("--scheduler", help="address of a Dask scheduler, instead of workers here")
    chosen = parser.parse_args()
    if chosen.anew:
        shutil.rmtree(ROWS, ignore_errors=True)
    if not chosen.draw:
        collect(cases(chosen.seeds, chosen.none, chosen.pairs, chosen.only), chosen.workers, chosen.scheduler)
    found = rows()
    draw(found)
    table(found).to_csv(DOCS / "power.csv", index=False, float_format="%.4g")
    (DOCS / "power.md").write_text(document(found))
    print(f"{len(found)} cases in {DOCS / 'power.md'}")


if __name__ == "__main__":
    main()
