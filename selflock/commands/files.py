"""Files to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .terminal import say

app = typer.Typer()


@app.command()
def example(
    name: Annotated[str | None, typer.Argument(help="Which one, such as bench; all are listed when none is given.")] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to copy it to.")] = Path("."),
) -> None:
    """List the examples, or copy one to begin with."""
    from selflock import examples

    if name is None:
        for known, path in examples.files().items():
            say(f"{known:20} {examples.about(path)}", highlight=False)
        return
    for path in examples.copy(name, out):
        say(path)


@app.command()
def schema(
    of: Annotated[str, typer.Argument(metavar="rig|system|sweep", help="Of which file.")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="File to write it to; the terminal when not given.")] = None,
) -> None:
    """Write the JSON schema of a file, by which editors complete and check it."""
    from selflock.schemas import text

    if out is None:
        print(text(of))
    else:
        out.write_text(text(of) + "\n", encoding="utf-8")
        say(out)
