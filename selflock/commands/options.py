"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

AllowCode = Annotated[
    bool,
    typer.Option("--allow-code", help="Load parts of other packages and effects of a rig: whoever wrote them runs code as you."),
]
Unlimited = Annotated[
    bool, typer.Option("--unlimited", help="Unpack FMUs and SSPs of any number of files and any size (docs/security.md).")
]
Isolate = Annotated[bool, typer.Option("--isolate", help="Run every FMU in a process of its own with limits and without rights.")]
Anyway = Annotated[bool, typer.Option("--anyway", help="Go on where the log and the rig contradict each other.")]
MaxTime = Annotated[
    float | None,
    typer.Option("--max-time", help="Seconds of wall time for all of it; rows or fits that there are by then are kept."),
]
Out = Annotated[Path, typer.Option("--out", "-o", help="Folder to write to; made if it is missing.")]
