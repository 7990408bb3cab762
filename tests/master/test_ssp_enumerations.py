"""Enumerations by name and by number, in and out."""

import io
import zipfile

import pytest
from lxml import etree

from selflock import master
from selflock.master.errors import DescriptionError
from selflock.master.ssp import export
from selflock.master.ssp.mend import NAMESPACES

from .test_ssp_read import binding, connection, read_system

ITEMS = '<Item name="glad" value="1"/><Item name="sad" value="2"/>'
NAMED = '<ssc:Enumeration name="Mood"><ssc:Item name="glad" value="1"/><ssc:Item name="sad" value="2"/></ssc:Enumeration>'
LISTED = f"<ssd:Enumerations>{NAMED}</ssd:Enumerations>"


def fmu(items=ITEMS):
    """The description of an FMU with an enumeration in and out, a parameter, and an Integer."""
    rows = (("inside", "input", "discrete"), ("outside", "output", "discrete"), ("mood", "parameter", "fixed"))
    variables = "".join(
        f'<ScalarVariable name="{name}" valueReference="{k}" causality="{causality}" variability="{variability}">'
        f'<Enumeration declaredType="Mood"{" start=" + chr(34) + "1" + chr(34) if causality != "output" else ""}/></ScalarVariable>'
        for k, (name, causality, variability) in enumerate(rows)
    )
    return (
        '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g"><CoSimulation modelIdentifier="m"/>'
        f'<TypeDefinitions><SimpleType name="Mood"><Enumeration>{items}</Enumeration></SimpleType></TypeDefinitions>'
        f'<ModelVariables>{variables}<ScalarVariable name="count" valueReference="9" causality="parameter" variability="fixed">'
        '<Integer start="0"/></ScalarVariable></ModelVariables><ModelStructure/></fmiModelDescription>'
    )


def part(name, source):
    kinds = (("inside", "input"), ("outside", "output"), ("mood", "parameter"))
    rows = "".join(f'<ssd:Connector name="{n}" kind="{k}"><ssc:Enumeration name="Mood"/></ssd:Connector>' for n, k in kinds)
    return f'<ssd:Component name="{name}" source="resources/{source}.fmu"><ssd:Connectors>{rows}</ssd:Connectors></ssd:Component>'


def pair(values=""):
    return (
        f'<ssd:System name="S">{binding(values, units=False)}<ssd:Elements>{part("A", "a")}{part("B", "b")}</ssd:Elements>'
        f"<ssd:Connections>{connection('A.outside', 'B.inside')}</ssd:Connections></ssd:System>"
    )


def given(tmp_path, values, theirs=ITEMS):
    extra = {"resources/a.fmu": fmu(), "resources/b.fmu": fmu(theirs)}
    return read_system(tmp_path, pair(values), units=LISTED, extra=extra)


def value(name, kind, text, more=""):
    return f'<ssv:Parameter name="{name}"><ssv:{kind} value="{text}"{more}/></ssv:Parameter>'


@pytest.mark.parametrize("kind, text", [("Enumeration", "sad"), ("Enumeration", "2"), ("Integer", "2")])
def test_a_value_by_name_and_by_number(tmp_path, kind, text):
    flat = given(tmp_path, value("A.mood", kind, text))
    assert flat.start == {("A", "mood"): 2} and flat.notes == []
    assert flat.connections["B", "inside"][0] == ("A", "outside")


def test_the_number_is_that_of_the_variables_own_items(tmp_path):
    """SSP 1.0, Enumeration: the mapping of names to numbers is the variable's."""
    other = '<Item name="sad" value="7"/><Item name="glad" value="8"/>'
    flat = given(tmp_path, value("A.mood", "Enumeration", "sad") + value("B.mood", "Enumeration", "sad"), theirs=other)
    assert flat.start == {("A", "mood"): 2, ("B", "mood"): 7}


def test_an_integer_takes_the_number_of_the_files_enumeration(tmp_path):
    said = f'<ssv:Parameter name="A.count"><ssv:Enumeration value="sad" name="Mood"/></ssv:Parameter></ssv:Parameters><ssv:Enumerations>{NAMED}</ssv:Enumerations><ssv:Parameters>'
    assert given(tmp_path, said).start == {("A", "count"): 2}


@pytest.mark.parametrize(
    "values, says",
    [
        (value("A.mood", "Enumeration", "angry"), "'angry'; there is: glad = 1, sad = 2"),
        (value("A.mood", "Integer", "3"), "no item 3"),
        (value("A.mood", "Real", "3"), "no item 3"),
        (value("A.count", "Enumeration", "sad"), "no enumeration"),
    ],
)
def test_an_item_that_is_not_there_is_refused(tmp_path, values, says):
    with pytest.raises(DescriptionError, match=says):
        given(tmp_path, values)


def test_numbers_that_mean_something_else_at_the_other_end_are_told(tmp_path):
    flat = given(tmp_path, "", theirs='<Item name="sad" value="1"/><Item name="glad" value="2"/>')
    assert len(flat.notes) == 1 and "1 is 'glad' there, 'sad' here" in flat.notes[0]


@pytest.mark.slow  # the teller has a process of its own
def test_they_are_written_by_name_and_come_back(native, system, tmp_path):
    made = system(
        {"tell": (native("teller"), {"mood": 2, "count_in": 4})}, stop=0.1, step=0.1, record=["tell.mood", "tell.count_out"]
    )
    made.run.open_inputs = True
    path = export(made, tmp_path / "t.ssp")
    with zipfile.ZipFile(path) as whole:
        structure, values = (etree.parse(io.BytesIO(whole.read(name))) for name in ("SystemStructure.ssd", "resources/tell.ssv"))
    (connector,) = structure.iterfind(".//ssd:Connector[@name='mood']", NAMESPACES)
    assert [(c.tag, dict(c.attrib)) for c in connector] == [(f"{{{NAMESPACES['ssc']}}}Enumeration", {"name": "Mood"})]
    for document, prefix in ((structure, "ssd"), (values, "ssv")):
        (items,) = document.iterfind(f"{prefix}:Enumerations/ssc:Enumeration[@name='Mood']", NAMESPACES)
        assert [(item.get("name"), item.get("value")) for item in items] == [("glad", "1"), ("sad", "2")]
    assert values.find(".//ssv:Parameter[@name='mood']/ssv:Enumeration", NAMESPACES).get("value") == "sad"
    again = master.load(path)
    assert again.components["tell"].start == {"mood": 2, "count_in": 4} and again.notes == []
