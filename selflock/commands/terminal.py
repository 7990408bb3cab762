"""What a command says, and where: names of strangers among it are words, and move no cursor."""

from __future__ import annotations

from rich.console import Console

from selflock.fmus.shown import visible

console = Console(markup=False, emoji=False)
errors = Console(stderr=True, soft_wrap=True, markup=False, emoji=False)


def say(text: object, highlight: bool | None = None) -> None:
    """Print what may hold names of strangers; a file or a pipe gets its lines as they are."""
    console.print(visible(text), highlight=highlight, soft_wrap=not console.is_terminal)
