"""The power study under real recording: each hidden drive has laws of its own forms and a recorder drawn at random.

    python -m benchmarks.recordings [--seeds 30] [--none 200] [--faults 60] [--pairs 60] [--only reducer.stribeck none ...]
    python -m benchmarks.recordings --judge    on the seeds that judge, 0 …; without it on those for development, 10 000 …
    python -m benchmarks.recordings --draw     only write the document from the rows at hand

As benchmarks.power, whose code it shares: a row for each case, kept in out/recordings; what is there is not run again.
No rule may be chosen on the seeds that judge: they are run when all is done, on one state of the sources, in one go.
--longest 30 makes a quick look at short logs. The end is docs/recordings.md, and docs/recordings.csv case by case.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import tempfile
import time
from pathlib import Path

for threads in ("OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):  # each worker, which inherits them, is busy enough
    os.environ.setdefault(threads, "1")

import numpy as np
import pandas as pd

from benchmarks.cases import (
    answered,
    arguments,
    by_effect,
    collect,
    confidence_table,
    counted,
    in_step,
    named,
    no_answer,
    pair,
    rate,
    rows,
    sources,
    strong,
    table,
    unanswered,
    wanted,
)
from tests.diagnosis.plant import recordings, score
from tests.diagnosis.plant.forms import told
from tests.diagnosis.plant.outside import BEYOND
from tests.diagnosis.plant.rig import COLUMNS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
STRENGTHS = (1.2, 12.0)
FULL = dict(seeds=30, none=200, pairs=60, faults=60)


def cases(seeds: int, none: int, pairs: int, faults: int, only: list[str], first: int = 0) -> list[tuple[tuple[str, ...], int]]:
    """What to hide, and the number from `first` on, of every case; ("faults",) is a sound drive behind a faulty recording."""
    kinds = [((name,), seeds) for name in recordings.DRAWS]
    kinds += [(("none",), none), (("faults",), faults), (("pairs",), pairs)]
    listed = in_step([(names, count) for names, count in kinds if count and (not only or names[0] in only)])
    return [(names, first + number) for names, number in listed]


def item(names: tuple[str, ...], number: int, judge: bool, longest: float) -> dict:
    """A case as plain data."""
    seed = number if judge else recordings.DEVELOPMENT + number
    hidden = pair(seed) if names == ("pairs",) else () if names[0] in ("none", "faults") else names
    return {"hidden": list(hidden), "seed": seed, "faulty": names == ("faults",), "longest": longest}


def hide(item: dict) -> recordings.Recording:
    """The case of an item."""
    names, seed, longest = item["hidden"], item["seed"], item["longest"]
    target = wanted(seed, names, STRENGTHS)
    return recordings.hide(names, seed, target, item["faulty"], longest=longest or np.inf)


def one(_, item: dict) -> dict:
    """Hide, diagnose, judge: a row of the study, as one text."""
    from selflock.diagnosis import diagnose

    case = hide(item)
    recorder = case.recorder
    row = {
        "expected": [score.expected(c) for c in case.causes], "strength": case.strengths, "ratio": case.ratios,
        "forms": case.forms, "floor": case.floor, "off": case.off, "nature": told(case.truth),
        "duration": recorder.duration, "step": recorder.step, "control": recorder.control, "channels": recorder.channels,
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        rig, train, test = case.write(Path(folder))
        began = time.process_time()
        try:
            result = score.plain(diagnose(rig, [train], test=[test], out=None, seed=case.seed))
        except Exception as error:
            return {"row": json.dumps(row | no_answer(f"{type(error).__name__}: {error}"))}
        row["seconds"] = round(time.process_time() - began, 2)
        row |= answered(result, case)
        row["confidence"] = score.believed(result, case)
        row["faults"] = score.fault_rows(result, case.placed or [], "train")
    return {"row": json.dumps(row)}


def kind(row: dict) -> str:
    """single | outside | pair | none | faults"""
    if not row["hidden"]:
        return "faults" if row["faulty"] else "none"
    return "pair" if len(row["hidden"]) == 2 else "outside" if row["hidden"][0] in BEYOND else "single"


def left(row: dict) -> tuple[float, float]:
    """Error of the log that judges, of the channel that the answer mends most (of the one that is off most where it names nothing),
    over the true model's: without the answer, and with it; no numbers where parts were compared.

    Both are of the whole drive, simulated from its set-points and read through a recorder: the product's through the one that it
    found, the true drive's through the one that there was.
    """
    gain = row.get("gain") or {"metric": ""}
    told = re.search(r" of (\S+) \(whole ", gain["metric"])
    name = next((name for name, (signal, _) in COLUMNS.items() if told and signal == told[1]), "")
    if name == "motor_angle" and "twist" in row["floor"]:  # compared by the wind-up beside the load's angle
        name = "twist"
    floor = row["floor"].get(name, np.nan)
    return (gain["before"] / floor, gain["after"] / floor) if np.isfinite(floor) else (np.nan, np.nan)


def _middle(values: list[float]) -> str:
    values = [value for value in values if np.isfinite(value)]
    return f"{np.median(values):.2f}, {np.quantile(values, 0.9):.2f}" if values else "not run"


def headline(found: list[dict]) -> list[str]:
    """The table of targets."""
    of = {name: [row for row in found if kind(row) == name] for name in ("single", "outside", "pair", "none", "faults")}
    mended = [left(row) for row in of["single"] if strong(row) and row["right"]]
    named_one = [flag for row in found if row["verdict"] != "error" for flag in row["confidence"]]
    seconds = [row["seconds"] for row in found if "seconds" in row]
    sound = [left(row)[0] for row in of["none"] if row["verdict"] != "error"]
    return [
        "| asked | target | measured |",
        "|---|---|---|",
        f"| right name first, strong causes | 95 % | {rate(row['right'] for row in of['single'] if strong(row))} |",
        f"| a name or `unknown` although nothing is hidden | ≤ 5 % | {rate(row['verdict'] != 'none' for row in of['none'])} |",
        f"| the same behind a faulty recording | ≤ 5 % | {rate(row['verdict'] != 'none' for row in of['faults'])} |",
        f"| both of two found, both strong | 80 % | {rate(row['all'] for row in of['pair'] if strong(row))} |",
        f"| first of two right | | {rate(row['right'] for row in of['pair'] if strong(row))} |",
        f"| outside the vocabulary: `unknown` with the right variable, strong | 90 % | {rate(row['right'] for row in of['outside'] if strong(row))} |",
        f"| error left of the log that judges, over the true model's, where the answer mends most, right answers, median and 90 % quantile | ≤ 1.3 | {_middle([b for _, b in mended])} |",
        f"| the same with nothing named, of these cases | | {_middle([a for a, _ in mended])} |",
        f"| the same with nothing hidden | | {_middle(sound)} |",
        f"| of all that was named, what is there | | {rate(right for _, right in named_one)} |",
        f"| seconds of processor a case, median and 90 % quantile | 90 | {_middle(seconds)} |",
    ]


def summary(found: list[dict]) -> str:
    """The headline, in a sentence."""
    singles = [row["right"] for row in found if kind(row) == "single" and strong(row)]
    sound = [row["verdict"] == "none" for row in found if not row["hidden"]]
    return (
        f"Of {len(singles)} strong causes {sum(singles)} are named first; of {len(sound)} drives without any, "
        f"{sum(sound)} are said to have none."
    )


def faults_table(found: list[dict]) -> list[str]:
    """Rows of faults, by kind, over the cases with a faulty recording; and what was told in sound ones."""
    lines = [
        "| kind | rows placed | of these told (target 95 %) | rows told | of these placed (target 95 %) | told in sound recordings |"
    ]
    lines.append("|---|---|---|---|---|---|")
    answered = [row for row in found if row["verdict"] != "error"]
    kinds = sorted({name for row in answered for name in row["faults"]})
    share = lambda hits, n: f"{100 * hits / n:.0f} %" if n else "–"
    for name in kinds:
        spoilt = np.sum([row["faults"].get(name, [0] * 4) for row in answered if row["faulty"]] or [[0] * 4], axis=0)
        sound = sum(row["faults"].get(name, [0] * 4)[2] for row in answered if not row["faulty"])
        placed, told, said, true = map(int, spoilt)
        lines.append(f"| {name} | {placed} | {share(told, placed)} | {said} | {share(true, said)} | {sound} |")
    return lines


def document(found: list[dict], judged: bool, folder: Path) -> str:
    """docs/recordings.md."""
    full = len(cases(**FULL, only=[]))
    seeds = "the seeds that judge (0 …)" if judged else f"seeds for development ({recordings.DEVELOPMENT} …)"
    longest = {row["longest"] for row in found if row["longest"]}
    short = f" Logs end at {max(longest):g} s: a quick look." if longest else ""
    alarms = [named(row, every=True) for row in found if kind(row) == "none" and row["verdict"] != "none"]
    spoilt = [named(row, every=True) for row in found if kind(row) == "faults" and row["verdict"] != "none"]
    lines = [
        "# The diagnosis under real recording",
        "",
        "Regenerated by `python -m benchmarks.recordings`; case by case: [recordings.csv](recordings.csv). The old study, of one "
        "recorder, is [power.md](power.md). Each case is a hidden drive whose friction, contact and armature have forms of "
        "their own (tests/diagnosis/plant/forms.py) behind a recorder drawn at random (recorder.py there): a controller that "
        "is continuous or runs at 0.2 to 20 kHz, rows at 200 Hz to 2 kHz, regular or not, encoders of 500 to 20 000 counts, "
        "speeds by difference, tacho or filter, channels up to 2 ms late, noise on all of them, 10 to 300 s; sometimes no "
        "current, no output torque, no second angle. The rig says which column is what, and the period of a controller that is "
        "slower than the log. A cause is strong where mending it at least halves the error that the whole drive, simulated "
        "from its set-points and read through the same recorder, leaves of the log. Intervals are 95 % (Wilson).",
        "",
        "**No rule may be chosen on the seeds that judge.** They are run when everything is done, in one go, on one state of the "
        "sources. Rules are made and tried on seeds from 10 000 on.",
        "",
        f"Here: {len(found)} cases of the {full} of a full study, on {seeds}, by the sources {sources(folder)}.{short}",
        "",
        f"**{summary(found)}**",
        "",
        *headline(found),
        "",
        *by_effect(found, recordings.DRAWS),
        "",
        "Named although nothing is hidden: " + (counted(alarms) or "none") + ".",
        "",
        "The same behind a faulty recording: " + (counted(spoilt) or "none") + ".",
        "",
        unanswered(found),
        "",
        "## Faults, row by row",
        "",
        *faults_table(found),
        "",
        "## Confidence",
        "",
        *confidence_table([flag for row in found if row["verdict"] != "error" for flag in row["confidence"]]),
        "",
    ]
    extra = DOCS / "recordings-notes.md"
    if extra.exists():
        lines += [extra.read_text().strip(), ""]
    return "\n".join(lines)


def lines(found: list[dict]) -> pd.DataFrame:
    """docs/recordings.csv: the old study's columns and the recorder's."""
    found = sorted(found, key=lambda row: (" + ".join(row["hidden"]) or "none", row["seed"], row["faulty"]))
    more = [
        {"faulty": row["faulty"], "duration": row.get("duration"), "step": row.get("step"), "control": row.get("control"),
         "channels": " ".join(row.get("channels", [])), "forms": row.get("forms"), "seconds": row.get("seconds"),
         "left": left(row)[1]}
        for row in found
    ]  # fmt: skip
    return pd.concat([table(found).reset_index(drop=True), pd.DataFrame(more)], axis=1)


def main() -> None:
    parser = arguments(__doc__, FULL["seeds"], FULL["none"], FULL["pairs"])
    parser.add_argument("--faults", type=int, default=FULL["faults"], help="cases with faults in the recording alone")
    parser.add_argument("--judge", action="store_true", help="the seeds on which no rule may be chosen")
    parser.add_argument(
        "--first", type=int, default=0, help="number of the first seed, so that development can go on on new ones"
    )
    parser.add_argument("--longest", type=float, default=0.0, help="s at which logs end, for a quick look")
    chosen = parser.parse_args()
    folder = ROOT / "out" / "recordings" / ("judging" if chosen.judge else "development")
    if chosen.anew:
        shutil.rmtree(folder, ignore_errors=True)
    if not chosen.draw:
        from benchmarks.recordings import one  # by the name under which workers find it, not as a part of __main__

        listed = cases(chosen.seeds, chosen.none, chosen.pairs, chosen.faults, chosen.only, chosen.first)
        print(f"{len(listed)} cases on {'seeds that judge' if chosen.judge else 'seeds for development'}", flush=True)
        items = [item(names, number, chosen.judge, chosen.longest) for names, number in listed]
        collect(one, items, folder, {"strengths": STRENGTHS}, chosen.workers, chosen.scheduler)
    found = rows(folder)
    lines(found).to_csv(DOCS / "recordings.csv", index=False, float_format="%.4g")
    (DOCS / "recordings.md").write_text(document(found, chosen.judge, folder))
    print(f"{len(found)} cases in {DOCS / 'recordings.md'}")


if __name__ == "__main__":
    main()
