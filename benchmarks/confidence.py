"""Is a cause's confidence what it says? Of causes that are named with a confidence c, a share c should be there.

    python -m benchmarks.confidence [--first 50000] [--each 2] [--none 10] [--strengths 1.05 2.0]
    python -m benchmarks.confidence --draw        only the table and the picture, from the rows at hand

Strong causes are named with a confidence of nearly 1; so causes of the power study's plant are hidden here so weakly that they
raise the error 1.05 to 2 times, on seeds of their own. A row for each cause that was named, in docs/confidence.csv, each as it
comes: what was asked there is not asked again. The picture is docs/confidence.png.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.cases import SURE, confidence_table, in_step, interval, wanted
from tests.diagnosis.plant import bench, score
from tests.diagnosis.plant.causes import DRAWS

DOCS = Path(__file__).parents[1] / "docs"
ROWS = DOCS / "confidence.csv"
COLUMNS = ("hidden", "seed", "ratio", "verdict", "cause", "confidence", "there")


def one(names: tuple[str, ...], seed: int, strengths: tuple[float, float]) -> list[dict]:
    """A row for each cause that is named of a hidden drive; one without a cause where none is."""
    from selflock.diagnosis import diagnose

    case = bench.hide(list(names), seed, target=wanted(seed, list(names), strengths))
    with tempfile.TemporaryDirectory() as folder:
        rig, train, test = case.write(Path(folder))
        result = score.plain(diagnose(rig, [train], test=[test], out=None, seed=seed))
    of = {"hidden": " ".join(names) or "none", "seed": seed, "ratio": f"{max(case.ratios, default=1.0):.3f}"}
    of["verdict"] = result["verdict"]
    named = score.believed(result, case)
    rows = [of | {"cause": name, "confidence": c, "there": there} for name, (c, there) in zip(score.answers(result), named)]
    return rows or [of]


def asked(each: int, none: int, first: int) -> list[tuple[tuple[str, ...], int]]:
    """What to hide, and the seed, in turns: what is not run for want of time is of all kinds alike."""
    listed = in_step([((name,), each) for name in DRAWS] + [((), none)])
    return [(names, first + place) for place, (names, _) in enumerate(listed)]


def read() -> list[dict]:
    """The rows at hand."""
    with ROWS.open(newline="") as file:
        return list(csv.DictReader(file))


def believed(rows: list[dict]) -> list[tuple[float, bool]]:
    """Confidence of each cause named, and whether it is there."""
    return [(float(row["confidence"]), row["there"] == "True") for row in rows if row["confidence"]]


def draw(named: list[tuple[float, bool]]) -> Path:
    """Share that is there over confidence, with its 95 % interval, beside the line on which both are the same."""
    from selflock.diagnosis.output.figures import AFTER, MEASURED, save, styled, subplots

    @styled
    def picture() -> Path:
        figure, axes = subplots(figsize=(5.2, 4.6))
        axes.plot([0, 1], [0, 1], color=MEASURED, lw=1.0, ls="--", label="as said")
        for low, high in zip(SURE[:-1], SURE[1:]):
            here = [(c, right) for c, right in named if low <= c < high]
            if not here:
                continue
            mean, hits = float(np.mean([c for c, _ in here])), sum(right for _, right in here)
            ends = interval(hits, len(here))
            share = hits / len(here)
            axes.errorbar(mean, share, [[share - ends[0]], [ends[1] - share]], fmt="o", color=AFTER, capsize=3)
            axes.annotate(f"{hits}/{len(here)}", (mean, ends[0]), (0, -14), textcoords="offset points", ha="center", fontsize=9)
        axes.set(xlim=(0, 1.08), ylim=(0, 1.04), xlabel="confidence that was told, mean", ylabel="share that is there")
        axes.legend(loc="upper left")
        return save(figure, DOCS / "confidence.png")

    return picture()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=50_000, help="the first seed; those below 10 000 judge the power study")
    parser.add_argument("--each", type=int, default=2, help="cases of each cause")
    parser.add_argument("--none", type=int, default=10, help="sound drives")
    parser.add_argument("--strengths", type=float, nargs=2, default=(1.05, 2.0), help="times that a cause raises the error")
    parser.add_argument("--draw", action="store_true")
    given = parser.parse_args()
    there = {(row["hidden"], int(row["seed"])) for row in read()} if ROWS.exists() else set()
    for names, seed in [] if given.draw else asked(given.each, given.none, given.first):
        if (" ".join(names) or "none", seed) in there:
            continue
        new = not ROWS.exists()
        rows = one(names, seed, tuple(given.strengths))
        with ROWS.open("a", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            if new:
                writer.writeheader()
            writer.writerows(rows)
        print(*rows, sep="\n", flush=True)
    named = believed(read())
    print(*confidence_table(named), sep="\n")
    print(draw(named))


if __name__ == "__main__":
    main()
