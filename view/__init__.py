"""Look at a result: one page with what moves, its curves and its peaks, which needs no network (docs/view.md).

from selflock import view
view(["robot.parquet", "other.parquet"], "page.html")
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from selflock.rooms import called_as, offered

if TYPE_CHECKING:
    from .viewing import checked, view

__all__ = ["checked", "view"]

__getattr__, __dir__ = offered(__name__)  # other rooms' pages need no results
called_as(__name__)
