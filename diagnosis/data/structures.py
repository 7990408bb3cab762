"""Structures of MATLAB and HDF5 as vectors by name: `log.speed`, and of an array of structures each by its label or its number.

They come as plain data: a dictionary is a structure, a list an array of them, all else are numbers or text.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

WIDEST = 1000  # columns made of one matrix, of lists, or of an array of structures
DEEPEST = 6  # structures in structures
MOST_NAMES = 5000
LONGEST = 300  # characters of a column's name; what is read of it may take their square
LABELS, VALUES, UNITS = (
    ("label", "name"),
    ("values", "data"),
    ("unit", "units"),
)  # of a signal's structure, as scopes and recorders write it


def fields(held: Mapping[str, Any], prefix: str = "", depth: int = 0) -> Iterator[tuple[str, Any]]:
    """The arrays in structures, by name. What a labelled structure has as its values is a channel of that name and unit."""
    for name, value in held.items():
        if not isinstance(value, (dict, list)):
            if np.asarray(value).dtype.kind in "fiubUS":
                yield prefix + name, value
            continue
        every = value if isinstance(value, list) else [value]
        if len(every) > WIDEST or depth >= DEEPEST:
            continue
        if runs := _runs(every):
            yield from ((f"{prefix}{name}.{key}", x) for key, x in runs.items())
            continue
        for label, within in zip([""] if len(every) == 1 else _labels(every), every):
            here = f"{prefix}{name}.{label}".rstrip(".")
            if label and (values := _key(within, VALUES)):
                unit = _text(within, UNITS)
                yield from fields({here + (f" [{unit}]" if unit else ""): within[values]}, "", depth + 1)
                within = {key: one for key, one in within.items() if key != values}
            yield from fields(within, f"{here}.", depth + 1)


def of_matlab(value: Any, depth: int = 0) -> Any:
    """A value of a MATLAB file before 7.3, as scipy reads it, as plain data."""
    value = np.asarray(value)
    if not value.dtype.names:
        return value
    if value.size > WIDEST or depth > DEEPEST:
        return []
    every = [{name: of_matlab(one[name], depth + 1) for name in value.dtype.names} for one in value.reshape(-1)]
    return every[0] if len(every) == 1 else every


def of_hdf(file: Any, count: Callable[[int], None]) -> dict[str, Any]:
    """All of an HDF5 file, as which MATLAB writes its version 7.3, as plain data; what lies in other files is not followed.

    count: is told the bytes of each vector before it is read.
    """
    import h5py

    seen: set[Any] = set()  # a group may hold itself, or another many times
    found = 0

    def read(value: Any, depth: int) -> Any:
        nonlocal found
        if found > MOST_NAMES or depth > DEEPEST:
            return None
        if isinstance(value, h5py.Group):
            if value.id in seen:
                return None
            seen.add(value.id)
            return group(value, depth)
        if not isinstance(value, h5py.Dataset) or value.is_virtual or value.external or value.attrs.get("MATLAB_empty", 0):
            return None
        if value.attrs.get("MATLAB_class") == b"char":
            return np.array("".join(map(chr, np.ravel(value[()])))) if value.size <= LONGEST else None
        if refers(value):  # a cell array
            return {str(k + 1): read(one, depth + 1) for k, one in enumerate(pointed(value))}
        if value.dtype.kind not in "fiub" or value.ndim > 2:
            return None
        count(value.nbytes)
        found += 1
        return np.asarray(value[()])

    def group(value: Any, depth: int) -> Any:
        links = {name: value.get(name, getlink=True) for name in value if not name.startswith("#")}
        held = {name: value[name] for name, link in links.items() if isinstance(link, h5py.HardLink)}
        sizes = {one.size if refers(one) and one.attrs.get("MATLAB_class") != b"cell" else 0 for one in held.values()}
        if len(sizes) == 1 and (size := sizes.pop()) > 1:  # an array of structures: a table of references for each field
            columns = {name: pointed(one) for name, one in held.items()}
            return [{name: read(column[k], depth + 1) for name, column in columns.items()} for k in range(min(size, WIDEST))]
        return {name: read(one, depth + 1) for name, one in held.items()}

    def refers(value: Any) -> bool:
        return isinstance(value, h5py.Dataset) and h5py.check_ref_dtype(value.dtype) is h5py.Reference

    def pointed(value: Any) -> list:
        """What a table of references points to."""
        return [file[one] if one else None for one in np.ravel(value[()])[:WIDEST]]

    return group(file, 0)


def _runs(every: list[dict]) -> dict[str, np.ndarray]:
    """An array of structures of which each has a time of its own, as its runs one behind the other, told apart by `run`."""
    if len(every) < 2:
        return {}
    parts = [{key: np.squeeze(np.asarray(x)) for key, x in one.items() if not isinstance(x, (dict, list))} for one in every]
    shared = [key for key in parts[0] if all(key in part and part[key].dtype.kind in "fiu" for part in parts)]
    clocks = [key for key in shared if all(part[key].ndim == 1 and np.all(np.diff(part[key]) > 0.0) for part in parts)]
    alike = [key for key in shared if clocks and all(part[key].shape == part[clocks[0]].shape for part in parts)]
    if len(alike) < 2 or min(len(part[clocks[0]]) for part in parts) < 2:
        return {}
    number = np.repeat(np.arange(1, len(parts) + 1), [len(part[clocks[0]]) for part in parts])
    return {key: np.concatenate([part[key] for part in parts]) for key in alike} | {"run": number}


def _key(structure: dict, names: tuple[str, ...]) -> str:
    return next((key for key in structure if key.lower() in names), "")


def _text(structure: dict, names: tuple[str, ...]) -> str:
    """What a structure says under one of these names; "" where that is no text."""
    told = np.squeeze(np.asarray(structure.get(_key(structure, names), "")))
    return str(told).strip() if told.dtype.kind in "US" and told.ndim == 0 else ""


def _labels(every: list[dict]) -> list[str]:
    """What tells the structures of an array apart: their labels or names, where each has its own, or their numbers."""
    told = [_text(one, LABELS) for one in every]
    return told if all(told) and len({*told}) == len(told) else [str(k + 1) for k in range(len(every))]
