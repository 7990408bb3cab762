"""The one page of the house: its head, its style, its policy. Study, sweep, diagnosis and view fill it.

A page's template begins with `{% extends "page.html.j2" %}` and has the blocks `title`, `body` and, where it must, `style`.
"""

from __future__ import annotations

import hashlib
import json
import re
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

from jinja2 import BytecodeCache, ChoiceLoader, Environment, PackageLoader, StrictUndefined, Undefined
from jinja2.bccache import Bucket
from markupsafe import Markup, escape

from selflock.fmus import cache
from selflock.fmus.place import whole
from selflock.fmus.shown import policy

from .stacked import stacked

HERE = Path(__file__).parent
POWER, RAISED = re.compile(r"([A-Za-z])(-?\d+)"), str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
SCRIPT = {  # of a page, in this order, by what of its data it draws
    "data.js": ("runs", "figures"),
    "axes.js": ("runs", "figures"),
    "stage.js": ("runs",),  # what moves,
    "curves.js": ("runs",),  # its curves over time,
    "viewer.js": ("runs",),  # and the time they share
    "figures.js": ("figures",),  # over anything
}


HOW: dict[str, Any] = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True}  # templates are read


def environment(package: str, strict: bool = True) -> Environment:
    """Templates of a package of ours, with the page that they extend. What they are given is escaped; not strict: may be missing.

    What Jinja makes of them is kept in the user's cache: making it takes longer than filling a page.
    """
    loader = ChoiceLoader([PackageLoader(package, "."), PackageLoader("selflock.view", ".")])
    made = Environment(loader=loader, undefined=StrictUndefined if strict else Undefined, bytecode_cache=Compiled(), **HOW)
    made.filters["number"] = number
    made.filters["percent"] = lambda v: "–" if v is None else f"{number(100 * v, 3)} %"
    made.filters["probability"] = probability
    made.filters["unit"] = pretty
    made.filters["breaks"] = breaks
    return made


class Compiled(BytecodeCache):
    """What Jinja makes of a template, which takes longer than to fill it, in the user's cache, under its SHA-256.

    Of another template, of what another Jinja makes of it, or in another way, it is another file.
    """

    def _place(self, bucket: Bucket) -> Path:
        told = f"{bucket.key} {bucket.checksum} {version('jinja2')} {HOW}"
        return cache.folder() / "pages" / hashlib.sha256(told.encode()).hexdigest()[:32]

    def load_bytecode(self, bucket: Bucket) -> None:
        """Nothing where it is not there, or not as it was written: Jinja then makes it."""
        path = self._place(bucket)
        with suppress(OSError, ValueError):
            seal, _, content = path.read_bytes().partition(b"\n")
            if hashlib.sha256(content).hexdigest().encode() == seal:
                bucket.bytecode_from_string(content)

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Keep it."""
        content = bucket.bytecode_to_string()
        cache.write(self._place(bucket), hashlib.sha256(content).hexdigest().encode() + b"\n" + content)


def pretty(unit: str) -> str:
    """A unit as it is read: N·m/s² for N.m/s2."""
    text = unit.replace(".", "·") if unit != "Ohm" else "Ω"
    return POWER.sub(lambda found: found[1] + found[2].translate(RAISED), text)


def breaks(name: str) -> Markup:
    """A name that may go on in the next line behind its dots and underscores."""
    return Markup(re.sub("([._])", r"\1<wbr>", str(escape(name))))


def number(value: float | None, digits: int = 4) -> str:
    """Four digits, as the script writes them; a dash where there is none."""
    if value is None:
        return "–"
    text = f"{value:.{digits}g}"
    if "e" in text and 1.0 <= abs(value) < 1e6:
        text = f"{value:.0f}"
    mantissa, e, power = text.replace("-", "−").partition("e")
    return f"{mantissa}·10{str(int(power.replace('−', '-'))).translate(RAISED)}" if e else mantissa


def probability(value: float) -> str:
    """Two digits, and no certainty that an estimate has not: "below 0.01", "above 0.99"."""
    least = 0.01
    if value < least:
        return f"below {least:g}"
    return f"above {1.0 - least:g}" if value > 1.0 - least else f"{value:.2f}"


def write(path: Path, made: Environment, template: str, data: dict[str, Any] | None = None, **words: Any) -> Path:
    """Render a page into a file. `data`: what is drawn (selflock.view.shown, selflock.view.figures); none, and it runs no script."""
    script = viewer(data) if data else ""
    html = made.get_template(template).render(
        policy=Markup(policy(script) if script else policy()),
        page_style=Markup((HERE / "style.css").read_text(encoding="utf-8")),
        page_script=Markup(script),
        **words,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole(path) as new:
        new.write_text(stacked(html), encoding="utf-8", errors="backslashreplace")
    return path


def viewer(data: dict[str, Any]) -> str:
    """The script with its data inside. No text in it ends the script's element, or leaves UTF-8."""
    carried = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return f"const D = {carried};\n" + "\n".join(
        (HERE / name).read_text(encoding="utf-8") for name, draws in SCRIPT.items() if any(one in data for one in draws)
    )
