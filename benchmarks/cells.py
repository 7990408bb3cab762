"""What is no page as one, to make a picture of it: what a command wrote as a terminal shows it, a notebook as its reader does.

    python -m benchmarks.pictures written.txt picture.png
    python -m benchmarks.pictures examples/notebooks/design_study.ipynb picture.png --cells 9:11

A notebook is run in an empty folder, all of it; the cells from one number to the other are shown, with what they show.
"""

from __future__ import annotations

import ast
import base64
import io
import json
import os
from contextlib import chdir
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from selflock.view.page import HERE

STYLE = """main { max-width: none; padding: 14px 16px; } pre { margin: 0 0 .6rem; line-height: 1.45; white-space: pre-wrap; }
.code { border-left: 3px solid var(--accent); } .out { margin: 0 0 1rem; } .out table { font-size: .85rem; } .out th, .out td { text-align: right; }"""


def page_of(path: Path, cells: str = "") -> str:
    """The page. cells: of a notebook those that are shown, as first:last; all where not said."""
    body = f"<pre>{escape(path.read_text(encoding='utf-8'))}</pre>" if path.suffix == ".txt" else _notebook(path, cells)
    style = (HERE / "style.css").read_text(encoding="utf-8")
    return f'<!doctype html><html lang="en"><head><meta charset="utf-8"><style>{style}\n{STYLE}</style></head><body><main>{body}</main></body></html>'


def _notebook(path: Path, cells: str) -> str:
    os.environ["MPLBACKEND"] = "agg"
    told = json.loads(path.read_text(encoding="utf-8"))["cells"]
    first, _, last = cells.partition(":")
    shown = range(int(first or 0), int(last or len(told) - 1) + 1)
    names: dict[str, Any] = {"__name__": "__main__"}
    parts = []
    with TemporaryDirectory() as folder, chdir(folder):
        for number, cell in enumerate(told):
            text = "".join(cell["source"])
            if cell["cell_type"] == "markdown":
                part = "".join(f"<p>{escape(line.lstrip('# '))}</p>" for line in text.splitlines() if line)
            else:
                part = f'<pre class="code">{escape(text)}</pre><div class="out">{_run(text, names)}</div>'
            if number in shown:
                parts.append(part)
    return "".join(parts)


def _run(text: str, names: dict[str, Any]) -> str:
    """What a cell shows: the value of an expression at its end, and what was drawn."""
    from matplotlib import pyplot

    tree = ast.parse(text)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    value = eval(compile(ast.Expression(last.value), "cell", "eval"), names) if last is not None else None
    found = ""
    for number in pyplot.get_fignums():
        data = io.BytesIO()
        pyplot.figure(number).savefig(data, dpi=80)
        found += f'<img alt="" src="data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}">'
    pyplot.close("all")
    if found or value is None or text.rstrip().endswith(";"):
        return found
    return value._repr_html_() if hasattr(value, "_repr_html_") else f"<pre>{escape(repr(value))}</pre>"
