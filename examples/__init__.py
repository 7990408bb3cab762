"""Examples to start from, wherever the package is installed: `selflock example` lists them and copies one.

from selflock import examples
examples.copy("bench", "here")      # here/bench.toml
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from selflock.fmus.errors import SelflockError

HERE = Path(__file__).parent
BESIDE = re.compile(r'"(?:\.\./)+study/([\w]+\.toml)"')
"""A system of the study that an example names; it is copied with it, to lie beside it."""


TABLE = re.compile(r'"(\w+\.csv)"')
"""A table beside an example, likewise."""


def files() -> dict[str, Path]:
    """Every example by its name: systems, sweeps, rigs ("rigs/emps"), notebooks, scripts, and the robot of the study."""
    own = [
        path for path in sorted(HERE.rglob("*")) if path.suffix in (".toml", ".py", ".ipynb") and not path.name.startswith("_")
    ]
    found = {path.relative_to(HERE).with_suffix("").as_posix(): path for path in own}
    return found | {path.stem: path for path in sorted((HERE.parent / "study").glob("*.toml"))}


def about(path: Path) -> str:
    """What an example is, from its first comment, docstring or cell."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        text = "".join(json.loads(text)["cells"][0]["source"])
    first = text.lstrip().splitlines()[0]
    return first.strip("#\" '")


def copy(name: str, out: str | Path = ".") -> list[Path]:
    """Copy an example, and the system or table that it names, into the folder `out`; gives the files written.

    A file that is there and differs is not written over. Raises SelflockError.
    """
    known = files()
    if name not in known:
        raise SelflockError(f"There is no example {name!r}. There are {', '.join(known)}.")
    text = known[name].read_text(encoding="utf-8")
    wanted = {known[name].name: BESIDE.sub(r'"\1"', text)}
    wanted |= {beside: known[Path(beside).stem].read_text(encoding="utf-8") for beside in BESIDE.findall(text)}
    wanted |= {
        table: known[name].with_name(table).read_text(encoding="utf-8")
        for table in TABLE.findall(text)
        if known[name].with_name(table).is_file()
    }
    out = Path(out)
    for file, content in wanted.items():
        if (out / file).exists() and (out / file).read_text(encoding="utf-8", errors="replace") != content:
            raise SelflockError(f"{out / file} is there already and is another file: name another folder with -o.")
    out.mkdir(parents=True, exist_ok=True)
    for file, content in wanted.items():
        (out / file).write_text(content, encoding="utf-8")
    return [out / file for file in wanted]
