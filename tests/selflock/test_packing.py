"""Every FMU that `selflock build` makes: a description that checkers and people like."""

import io
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from selflock.fmus.errors import BuildError
from selflock.packing import build

NAMES = ("Reducer", "Motor", "Controller", "Load", "Sensor", "Robot", "Setpoints")


@pytest.fixture(scope="module")
def packed(tmp_path_factory):
    return {path.stem: path for path in build(tmp_path_factory.mktemp("fmus"))}


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.slow
def test_the_description_says_all_there_is_to_say(packed, name):
    assert set(packed) == set(NAMES) and validate_fmu(str(packed[name])) == []
    with zipfile.ZipFile(packed[name]) as archive:
        root = etree.parse(io.BytesIO(archive.read("modelDescription.xml"))).getroot()
        page, icon = archive.read("documentation/index.html").decode(), archive.read("model.png")
    schema = etree.XMLSchema(etree.parse(str(Path(fmpy.__file__).parent / "schema" / "fmi2" / "fmi2ModelDescription.xsd")))
    assert schema.validate(root), schema.error_log
    variables = root.findall("ModelVariables/ScalarVariable")
    by_kind = {kind: [str(k) for k, v in enumerate(variables, 1) if v.get("causality") == kind] for kind in ("input", "output")}
    outputs = root.findall("ModelStructure/Outputs/Unknown")
    assert [u.get("index") for u in outputs] == by_kind["output"]
    assert all(set(u.get("dependencies").split()) <= set(by_kind["input"]) for u in outputs)
    assert [u.get("index") for u in root.iterfind("ModelStructure/InitialUnknowns/Unknown")] == by_kind["output"]
    assert float(root.find("DefaultExperiment").get("stepSize")) == 1e-3
    assert {"logStatusError", "logAll"} <= {c.get("name") for c in root.iterfind("LogCategories/Category")}
    units = {unit.get("name"): unit.find("BaseUnit") for unit in root.iterfind("UnitDefinitions/Unit")}
    assert all(base is not None for base in units.values())
    assert "N.m" not in units or {k: v for k, v in units["N.m"].attrib.items() if v != "0"} == {"kg": "1", "m": "2", "s": "-2"}
    for v in variables:
        number, place = v[0], v.get("name")
        limits = [float(number.get(key)) for key in ("min", "start", "max") if number.tag == "Real" and number.get(key)]
        assert limits == sorted(limits), place
        assert number.get("unit") != "N" or v.get("causality") == "parameter" or float(number.get("nominal")) > 1.0, place
        assert f"<td>{place}</td>" in page or f"<td>{place} [" in page, place  # each variable is in the page
    assert "<svg" in page and icon.startswith(b"\x89PNG")


def test_a_name_that_is_none_is_told(tmp_path):
    with pytest.raises(BuildError, match="no FMU 'Engine'"):
        build(tmp_path, ["Engine"])
