"""The loaders' C, and the C host that calls it, under AddressSanitizer and UndefinedBehaviorSanitizer.

    python -m benchmarks.sanitizers [pytest's own words, such as -k save]

The tests of hosts that are not Python, and the fuzzer's calls in any order, once more with both compiled by a compiler that
watches every access: what is outside of its memory, freed already, undefined or lost ends a test. FMUs are built anew into a
cache of its own. What libpython keeps until the end of the process is not told (an embedded Python leaks by design), nor
what pythonfmu's library or the dynamic linker keep; all else is. Needs gcc with libasan and libubsan (Linux, x86-64).
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
OPTIONS = "-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer -g"
WITH_CPP = "-Wl,--no-as-needed -lstdc++"  # there from the start, so that what pythonfmu's library throws is understood
KEPT_BY_DESIGN = ("libpython3", "-packages/", "lib-dynload/", "libcrypto", "libssl")

DEFAULTS = """
const char *__asan_default_options(void) {{ return "detect_leaks=1:detect_stack_use_after_return=1:strict_string_checks=1"; }}
const char *__lsan_default_options(void) {{ return "print_suppressions=0"; }}
const char *__lsan_default_suppressions(void) {{ return "{}"; }}
"""


def runtime() -> Path | None:
    """gcc's libasan; None where there is none."""
    gcc = shutil.which("gcc")
    if gcc is None or sys.platform != "linux":
        return None
    paths = [
        Path(subprocess.run([gcc, f"-print-file-name={name}"], capture_output=True, text=True).stdout.strip())
        for name in ("libasan.so", "libubsan.so")
    ]
    return paths[0] if all(path.is_absolute() and path.exists() for path in paths) else None


def compiler(folder: Path) -> Path:
    """gcc as a program in this folder that compiles so; what it makes of programs brings its own settings along."""
    defaults = folder / "defaults.c"
    defaults.write_text(DEFAULTS.format("".join(f"leak:{name}\\n" for name in KEPT_BY_DESIGN)))
    path = folder / "sanitized-gcc"
    path.write_text(
        f'#!/bin/sh\ncase " $* " in *" -shared "*) exec gcc {OPTIONS} "$@";; esac\nexec gcc {OPTIONS} "$@" "{defaults}" {WITH_CPP}\n'
    )
    path.chmod(0o755)
    return path


def main() -> None:
    library = runtime()
    if library is None:
        sys.exit("There is no gcc with libasan and libubsan here: install gcc's sanitizers.")
    with tempfile.TemporaryDirectory() as folder:
        environment = {
            **os.environ,
            "CC": str(compiler(Path(folder))),
            "SELFLOCK_CACHE": str(Path(folder) / "cache"),
            "LD_PRELOAD": f"{library}:libstdc++.so.6",  # Python itself loads the FMUs, to compare
            "ASAN_OPTIONS": "detect_leaks=0",  # of Python; the host has its own settings
        }
        # memory that was freed is kept aside, to see who uses it: so growth says nothing here
        words = [
            "-q",
            "-p",
            "no:cacheprovider",
            "-k",
            "not growth",
            "tests/hosts",
            "tests/fuzz/test_fuzz.py::test_any_calls_of_any_host_are_answered",
        ]
        done = subprocess.run([sys.executable, "-m", "pytest", *words, *sys.argv[1:]], cwd=ROOT, env=environment)
    sys.exit(done.returncode)


if __name__ == "__main__":
    main()
