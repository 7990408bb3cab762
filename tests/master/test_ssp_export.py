"""Writing SSP 1.0: every document valid, everything a system says carried over, the same bytes twice."""

import io
import json
import zipfile
from pathlib import Path

import fmpy
import fmpy.ssp
import pytest
from lxml import etree

from selflock import master
from selflock.master.ssp import export

SCHEMAS = Path(fmpy.ssp.__file__).parent / "schema"
SPACES = {
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
}


def lift(counter, teller):
    """A system that uses all that a system file knows, but faults: two drives with names that are no file names."""
    return master.from_dict(
        {
            "system": {"name": "lift ü", "description": "two motors <and> a load"},
            "run": {
                "stop": 0.2,
                "step": 0.002,
                "algorithm": "jacobi",
                "open_inputs": True,
                "interval": 0.01,
                "record": ["left motor.torque", "left motor.speed", "left_motor.torque", "load.*", "count.word", "tell.*"],
                "order": ["load", "left motor", "left_motor", "watch", "count", "tell"],
            },
            "components": {
                "left motor": {"fmu": "selflock:Motor", "step": 0.001, "start": {"voltage": 12.0, "resistance": 1 / 3}},
                "left_motor": {"fmu": "selflock:Motor", "start": {"voltage": -2.0, "inductance": 0.0}},
                "load": {"fmu": "selflock:Load", "start": {"inertia": 0.01}},
                "watch": {"fmu": "selflock:Sensor", "start": {"resolution": 0.25}},
                "count": {"fmu": counter, "process": True, "start": {"gain": 0.1}},
                "tell": {"fmu": teller, "start": {"count_in": 3, "flag_in": True, "word_in": "a < b & ü", "mood": 2}},
            },
            "connections": {
                "left motor.speed": {"from": "load.speed", "factor": 7.0, "offset": 0.125},
                "left_motor.speed": "load.speed",
                "load.torque": {"from": "left motor.torque", "factor": 1 / 7},
                "watch.value": {"from": "load.angle", "convert": False},
                "count.u": "watch.reading",
            },
            "bonds": [{"effort": "left motor.torque", "flow": "load.speed", "name": "shaft"}],
        }
    )


@pytest.fixture(scope="module")
def packed(counter, native, tmp_path_factory):
    return export(lift(counter, native("teller")), tmp_path_factory.mktemp("packed") / "lift.ssp")


def documents(path):
    """name -> parsed document, each held to the schema that FMPy ships."""
    found = {}
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            if name.endswith((".ssd", ".ssv", ".ssm")):
                root = etree.parse(io.BytesIO(archive.read(name))).getroot()
                kind = {"ssd": "Description", "ssv": "ParameterValues", "ssm": "ParameterMapping"}[name[-3:]]
                schema = etree.XMLSchema(etree.parse(str(SCHEMAS / f"SystemStructure{kind}.xsd")))
                assert schema.validate(root), schema.error_log
                found[name] = root
    return found


@pytest.mark.slow
def test_every_document_is_valid_and_every_file_is_there(packed):
    found = documents(packed)
    sets = [b.get("source") for b in found["SystemStructure.ssd"].iterfind(".//ssd:ParameterBinding", SPACES)]
    assert len(set(sets)) == len(sets) == 6  # "left motor" and "left_motor" have a file each
    with zipfile.ZipFile(packed) as archive:
        names = archive.namelist()
        assert len(names) == len(set(names)) and all(name.isascii() and " " not in name for name in names)
        fmus = [c.get("source") for c in found["SystemStructure.ssd"].iterfind(".//ssd:Component", SPACES)]
        assert fmus[0] == fmus[1] == "resources/Motor.fmu" and len(set(fmus)) == 5
        for name in fmus:
            assert fmpy.read_model_description(io.BytesIO(archive.read(name)), validate=False).fmiVersion == "2.0"
        page = archive.read("documentation/index.html").decode()
    assert "two motors &lt;and&gt; a load" in page and "left motor.torque" in page and "a &lt; b &amp; ü" in page


def test_units_mean_what_the_fmus_say(packed):
    root = documents(packed)["SystemStructure.ssd"]
    units = {unit.get("name"): dict(unit[0].attrib) for unit in root.iterfind("ssd:Units/ssc:Unit", SPACES)}
    assert units["N.m"] == {"kg": "1", "m": "2", "s": "-2"} and units["rad/s"] == {"rad": "1", "s": "-1"}
    said = {real.get("unit") for real in root.iterfind(".//ssc:Real", SPACES)} - {None}
    assert said <= set(units)
    value = documents(packed)["resources/left_motor1.ssv"].find(".//ssv:Parameter[@name='resistance']/ssv:Real", SPACES)
    assert (float(value.get("value")), value.get("unit")) == (1 / 3, "Ohm")


def test_factors_offsets_and_conversions(packed):
    root = documents(packed)["SystemStructure.ssd"]
    said = {
        (c.get("endElement"), c.get("endConnector")): (c.get("suppressUnitConversion"), dict(c[0].attrib) if len(c) else {})
        for c in root.iterfind(".//ssd:Connection", SPACES)
    }
    assert said["left motor", "speed"] == (None, {"factor": "7.0", "offset": "0.125"})
    assert said["left_motor", "speed"] == (None, {})
    assert said["watch", "value"] == ("true", {})


def test_what_ssp_has_no_place_for_is_in_our_annotation(packed):
    root = documents(packed)["SystemStructure.ssd"]
    experiment = root.find("ssd:DefaultExperiment", SPACES)
    assert (float(experiment.get("startTime")), float(experiment.get("stopTime"))) == (0.0, 0.2)
    annotation = root.find(".//ssc:Annotation", SPACES)
    assert annotation.get("type") == "org.selflock.run"
    said = json.loads(annotation[0].text)
    assert said["run"]["step"] == 0.002 and said["run"]["algorithm"] == "jacobi" and said["run"]["order"][0] == "load"
    assert said["components"] == {"left motor": {"step": 0.001}, "count": {"process": True}}


@pytest.mark.in_turn
@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_it_runs_as_the_system_it_was_made_of(counter, native, tmp_path, algorithm):
    system = lift(counter, native("teller"))
    system.run.algorithm = algorithm
    system.components["left motor"].samples = True
    first = master.run(system)
    again = master.load(export(system, tmp_path / "lift.ssp"))
    assert (again.run, again.bonds) == (system.run, system.bonds)
    assert again.components["count"].process and again.components["left motor"].step == 0.001
    assert [c.samples for c in again.components.values()] == [c.samples for c in system.components.values()]
    table = master.run(again).table
    assert table.equals(first.table) and len(table) == 21
    assert table["tell.word_out"].iloc[-1] == "a < b & ü!" and table["load.speed"].iloc[-1] > 0.1


def test_step_control_comes_back(system, native, tmp_path):
    made = system(
        {"r": (native("relaxation"), {"rate": 3.0, "u": 0.0})}, stop=1.0, step=0.1, step_control="doubling", tolerance=1e-6
    )
    assert master.run(export(made, tmp_path / "r.ssp")).table.equals(master.run(made).table)


@pytest.mark.slow
def test_an_archive_that_another_tool_has_changed_still_runs(packed, tmp_path):
    """One component less than our annotation tells of: the order is then that of the file."""
    changed = tmp_path / "changed.ssp"
    with zipfile.ZipFile(packed) as old, zipfile.ZipFile(changed, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "SystemStructure.ssd":
                root = etree.fromstring(content)
                gone = root.find(".//ssd:Component[@name='tell']", SPACES)
                gone.getparent().remove(gone)
                content = etree.tostring(root).replace(b', "tell.*"', b"")
            new.writestr(name, content)
    system = master.load(changed)
    assert system.run.order == [] and system.run.step == 0.002 and "tell" not in system.components
    assert len(master.run(system).table) == 21


@pytest.mark.slow
def test_the_same_bytes_twice(counter, native, tmp_path):
    first, second = (export(lift(counter, native("teller")), tmp_path / name / "a.ssp").read_bytes() for name in "ab")
    assert first == second


@pytest.mark.slow
def test_parts_in_process_are_packed_as_fmus(tmp_path):
    made = master.from_dict(
        {
            "run": {"stop": 0.5, "step": 0.01, "open_inputs": True, "record": ["setpoints.*", "control.voltage"]},
            "components": {
                "setpoints": {"part": "selflock.study.manoeuvre:Setpoints"},
                "control": {"fmu": "selflock:Controller"},
            },
            "connections": {"control.angle_setpoint": "setpoints.rear_angle", "control.speed_setpoint": "setpoints.rear_speed"},
        }
    )
    path = export(made, tmp_path / "s.ssp")
    with zipfile.ZipFile(path) as archive:
        assert "resources/Setpoints.fmu" in archive.namelist()
    inside, packed = master.run(made).table, master.run(path).table
    for name in inside:  # the master computes t + h, an FMU is given t and h
        assert packed[name].to_numpy() == pytest.approx(inside[name].to_numpy(), rel=1e-13, abs=1e-300)


def test_what_cannot_be_written_is_refused_by_name(system, counter, tmp_path, refused):
    made = system({"a": (counter, {"u": 1.0})})
    refused(lambda: export(made, tmp_path / "a.zip"), "a.zip", "ends in .ssp")
    refused(lambda: export(system({"a": ("Small", {})}), tmp_path / "a.ssp"), "a: small_parts:Small", "cannot be packed")
    made.faults = [master.system.Fault("a.u", "drop-out", 0.1)]
    refused(lambda: export(made, tmp_path / "a.ssp"), "[[faults]]", "no place in SSP")
    assert list(tmp_path.iterdir()) == []
