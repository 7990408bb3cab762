"""The report of a sweep: what a designer looks at, in one HTML file."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd
from markupsafe import Markup

from selflock.view import figures, page

from . import charts
from .analysis import sensitivity
from .campaign import cause
from .errors import SweepError
from .store import digest, rows_in
from .study import Study, from_dict

ROWS = 400  # of a table on the page
LEAST = {"duty_cycle": 420, "chart": 420, "overview": 200, "pareto": 420}  # px of a plot


@dataclass
class Section:
    title: str
    text: str = ""
    figures: dict[str, charts.Plots] = field(default_factory=dict)  # by name
    rows: pd.DataFrame | None = None
    shares: list[dict] = field(default_factory=list)  # tables of shares
    bars: list[dict] = field(default_factory=list)

    @property
    def table(self) -> Markup | None:
        if self.rows is None or self.rows.empty:
            return None
        shown = Markup(self.rows.head(ROWS).to_html(index=False, border=0, float_format=lambda value: f"{value:.4g}"))
        return shown + (f"The first {ROWS} of {len(self.rows)} rows; all are in runs.parquet." if len(self.rows) > ROWS else "")


def report(folder: str | Path) -> Path:
    """Draw what the runs in a sweep's folder say; gives the path of report.html."""
    folder = Path(folder)
    study, table, about = read_folder(folder)
    good = table[table["status"] == "ok"]
    sections = list(_sections(study, table, good))
    drawn = figures.carried({name: plots for one in sections for name, plots in one.figures.items()}, LEAST)
    return page.write(
        folder / "report.html",
        page.environment("selflock.sweep"),
        "report.html.j2",
        drawn,
        name=study.name,
        description=study.data.get("description", ""),
        sections=sections,
        total=len(table),
        good=len(good),
        failed=int((table["status"] == "failed").sum()),
        missing=int((table["status"] == "missing").sum()),
        fmus=about["fmus"],
        versions=about["versions"],
    )


def read_folder(folder: Path) -> tuple[Study, pd.DataFrame, dict]:
    """The study of a folder, a row for each run (status "missing" where there is none yet), and what made them."""
    try:
        about = json.loads((folder / "study.json").read_text(encoding="utf-8"))
        study = from_dict(about["notes"]["data"], folder / "study.json")
    except (OSError, ValueError, KeyError):
        raise SweepError(
            f"{folder} is not the folder of a sweep of a system. Give the DIR that `selflock sweep` wrote to."
        ) from None
    rows = rows_in(folder)
    empty = {one.name: None for one in study.record}
    found = [
        rows.get(digest(item)) or {**item["parameters"], **empty, "status": "missing", "reason": None} for item in study.items
    ]
    return study, pd.DataFrame(found), about


def _sections(study: Study, table: pd.DataFrame, good: pd.DataFrame):
    if len(good):
        if charts.role(study, "margins"):
            yield Section(
                "What suffices",
                "What is left to each limit, as a share of the limit. Below zero the limit is passed.",
                rows=charts.figures_of(study, good, study.report["margins"]["by"]),
                shares=[charts.margins(study, good)],
            )
        if charts.role(study, "friction", "ratio", "moving", "holding", "hold_times"):
            plots, best = charts.duty(study, good)
            yield Section(
                "Energy of a duty cycle",
                "One manoeuvre and then holding still. At and beyond the self-locking limit, tan φ = tan α, holding"
                " costs nothing; every bit of friction more makes moving dearer. Dotted: the limit μ = 1/r of each ratio; dot: least"
                " energy.",
                {"duty_cycle": plots, "chart": charts.chart(study, good)},
                best,
            )
        if charts.role(study, "pareto"):
            plots, best = charts.front(study, good)
            yield Section(
                "Holding against moving",
                "Of the marked runs none is beaten by another in all three.",
                {"pareto": plots},
                best,
            )
        found, how = sensitivity(study, table)
        yield Section(
            "What depends on what",
            f"Share of each figure's variance. {how}",
            shares=charts.sensitivities(found) if len(found) else [],
        )
        if study.record:
            shown, count = min(charts.SHOWN, len(study.record)), len(study.record)
            text = f"The first {shown} of {count}; the others are in runs.parquet." if shown < count else ""
            yield Section("All figures", text, {"overview": charts.overview(study, good)})
    causes = Counter(cause(reason) for reason in table.loc[table["status"] == "failed", "reason"])
    if causes:
        text = "By cause; each run's own reason is in runs.parquet."
        yield Section("Failed runs", text, bars=charts.failures(dict(causes.most_common())))
