"""replay.html: every comparison of a replay, drawn where it was off most, above all else that the log says of its rig."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from selflock.view import figures, page

from ..data.rig import Rig

if TYPE_CHECKING:
    from .replay import Replay


def write(result: Replay, rig: Rig, out: Path) -> Path:
    """Write the page of a replay."""
    names = {name: f"comparison {number}" for number, name in enumerate(result.plots)}
    drawn = figures.carried({names[name]: plots for name, plots in result.plots.items()}, dict.fromkeys(names.values(), 900))
    made = page.environment("selflock.diagnosis.output")
    return page.write(out / "replay.html", made, "replay.html.j2", drawn, rig=rig, result=result, names=names)
