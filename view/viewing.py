"""From results to their page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from selflock.master import Result, load
from selflock.master.about import of_system
from selflock.master.errors import ResultError

from . import page, shown, stages
from .alike import alike, told_alike
from .sheet import sheet

RUNS = 8  # over each other


def view(
    results: str | Path | Result | Sequence[str | Path | Result],
    out: str | Path | None = None,
    system: str | Path | None = None,
    show: Iterable[str] = (),
) -> Path:
    """Write a page of one or more results: files (.csv, .parquet), or what `run` gave. Gives its path.

    out: the page; beside the first file with the ending .html when not given. system: the file of the system that was
    run, for results that do not say themselves what limits and lengths are (.csv). show: names of the columns drawn at
    first, with * and ? as wildcards. Raises ResultError.
    """
    given: list[str | Path | Result] = [results] if isinstance(results, (str, Path, Result)) else list(results)
    if not given:
        raise ResultError("Name a result file, .csv or .parquet, to see it.")
    if len(given) > RUNS:
        raise ResultError(f"{len(given)} results are too many over each other; {RUNS} at most.")
    sources = [one if isinstance(one, Result) else Path(one) for one in given]
    tables = [sheet(one, label) for one, label in zip(sources, _labels(sources))]
    if system is not None:
        described = load(system)
        for one in tables:
            one.about = one.about or of_system(described, one.variables())
    path = _out(sources, out)
    rows, reached, seen = shown.peaks(tables)
    tables, scales = alike(tables)
    told_alike(rows, scales)
    runs, notes = shown.runs_of(tables)
    moving, said = stages.stages(tables)
    data = {"runs": runs, "stages": moving, "picked": shown.picked(tables, seen, show)}
    known = {"name": tables[0].about.get("system")} if isinstance(tables[0].about.get("system"), str) else {}
    return page.write(
        path,
        page.environment("selflock.view"),
        "view.html.j2",
        data,
        title=known.get("name") or tables[0].label,
        runs=[{"label": one.label, "rows": len(one.time), "columns": len(one.columns), "begin": float(one.time[0]), "end": float(one.time[-1])} for one in tables],
        rows=rows,
        reached=reached,
        notes=list(dict.fromkeys([*(note for one in tables for note in one.notes), *said, *notes])),
        limits=any(one.about for one in tables),
    )  # fmt: skip


def _labels(sources: list[Path | Result]) -> list[str]:
    """File names; with their folders where two are called alike, with numbers where these are, too."""
    paths = [one.path or Path(one.system) if isinstance(one, Result) else one for one in sources]
    names = [path.name for path in paths]
    names = [name if names.count(name) == 1 else f"{path.parent.name}/{name}" for name, path in zip(names, paths)]
    return [name if names.count(name) == 1 else f"{name} ({k})" for k, name in enumerate(names, 1)]


def _out(sources: list[Path | Result], out: str | Path | None) -> Path:
    if out is None:
        first = sources[0]
        out = (first.path or Path(f"{first.system}.csv") if isinstance(first, Result) else first).with_suffix(".html")
    return checked(Path(out))


def checked(path: Path) -> Path:
    """The path of a page. Raises ResultError where its ending is another."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise ResultError(f"{path}: the page is an .html file; choose this ending.")
    return path
