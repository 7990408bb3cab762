"""Compile a native FMU of this folder and pack it: python tests/native/pack.py relaxation out/"""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

HERE = Path(__file__).parent


def pack(name: str, out: Path | str) -> Path:
    """out/name.fmu, built with gcc for linux64."""
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    library = out / f"{name}.so"
    flags = ["-O2", "-std=c99", "-shared", "-fPIC", "-fvisibility=hidden"]
    described = (HERE / name / "modelDescription.xml").read_text()
    third = 'fmiVersion="3.0"' in described
    second = 'fmiVersion="2.0"' in described
    rest = [HERE / "rest.c"] if second else []  # of others a small FMU lacks what it has no use for
    subprocess.run(["gcc", *flags, "-o", library, HERE / name / f"{name}.c", *rest, "-lm"], check=True)
    path = out / f"{name}.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", described)
        archive.write(library, f"binaries/{'x86_64-linux' if third else 'linux64'}/{name}.so")
    return path


if __name__ == "__main__":
    print(pack(sys.argv[1], sys.argv[2]))
