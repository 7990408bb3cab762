"""The report of a sweep: what a designer looks at, in one HTML file and as PNGs."""

from __future__ import annotations

import base64
import io
import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd
from markupsafe import Markup
from matplotlib.figure import Figure as Plot

from selflock.fmus.shown import literal
from selflock.view import page

from . import charts
from .analysis import sensitivity
from .campaign import cause
from .errors import SweepError
from .store import digest, rows_in
from .study import Study, from_dict


@dataclass
class Section:
    title: str
    text: str = ""
    plots: Mapping[str, Plot] = field(default_factory=dict)  # by file name
    rows: pd.DataFrame | None = None
    images: list[tuple[str, int]] = field(default_factory=list)  # PNG, and its width on the page in px

    @property
    def table(self) -> Markup | None:
        if self.rows is None or self.rows.empty:
            return None
        return Markup(self.rows.to_html(index=False, border=0, float_format=lambda value: f"{value:.4g}"))


def report(folder: str | Path) -> Path:
    """Draw what the runs in a sweep's folder say; gives the path of report.html, with figures/ beside it."""
    folder = Path(folder)
    study, table, about = read_folder(folder)
    good = table[table["status"] == "ok"]
    sections = list(_sections(study, table, good))
    (folder / "figures").mkdir(exist_ok=True)
    for section in sections:
        for name, plot in section.plots.items():
            buffer = io.BytesIO()
            literal(plot).savefig(buffer, dpi=130, metadata={"Software": None})
            (folder / "figures" / f"{name}.png").write_bytes(buffer.getvalue())
            section.images.append((base64.b64encode(buffer.getvalue()).decode(), round(96 * plot.get_figwidth())))
    return page.write(
        folder / "report.html",
        page.environment("selflock.sweep"),
        "report.html.j2",
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
                {"margins": charts.margins(study, good)},
                good[[*study.report["margins"]["by"], *(one.name for one in study.record)]],
            )
        if charts.role(study, "friction", "ratio", "moving", "holding", "hold_times"):
            plot, best = charts.duty(study, good)
            chart = charts.chart(study, good)
            yield Section(
                "Energy of a duty cycle",
                "One manoeuvre and then holding still. At and beyond the self-locking limit, tan φ = tan α, holding"
                " costs nothing; every bit of friction more makes moving dearer.",
                {"duty_cycle": plot} | ({"chart": chart} if chart is not None else {}),
                best,
            )
        if charts.role(study, "pareto"):
            plot, best = charts.front(study, good)
            yield Section(
                "Holding against moving",
                "Of the marked runs none is beaten by another in all three.",
                {"pareto": plot},
                best,
            )
        found, how = sensitivity(study, table)
        plots = {"sensitivity": charts.sensitivities(study, found)} if len(found) else {}
        yield Section("What depends on what", f"Share of each figure's variance. {how}", plots)
        if study.record:
            shown, count = min(charts.SHOWN, len(study.record)), len(study.record)
            text = f"The first {shown} of {count}; the others are in runs.parquet." if shown < count else ""
            yield Section("All figures", text, {"overview": charts.overview(study, good)})
    causes = Counter(cause(reason) for reason in table.loc[table["status"] == "failed", "reason"])
    if causes:
        ordered = dict(causes.most_common())
        rows = pd.DataFrame({"cause": ordered.keys(), "runs": ordered.values()})
        yield Section(
            "Failed runs",
            "By cause; each run's own reason is in runs.parquet.",
            {"failures": charts.failures(ordered)},
            rows,
        )
