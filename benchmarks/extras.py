"""What each extra costs: the size of a fresh environment with it, beside that of the base.

    python benchmarks/extras.py

Every environment is made by pip from a wheel of the project, without pip itself and without compiled bytecode.
"""

from __future__ import annotations

import subprocess
import sys
import venv
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parent.parent
EXTRAS = ("", "vehicle", "diagnosis", "sweep", "all")


def size(folder: Path) -> float:
    """Size of all files in MB."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc") / 1e6


def main() -> None:
    with TemporaryDirectory() as made:
        here = Path(made)
        pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*pip, "wheel", "--no-deps", "--wheel-dir", here, ROOT], check=True)
        (wheel,) = here.glob("*.whl")
        base = 0.0
        for extra in EXTRAS:
            place = here / (extra or "base")
            venv.create(place)
            wanted = f"{wheel}[{extra}]" if extra else str(wheel)
            subprocess.run([*pip, "--python", place, "install", "--no-compile", wanted], check=True)
            total = size(place)
            base = base or total
            print(f"{extra or 'base':10} {total:6.0f} MB   +{total - base:.0f}", flush=True)


if __name__ == "__main__":
    main()
