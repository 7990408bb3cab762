"""Systems that others made, in our Jacobi and in libcosim and Ecos: where ../shared/foreign and the extra `masters` are.

Of the SSP files there, these are all that a peer runs too: Ecos takes no SSP 2.0, and neither takes `startElement=""`.
"""

import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from selflock import master
from selflock.master.ssp import export

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
import others  # noqa: E402

FOREIGN = HERE.parents[1].parent / "shared" / "foreign"
SSP = FOREIGN / "ssp"
foreign = pytest.mark.skipif(not FOREIGN.exists(), reason="the models of others are not in ../shared/foreign")


def peer(name):
    try:
        __import__({"libcosim": "libcosimpy", "ecos": "ecospy"}[name])
    except (ImportError, OSError) as error:
        pytest.skip(f"{name} cannot be loaded ({error}); install the extra `masters`, and libtbb12 for Ecos")
    return getattr(others, name)


def agree(theirs, path, step, count):
    """Every Real output from the first step on, to 1e-9 of its largest value."""
    system = master.load(path)
    system.run.step, system.run.algorithm = step, "jacobi"
    table = master.run(system, stop=system.run.start + step * count).table
    worst = {
        name: float(np.max(np.abs(column[1:] - table[name].to_numpy()[1:])) / (np.max(np.abs(column[1:])) or 1.0))
        for name, column in theirs.items()
    }
    assert worst and max(worst.values()) <= 1e-9, worst
    return table


@pytest.fixture(scope="module")
def crane(tmp_path_factory):
    """libcosim's demo with its FMUs inside it; they lie outside where it comes from."""
    path = tmp_path_factory.mktemp("ssp") / "crane.ssp"
    with zipfile.ZipFile(SSP / "libcosim_tests_data_ssp_demo.ssp") as old, zipfile.ZipFile(path, "w") as new:
        new.writestr("SystemStructure.ssd", old.read("SystemStructure.ssd").decode().replace("../../fmi2/", "resources/"))
        for name in ("CraneController", "KnuckleBoomCrane"):
            new.write(FOREIGN / "fmus" / f"libcosim__{name}.fmu", f"resources/{name}.fmu")
    return path


@foreign
@pytest.mark.parametrize("name, more", [("libcosim", ()), ("ecos", ("initialValues",))])
def test_the_crane(crane, name, more):
    table = agree(peer(name)(crane, 1e-4, 200, *more), crane, 1e-4, 200)
    assert table["KnuckleBoomCrane.Act_Limits[1]"].iloc[-1] == pytest.approx(69.0, rel=1e-9)
    assert np.abs(table["CraneController.p_Crane.e[3]"]).max() > 1e5  # it is held up


@foreign
@pytest.mark.parametrize(
    "name, file",
    [("libcosim", "LinearTransformation"), ("libcosim", "toplevelparameter1"), ("ecos", "toplevelparameter1")],
)
def test_omsimulators(name, file):
    path = SSP / f"OMSimulator_testsuite_tests_resources_{file}.ssp"
    agree(peer(name)(path, 1e-3, 20), path, 1e-3, 20)


def test_what_we_write_as_ssp_2_runs_in_libcosim(tmp_path):
    path = export(HERE / "servo.toml", tmp_path / "servo.ssp", version="2.0")
    agree(peer("libcosim")(path, 1e-3, 200), path, 1e-3, 200)
