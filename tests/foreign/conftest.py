"""A host that is not Python: host.c, compiled once, fed with commands."""

import os
import shutil
import subprocess
import sysconfig
import zipfile
from pathlib import Path

import pytest
from fmpy import read_model_description

from fmus import loader
from fmus.build import built

HERE = Path(__file__).parent


@pytest.fixture(scope="session")
def host(tmp_path_factory):
    """host(commands, **environment) -> (answers, log): one line each; commands are tuples of words."""
    if loader.compiler() is None:
        pytest.skip("no C compiler for x86-64 Linux here: FMUs for hosts other than Python cannot be made")
    if not sysconfig.get_config_var("Py_ENABLE_SHARED"):
        pytest.skip("this Python has no shared library, which a host other than Python needs")
    program = tmp_path_factory.mktemp("host") / "host"
    subprocess.run([loader.compiler(), "-O1", "-Wall", "-Werror", "-o", program, HERE / "host.c", "-ldl", "-lpthread"], check=True)

    def run(commands, **environment):
        lines = "".join("\t".join(map(str, command)) + "\n" for command in commands)
        bare = {"PATH": os.environ["PATH"], "MALLOC_PERTURB_": "165", **environment}  # freed memory is overwritten
        done = subprocess.run([program], input=lines.encode(), env=bare, capture_output=True, timeout=100)
        text = done.stdout.decode()
        assert done.returncode == 0, f"the host died with {done.returncode}:\n{text}\n{done.stderr.decode()}"
        said = [line for line in text.splitlines() if line.startswith("log ")]
        return [line for line in text.splitlines() if not line.startswith("log ")], said

    return run


class Extracted:
    """An FMU in a folder: its library, the URI of its resources, its value references."""

    def __init__(self, path, folder):
        self.folder = folder
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder)
        description = read_model_description(path)
        self.description = description
        self.library = folder / "binaries" / "linux64" / f"{description.modelName}.so"
        self.uri = (folder / "resources").as_uri()
        self.vr = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.outputs = [v.name for v in description.modelVariables if v.causality == "output" and v.type == "Real"]


@pytest.fixture
def extracted(tmp_path):
    def extract(name, folder=None):
        return Extracted(built(name), tmp_path / (folder or name))

    yield extract
    shutil.rmtree(tmp_path, ignore_errors=True)
