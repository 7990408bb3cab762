"""TOML as strangers write it: whatever is wrong with a text is one ValueError with a sentence."""

from __future__ import annotations

import tomllib
from typing import Any

LARGEST = 2**63  # TOML's integers have 64 bits


def parse(text: str) -> dict[str, Any]:
    """The content of a TOML text. Raises ValueError."""
    try:
        data = tomllib.loads(text)
        _check(data, "")
    except RecursionError:
        raise ValueError("its brackets are nested too deep") from None
    except tomllib.TOMLDecodeError:
        raise
    except ValueError as error:  # of Python's own int
        raise ValueError("it has a number of thousands of digits" if "digits" in str(error) else str(error)) from None
    return data


def _check(value: Any, name: str) -> None:
    if isinstance(value, dict):
        for key, inner in value.items():
            _check(inner, f"{name}.{key}" if name else key)
    elif isinstance(value, list):
        for inner in value:
            _check(inner, name)
    elif isinstance(value, int) and not -LARGEST <= value < LARGEST:
        raise ValueError(f"{name} is an integer beyond 64 bits; write a real number, such as 1e30")
