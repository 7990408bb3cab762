"""The published study on the robot: its runs, its claims, its figures, one report."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from selflock.fmus import place
from selflock.rooms import called_as

from .claims import Claim, evaluate


@dataclass(frozen=True)
class StudyResult:
    """The report's path and the evaluated claims."""

    report: Path
    claims: list[Claim]

    def table(self) -> Table:
        """The claims as a table for the terminal."""
        held = sum(claim.holds for claim in self.claims)
        table = Table(title=f"{held} of {len(self.claims)} claims hold", show_lines=True)
        table.add_column("no.", justify="right")
        table.add_column("claim", ratio=3)
        table.add_column("measured", ratio=2)
        table.add_column("")
        for claim in self.claims:
            verdict = Text("holds", "green") if claim.holds else Text("FAILS", "bold red")
            table.add_row(str(claim.number), claim.text, claim.measured, verdict)
        return table


def study(out: Path | str, progress: bool = False, workers: int = 2) -> StudyResult:
    """Run everything, evaluate the claims, draw the figures, write the report. Tables of the runs go to out/runs."""
    from . import figures, report, runs

    out = place.claim(Path(out), "study", "claims.json")
    columns = (TextColumn("{task.description:<28}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), disable=not progress) as bar:
        running = bar.add_task("building the FMUs", total=len(runs.cases()))
        done = runs.run_all(
            out / "runs", lambda name, count, total: bar.update(running, completed=count, description=f"ran {name}"), workers
        )
        bar.update(running, description="runs")
        finishing = bar.add_task("claims", total=3)
        tables = runs.read_runs(done)
        claims = evaluate(tables)
        (out / "claims.json").write_text(
            json.dumps([claim.as_dict() for claim in claims], indent=2, ensure_ascii=False) + "\n", "utf-8"
        )
        bar.update(finishing, advance=1, description="figures")
        postures = next(one.postures for one in done if one.postures)
        pictured = figures.draw_postures(postures, out / "figure_06.png")
        bar.update(finishing, advance=1, description="report")
        path = report.write(out / "report.html", tables, claims, pictured, done)
        bar.update(finishing, advance=1, description="claims, figures, report")
    return StudyResult(path, claims)


called_as(__name__)
