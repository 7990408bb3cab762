"""What the project stands on: the lowest versions that it says it works with, and the licences of all of it.

python -m benchmarks.supply lowest       pins for pip, a line for each bound of pyproject.toml; `make lowest` tests with them
python -m benchmarks.supply licences     writes docs/licences.md, of what is installed here (.venv)
"""

from __future__ import annotations

import re
import sys
import tomllib
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from benchmarks import tally

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "licences.md"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = ("diagnosis", "vehicle", "files", "sweep")


def bounds() -> dict[str, str]:
    """The lowest version of each package that the project itself names, the highest where it is named twice."""
    found: dict[str, str] = {}
    for line in [
        *PROJECT["dependencies"],
        *(one for extra in (*EXTRAS, "test") for one in PROJECT["optional-dependencies"][extra]),
    ]:
        need = Requirement(line)
        for bound in need.specifier:
            if bound.operator in (">=", "=="):
                found[need.name] = max(
                    found.get(need.name, ""), bound.version, key=lambda v: [int(n) for n in re.findall(r"\d+", v)]
                )
    return found


def needed(extra: str = "") -> dict[str, Distribution]:
    """All packages that the project needs with this extra, theirs as well, that are installed here; by canonical name."""
    lines = PROJECT["dependencies"] if not extra else PROJECT["optional-dependencies"][extra]
    waiting, found = [Requirement(line) for line in lines], {}
    while waiting:
        need = waiting.pop()
        name = canonicalize_name(need.name)
        if name in found or (need.marker and not any(need.marker.evaluate({"extra": e}) for e in ("", *need.extras))):
            continue
        try:
            found[name] = distribution(need.name)
        except PackageNotFoundError:
            continue
        for line in found[name].requires or ():
            theirs = Requirement(line)
            if not theirs.marker or any(theirs.marker.evaluate({"extra": e}) for e in ("", *need.extras)):
                theirs.marker = None
                waiting.append(theirs)
    return found


def licence(of: Distribution) -> str:
    """As the package says it: an expression, its classifiers, or the first line of a text."""
    told = of.metadata
    if told.get("License-Expression"):
        return str(told["License-Expression"])
    classes = [line.rpartition(" :: ")[2] for line in told.get_all("Classifier") or () if line.startswith("License ::")]
    first = str(told.get("License") or "").strip().partition("\n")[0]
    return "; ".join(dict.fromkeys(classes)) if classes else first[:60] or "not said"


def page() -> str:
    """docs/licences.md."""
    of: dict[str, tuple[Distribution, list[str]]] = {}
    for extra in ("", *EXTRAS):
        for name, found in needed(extra).items():
            of.setdefault(name, (found, []))[1].append(extra or "always")
    rows = [
        (name, found.version, licence(found).replace("|", "/"), "always" if "always" in extras else ", ".join(extras))
        for name, (found, extras) in sorted(of.items())
    ]
    return f"""# Licences of what selflock stands on

selflock itself is under the MIT licence; its FMUs hold the notices of what is inside them (`documentation/licenses/license.txt`). These packages are installed beside it, under their own licences, as each says of itself; nothing of them is copied in. Written by `python -m benchmarks.supply licences`.

The lowest versions are those of pyproject.toml; `make lowest` asks pip for exactly these and runs the quick tests with them (2219 passed, 2026-11-24; before that nine bounds named releases with which it could not be installed, or did not work).

{tally.table(("package", "version looked at", "licence", "needed by"), rows)}
"""


def main() -> None:
    match sys.argv[1:]:
        case ["lowest"]:
            print("\n".join(f"{name}=={version}" for name, version in sorted(bounds().items())))
        case ["licences"]:
            PAGE.write_text(page())
        case _:
            sys.exit(__doc__)


if __name__ == "__main__":
    main()
