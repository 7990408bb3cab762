"""Folders that a command writes to: its own, or none at all. Only the standard library."""

from __future__ import annotations

import os
from pathlib import Path

from .errors import SelflockError

MARK = ".selflock"  # holds the name of the command whose folder it is


def claim(folder: Path, command: str, known: str) -> Path:
    """Make the folder, or refuse one with others' content before anything is written. known: a file that only this command makes."""
    try:
        content = sorted(os.listdir(folder))
    except FileNotFoundError:
        content = []
    mark = folder / MARK
    if content and known not in content:
        try:
            owner = mark.read_text("utf-8").strip()[:100] if MARK in content else ""
        except (OSError, ValueError):
            owner = ""
        if owner != command:
            what = f"it is that of a {owner}" if owner else f"it holds {content[0]}"
            raise SelflockError(
                f"{folder} is not the folder of a {command}: {what}. Nothing in it was touched. Give an empty folder or a new one."
            )
    folder.mkdir(parents=True, exist_ok=True)
    if MARK not in content:
        mark.write_text(command + "\n", "utf-8")
    return folder
