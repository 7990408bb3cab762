"""What an error may depend on, one variable at a time: ten of an hour's log at once are a quarter of a gigabyte."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np


class Made(Mapping[str, list[np.ndarray]]):
    """Variables by name, one array for each run; each is made anew whenever it is asked for."""

    def __init__(self) -> None:
        self._makes: dict[str, Callable[[], list[np.ndarray]]] = {}

    def __setitem__(self, name: str, make: Callable[[], list[np.ndarray]]) -> None:
        self._makes[name] = make

    def __getitem__(self, name: str) -> list[np.ndarray]:
        return self._makes[name]()

    def __contains__(self, name: object) -> bool:
        return name in self._makes

    def __iter__(self) -> Iterator[str]:
        return iter(self._makes)

    def __len__(self) -> int:
        return len(self._makes)
