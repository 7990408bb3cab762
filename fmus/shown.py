"""Showing words of strangers: names of rigs, columns, files and runs stay words, on a page, in a figure, in a terminal."""

from __future__ import annotations

import base64
import hashlib
import re
from html import escape
from typing import Any

CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def policy(*scripts: str) -> str:
    """The first element of a page's head: nothing is loaded from anywhere, no script runs but those given."""
    hashes = (base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = "".join(f"; script-src 'sha256-{one}'" if k == 0 else f" 'sha256-{one}'" for k, one in enumerate(hashes))
    rules = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'{allowed}"
    return f'<meta http-equiv="Content-Security-Policy" content="{rules}">'


def printed(text: Any) -> str:
    """Text as an element of a page or a notebook, its lines as they are."""
    return f'<pre style="white-space: pre-wrap">{escape(visible(text))}</pre>'


def literal(figure: Any) -> Any:
    """The matplotlib figure with all its words taken as they are: a $ begins no formula. Powers of ten on axes stay."""
    from matplotlib.text import Text

    powers = {
        label
        for axes in figure.findobj(lambda artist: hasattr(artist, "get_ticklabels") and hasattr(artist, "get_scale"))
        if axes.get_scale() != "linear"
        for label in axes.get_ticklabels(which="both")
    }
    for text in figure.findobj(Text):
        if text not in powers:
            text.set_parse_math(False)
    return figure


def one_line(text: Any) -> str:
    """The text as `visible`, its tabs and line breaks written out, too: it stays one line of several."""
    return visible(text).replace("\t", "\\t").replace("\n", "\\n")


def visible(text: Any) -> str:
    """The text with its control characters written out: none moves the cursor, makes a link or turns the writing round."""
    return CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode(), str(text))
