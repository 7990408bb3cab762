"""Anybody's models, one after the other: what runs, what is refused and why, and how far from an independent loop it is.

    python -m benchmarks.interoperability ../shared/foreign [-o docs/interoperability.md] [--limit 60]

Every .fmu (or folder of an unpacked one), .ssp, .ssd and OspSystemStructure.xml below the folder is tried, an FMU by each interface that it has, in its default experiment, at most
STEPS communication steps of it. Each runs in a process of its own with a limit of time: a crash is a row. The independent
loop is FMPy's `simulate_fmu` with the same step and, for model exchange, the same tolerance; a difference is the largest of
all outputs at all rows, over the largest value that the output has. Where model exchange differs, both are run once more at
the tolerance TIGHT: what comes of different internal steps alone vanishes with them.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Any

STEPS = 1000
FEW = 20  # of what does not end in time
LIMIT = 60.0  # s
TIGHT = 1e-10
EXACT = "bit by bit"
KINDS = {"cs": "co-simulation", "me": "model exchange", "se": "scheduled execution"}
HEAD = """# Interoperability

What the master does with models that others made: {fmus} FMUs by each of their interfaces, {ssps} system structures. Made by

    python -m benchmarks.interoperability FOLDER

from a folder of models; give it your own. Each ran in a process of its own, in its default experiment, at most {steps}
communication steps of it. *Difference*: from FMPy's own loop with the same step, and for model exchange the same tolerance
({tolerance:g} where the FMU tells no tighter one); the largest of all outputs at all rows, over the output's largest value.

**{ran} of {all} ran**, {same} of the {compared} that FMPy's loop ran, too, bit by bit as there; the others are model
exchange, where each loop chooses its own internal steps: at most {worst:.1g} apart, and with a tolerance of {tight:g} in both
(behind the arrow) at most {tighter:.1g}. A step is the difference of two communication points,
so that it ends at the very number where the next one begins (FMI 2.0, 4.2.2): a model that jumps there jumps in that row.
"""
FMUS = """
## FMUs

| file | exporter | FMI | interface | | difference |
|---|---|---|---|---|---|
"""
SSPS = """
## System structures

| file | SSP | components | |
|---|---|---|---|
"""


# --- in a process of its own -----------------------------------------------------------------------------------------


def fmu(path: Path, way: str, most: int) -> dict[str, Any]:
    """Run an FMU."""
    from dataclasses import replace

    from selflock import master
    from selflock.master.single import single

    system = single(path, interface=way)
    steps = min(most, round((system.run.stop - system.run.start) / system.run.step))
    system.run = replace(system.run, stop=system.run.start + steps * system.run.step)
    result = master.run(system)
    return {"rows": len(result.table), "time": result.time, "ended": result.ended, "notes": result.notes, "_": (system, result)}


def ssp(path: Path, _: str, most: int) -> dict[str, Any]:
    """Run a system structure."""
    from selflock import master

    system = master.load(path)
    steps = min(most, max(1, round((system.run.stop - system.run.start) / system.run.step)))
    result = master.run(system, stop=system.run.start + steps * system.run.step)
    return {"rows": len(result.table), "time": result.time, "ended": result.ended, "notes": result.notes}


def compared(system: Any, result: Any, way: str) -> dict[str, Any]:
    """The largest difference from FMPy's loop."""
    from dataclasses import replace

    import fmpy

    from selflock import master
    from selflock.master.exchange import TOLERANCE
    from selflock.master.reading import read_description

    name, component = next(iter(system.components.items()))
    described, _ = read_description(Path(component.fmu))
    told = float(described.defaultExperiment.tolerance or 0.0) if described.defaultExperiment else 0.0
    tolerance = min(told or TOLERANCE, TOLERANCE) if way == "me" else None

    def theirs_at(tolerance: float | None) -> Any:
        return fmpy.simulate_fmu(
            component.fmu,
            validate=False,
            model_description=described,
            fmi_type={"cs": "CoSimulation", "me": "ModelExchange"}[way],
            start_time=system.run.start,
            stop_time=system.run.stop,
            output_interval=system.run.step,
            relative_tolerance=tolerance,
            record_events=False,
            output=[column.removeprefix(f"{name}.") for column in result.table.columns if column != "time"],
        )

    found = apart(result.table, theirs_at(tolerance), name, system.run.step)
    if way == "me" and not found["same"]:
        system.run = replace(system.run, fmu_tolerance=TIGHT)
        found["tight"] = apart(master.run(system).table, theirs_at(TIGHT), name, system.run.step)["difference"]
    return found


def apart(table: Any, other: Any, name: str, step: float) -> dict[str, Any]:
    """The largest difference of our table from another loop's rows, over the largest value that the output has."""
    import numpy as np

    places = {round(time / step): k for k, time in enumerate(other["time"])}  # the last row of a time is after its event
    rows = [k for k, time in enumerate(table["time"]) if round(time / step) in places]
    theirs = [places[round(table["time"][k] / step)] for k in rows]
    worst, same = 0.0, bool(rows)
    for column in other.dtype.names[1:]:
        if f"{name}.{column}" not in table or other[column].ndim > 1:
            continue
        a, b = table[f"{name}.{column}"].to_numpy(float)[rows], other[column][theirs].astype(float)
        same = same and np.array_equal(a, b)
        worst = max(worst, float(np.abs(a - b).max(initial=0.0) / (np.abs(b).max(initial=0.0) or 1.0)))
    return {"same": same, "difference": worst, "compared": len(rows)}


def one(kind: str, path: Path, way: str, most: int, out: Path) -> None:
    """Run it and write what came of it to `out`, first without, then with the comparison."""
    from selflock.fmus.errors import SelflockError

    told: dict[str, Any] = {}
    try:
        told = {"fmu": fmu, "ssp": ssp}[kind](path, way, most)
    except SelflockError as error:
        told = {"refused": str(error), "kind": type(error).__name__}
    system, result = told.pop("_", (None, None))
    out.write_text(json.dumps(told))
    if result is not None and way != "se":
        try:
            told |= compared(system, result, way)
        except Exception as error:  # whatever FMPy meets
            told["loop"] = f"{type(error).__name__}: {error}"
        out.write_text(json.dumps(told))


# --- all of them -----------------------------------------------------------------------------------------------------


def tried(kind: str, path: Path, way: str, limit: float, most: int = STEPS) -> dict[str, Any]:
    """What came of it in a process of its own; of what takes too long, of its first steps."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "told.json"
        command = [sys.executable, "-m", "benchmarks.interoperability", "--one", kind, str(path), way, str(most), str(out)]
        try:
            done = subprocess.run(command, cwd=folder_of_project(), capture_output=True, timeout=limit)
            ending = "" if done.returncode == 0 else f"its process ended with {done.returncode}"
        except subprocess.TimeoutExpired:
            if most > FEW and not out.is_file():
                return tried(kind, path, way, limit, FEW) | {"few": True}
            ending = f"not done after {limit:g} s"
        told = json.loads(out.read_text()) if out.is_file() and out.read_text() else {"broken": ending or "nothing was told"}
        if ending and "rows" in told:
            told["loop"] = f"FMPy: {ending}"
        return told


def folder_of_project() -> Path:
    return Path(__file__).parents[1]


def described(path: Path) -> tuple[str, str, list[str]]:
    """Exporter, version of FMI and interfaces of an FMU, by its description."""
    from selflock.master.described import offered
    from selflock.master.reading import read_description

    try:
        told, _ = read_description(path)
    except Exception:
        return "", "", [""]
    return told.generationTool or "", told.fmiVersion or "", list(offered(told)) or [""]


def sentence(text: str, folder: Path) -> str:
    """One line of a message, without where it was run."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    said = " ".join(lines[:3]) if lines and " answered " in lines[0] else lines[0] if lines else ""
    for known in sorted({str(folder), str(folder.resolve()), tempfile.gettempdir()}, key=len, reverse=True):
        said = said.replace(f"{known}/", "")
    return cell(re.sub(r"(selflock_ssp_|\btmp)\w+/(files/)?", "", said), 300)


def cell(text: Any, width: int = 60) -> str:
    """A text in a table of Markdown."""
    words = " ".join(str(text).split())
    words = words if len(words) <= width else f"{words[: width - 1]}…"
    for sign in "\\|*_`<>[]":
        words = words.replace(sign, f"\\{sign}" if sign not in "<>" else {"<": "&lt;", ">": "&gt;"}[sign])
    return words


def outcome(told: dict[str, Any], folder: Path) -> str:
    if "rows" in told:
        ended = "".join(f", ended itself at t = {time:.6g} s" for time in told["ended"].values())
        return f"ran{', its first steps' if 'few' in told else ''}{ended}"
    return sentence(told.get("refused") or told["broken"], folder)


def difference(told: dict[str, Any], folder: Path) -> str:
    if "same" in told:
        if told["same"] or not told["compared"]:
            return EXACT if told["same"] else "no row in common"
        return f"{told['difference']:.1e}" + (f" → {told['tight']:.0e}" if "tight" in told else "")
    return sentence(told["loop"], folder)[:80] if "loop" in told else ""


def report(folder: Path, limit: float) -> str:
    """The page."""
    from selflock.master.exchange import TOLERANCE
    from selflock.master.osp import FILE
    from selflock.master.single import of_one

    known = (".fmu", ".ssp", ".ssd")
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in known or path.name == FILE or of_one(path))
    paths = [path for path in paths if not any(of_one(above) for above in path.parents)]
    fmus, ssps = ([path for path in paths if of_one(path) == own] for own in (True, False))
    first, second, found = [], [], []
    for path in fmus:
        exporter, version, ways = described(path)
        for way in ways:
            told = tried("fmu", path, way, limit)
            found.append((way, told))
            print(f"{path.name} {way}: {outcome(told, folder)[:100]} {difference(told, folder)}", file=sys.stderr)
            words = cell(path.relative_to(folder)), cell(exporter, 40), version, KINDS.get(way, "")
            first.append(f"| {' | '.join((*words, outcome(told, folder), difference(told, folder)))} |")
    for path in ssps:
        told = tried("ssp", path, "", limit)
        found.append(("", told))
        print(f"{path.name}: {outcome(told, folder)[:100]}", file=sys.stderr)
        second.append(f"| {cell(path.relative_to(folder), 80)} | {' | '.join(structure(path))} | {outcome(told, folder)} |")
    both = [told for _, told in found if "same" in told]
    head = HEAD.format(
        fmus=len(fmus),
        ssps=len(ssps),
        steps=STEPS,
        tolerance=TOLERANCE,
        ran=sum("rows" in told for _, told in found),
        all=len(found),
        compared=len(both),
        same=sum(told["same"] for told in both),
        worst=max((told["difference"] for way, told in found if way == "me" and "same" in told), default=0.0),
        tight=TIGHT,
        tighter=max((told["tight"] for _, told in found if "tight" in told), default=0.0),
    )
    return head + FMUS + "\n".join(first) + "\n" + SSPS + "\n".join(second) + "\n"


def structure(path: Path) -> tuple[str, str]:
    """The version of a system structure, and how many components it has."""
    from selflock import master

    try:
        if path.suffix.lower() == ".ssd":
            text = path.read_text(encoding="utf-8", errors="replace")
        else:
            with zipfile.ZipFile(path) as archive:
                name = next(name for name in archive.namelist() if name.endswith(".ssd"))
                text = archive.read(name).decode("utf-8", "replace")
        version = re.search(r"SystemStructureDescription[^>]*\sversion=\"([^\"]*)\"", text)
        said = version[1] if version else ""
    except (OSError, StopIteration, zipfile.BadZipFile):
        said = ""
    try:
        return cell(said), str(len(master.load(path).components))
    except Exception:
        return cell(said), ""


def main() -> None:
    if sys.argv[1:2] == ["--one"]:
        return one(sys.argv[2], Path(sys.argv[3]), sys.argv[4], int(sys.argv[5]), Path(sys.argv[6]))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--out", type=Path, default=folder_of_project() / "docs" / "interoperability.md")
    parser.add_argument("--limit", type=float, default=LIMIT, help="s for each")
    given = parser.parse_args()
    given.out.write_text(report(given.folder.resolve(), given.limit), encoding="utf-8")
    print(given.out)


if __name__ == "__main__":
    main()
