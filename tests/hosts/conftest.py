"""A host that is not Python: host.c, compiled once, fed with commands."""

import os
import shutil
import subprocess
import sys
import sysconfig
from functools import cache
from pathlib import Path

import pytest

from selflock.fmus import loader
from selflock.fmus.build import built

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
from lives import Extracted  # noqa: E402


@pytest.fixture(scope="session")
def host(tmp_path_factory):
    """host(commands, **environment) -> (answers, log): one line each; commands are tuples of words."""
    if loader.compiler() is None:
        pytest.skip("no C compiler for x86-64 Linux here: FMUs for hosts other than Python cannot be made")
    if not sysconfig.get_config_var("Py_ENABLE_SHARED"):
        pytest.skip("this Python has no shared library, which a host other than Python needs")
    program = tmp_path_factory.mktemp("host") / "host"
    subprocess.run(
        [loader.compiler(), "-O1", "-Wall", "-Werror", "-o", program, HERE / "host.c", "-ldl", "-lpthread"], check=True
    )

    path = f"{sys.base_prefix}/bin:{os.environ['PATH']}"  # what chooses among Pythons is not asked each time

    def run(commands, **environment):
        lines = "".join("\t".join(map(str, command)) + "\n" for command in commands)
        bare = {"PATH": path, "MALLOC_PERTURB_": "165", **environment}  # freed memory is overwritten
        done = subprocess.run([program], input=lines.encode(), env=bare, capture_output=True, timeout=100)
        text = done.stdout.decode()
        assert done.returncode == 0, f"the host died with {done.returncode}:\n{text}\n{done.stderr.decode()}"
        said = [line for line in text.splitlines() if line.startswith("log ")]
        return [line for line in text.splitlines() if not line.startswith("log ")], said

    return run


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """shared(name): an FMU extracted once, beside whose sources Python keeps what it compiled of them."""
    return cache(lambda name: Extracted(built(name), tmp_path_factory.mktemp("extracted") / name))


@pytest.fixture
def extracted(shared, tmp_path):
    """extracted(name, folder=None): an FMU in a folder, of its own where that is named."""
    yield lambda name, folder=None: Extracted(built(name), tmp_path / folder) if folder else shared(name)
    shutil.rmtree(tmp_path, ignore_errors=True)
