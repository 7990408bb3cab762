"""The loaders' C where every access to memory is watched; the whole of it is `python -m benchmarks.sanitizers`."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from lives import Extracted, born, steps

from benchmarks import sanitizers
from selflock.fmus import build, loader

HERE = Path(__file__).parent
BAD = "#include <stdlib.h>\nint main(int count, char **words) { char *a = malloc(8); (void)words; return a[7 + count]; }\n"


@pytest.mark.slow
@pytest.mark.skipif(sanitizers.runtime() is None, reason="there is no gcc with libasan and libubsan here")
def test_a_life_touches_no_memory_but_its_own(tmp_path, monkeypatch):
    gcc = sanitizers.compiler(tmp_path)
    (tmp_path / "bad.c").write_text(BAD)
    subprocess.run([gcc, "-o", tmp_path / "bad", tmp_path / "bad.c"], check=True)
    seen = subprocess.run([tmp_path / "bad"], capture_output=True, text=True)
    assert seen.returncode and "heap-buffer-overflow" in seen.stderr
    monkeypatch.setenv("CC", str(gcc))
    fmu = Extracted(build.build("Load", tmp_path / "built"), tmp_path / "load")
    subprocess.run([loader.compiler(), "-o", tmp_path / "host", HERE / "host.c", "-ldl", "-lpthread"], check=True)
    life = [*born(fmu), *steps(fmu, lambda i: {"torque": 1.0}, 0, 3), ("save", 0, 1), ("pack", 0, 1), ("restore", 0, 1)]
    life += [("drop", 0, 1), ("terminate", 0), ("free", 0)]
    lines = "".join("\t".join(map(str, command)) + "\n" for command in life)
    bare = {"PATH": f"{sys.base_prefix}/bin:{os.environ['PATH']}"}
    done = subprocess.run([tmp_path / "host"], input=lines, env=bare, capture_output=True, text=True)
    assert done.returncode == 0 and "Sanitizer" not in done.stderr, done.stderr
    assert b"__asan_init" in fmu.library.read_bytes()  # it was watched
