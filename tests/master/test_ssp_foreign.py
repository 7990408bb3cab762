"""The SSP files that others made, where ../shared/foreign is: each runs, or is refused for a reason that is its own."""

import zipfile
from pathlib import Path

import pytest

from selflock import master
from selflock.master.errors import DescriptionError

FOREIGN = Path(__file__).parents[2].parent / "shared" / "foreign"
pytestmark = pytest.mark.skipif(not FOREIGN.exists(), reason="the models of others are not in ../shared/foreign")
OMS = "OMSimulator_testsuite_tests_resources_"


@pytest.mark.parametrize(
    "name, words",
    [
        (OMS + "invalidSSD", ("SystemStructure.ssd, line 16", "'type'")),
        (OMS + "invalidSSM", ("import_parameter_mapping.ssm, line 12", "'destination'")),
        (OMS + "invalidSSV", ("System1.ssv, line 4", "'type'")),
        ("libcosim_tests_data_ssp_demo", ("CraneController", "lies outside the SSP")),
        ("libcosim_tests_data_ssp_linear_transformation", ("identity1", "lies outside the SSP")),
    ],
)
def test_what_is_broken_in_itself_is_refused_in_a_sentence(name, words):
    with pytest.raises(DescriptionError) as caught:
        master.run(FOREIGN / "ssp" / f"{name}.ssp")
    assert all(word in str(caught.value) for word in words), str(caught.value)


def run(name, **more):
    return master.run(FOREIGN / "ssp" / f"{OMS}{name}.ssp", **more)


def last(name, **more):
    return run(name, **more).table.iloc[-1].to_dict()


def test_a_linear_transformation_of_ssp_2():
    """Add: y = u1 + u2, u1 = 2 · 0 + 3."""
    assert last("LinearTransformation") == {"time": 1.0, "Add1.y": 3.0, "Gain1.y": 0.0}
    driven = last("LinearTransformation", settings={"Gain1.u": 4.0, "Gain1.k": 2.5, "Add1.k2": 2.0, "Add1.u2": 1.0})
    assert driven == {"time": 1.0, "Gain1.y": 10.0, "Add1.y": 2.0 * 10.0 + 3.0 + 2.0}


def test_empty_elements_of_connections():
    """addP: y = k1 · u1 + k2 · u2. Its k1 comes from a connector, 30, whatever the set says of k1 itself; u1 = -20, k2 = -1."""
    result = run("import_export_parameters1", stop=0.01, step=0.01, settings={"addP.u2": 5.0})
    assert result.table["addP.y"].iloc[-1] == 30.0 * -20.0 - 5.0
    assert sum('Element="" is taken as not given' in note for note in result.notes) == 2


def test_parameters_of_a_higher_level_win():
    """-200 · 0 - 300 · 0; what is set is seen where an input is given."""
    assert last("toplevelparameter1", settings={"addP.u1": 1.0, "addP.u2": 0.01})["addP.y"] == pytest.approx(-200.0 - 3.0)


def test_structures_without_fmus_tell_their_connectors():
    """What the files' tests expect after initialization, from their values: mappings, levels, bindings in order."""
    wanted = {
        "importParameterMapping": {"co_sim.Input_1": 20, "co_sim.parameter_1": -30, "System1.Input_2": 20, "System2.parameter_1": -30},
        "importParameterMappingInline": {"co_sim.Input_2": 20, "System1.Input_1": -100, "System2.parameter_2": 70},
        "importStartValues": {"root.C1": -10.5, "System1.C1": -13.5, "System1.C2": 3.5},
        "importStartValues1": {"root.C1": -10.5, "root.C2": -100, "System1.C1": -13.5, "System1.k1": -200},
        "import_hierarchical_ssv_sources": {"System1.Input_1": -10, "System2.Input_1": -30, "System2.Input_2": -100, "System3.Input_1": -70},
    }  # fmt: skip
    for name, values in wanted.items():
        told = last(name, stop=0.01)
        assert {key: told[key] for key in values} == values, name


def test_a_prefix_that_is_not_declared_does_not_stop_it():
    """Its values are read; its FMUs are for Windows only."""
    path = FOREIGN / "ssp" / "ecos_data_ssp_1_0_quarter_truck.ssp"
    system = master.load(path)
    assert (system.run.step, system.run.start, system.run.stop) == (pytest.approx(1e-4), 10.0, 11.0)
    assert system.components["chassis"].start == {"C.mChassis": 400.0, "C.kChassis": 15000.0, "R.dChassis": 1000.0}
    assert len(system.notes) == 2 and all("prefix ssv" in note for note in system.notes)
    with pytest.raises(DescriptionError, match="no binary for this machine"):
        master.run(path, stop=10.001)


def crane(folder):
    """libcosim's demo with its FMUs inside."""
    path = folder / "crane.ssp"
    with zipfile.ZipFile(FOREIGN / "ssp" / "libcosim_tests_data_ssp_demo.ssp") as old, zipfile.ZipFile(path, "w") as new:
        new.writestr("SystemStructure.ssd", old.read("SystemStructure.ssd").decode().replace("../../fmi2/", "resources/"))
        for name in ("CraneController", "KnuckleBoomCrane"):
            new.write(FOREIGN / "fmus" / f"libcosim__{name}.fmu", f"resources/{name}.fmu")
    return path


def test_the_crane_with_its_fmus_inside(tmp_path):
    """Its limit is the mass that the file gives: mt0_init = 69."""
    table = master.run(crane(tmp_path), stop=0.01).table
    assert len(table) == 101 and table["KnuckleBoomCrane.Act_Limits[1]"].iloc[-1] == pytest.approx(69.0, rel=1e-9)
