"""SSP 2.0 beside 1.0: its namespaces are those of 1.0, its version says 2.0, and FMI 3.0's types are there."""

import zipfile

import pytest
from lxml import etree

from selflock import master
from selflock.master.errors import DescriptionError
from selflock.master.ssp import export, read

from .test_ssp_read import SINK, SOURCE, A, B, archive, component, connection, flat_pair, read_system

META = '<ssc:MetaData kind="quality" type="text/plain"><ssc:Content>good</ssc:Content></ssc:MetaData>'
VARIANT = '<ssd:SSDVariant name="v" baseSSD="SystemStructure.ssd" kind="parameterVariant"/>'


def second(tmp_path, system, tail="<ssd:DefaultExperiment/>", version="2.0"):
    path = archive(tmp_path / "a.ssp", system, tail=tail, extra={"resources/source.fmu": SOURCE, "resources/sink.fmu": SINK})
    with zipfile.ZipFile(path) as whole:
        files = {name: whole.read(name) for name in whole.namelist()}
    for name, content in files.items():
        if name.endswith(".ssd"):
            files[name] = content.replace(b'version="1.0" name="hand"', f'version="{version}" name="hand"'.encode())
    with zipfile.ZipFile(path, "w") as changed:
        for name, content in files.items():
            changed.writestr(name, content)
    return read(path, tmp_path / "unpacked")


def bound(parameters, version="2.0"):
    return (
        f'<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="{version}" name="p">'
        f"<ssv:Parameters>{parameters}</ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>"
    )


def test_it_reads_as_the_same_file_in_the_words_of_the_first(tmp_path):
    new = A.replace('"y" kind="output"/>', '"y" kind="output"><ssc:Float64 unit="deg"/></ssd:Connector>')
    old = new.replace("Float64", "Real")
    values = '<ssv:Parameter name="B.p"><ssv:{} value="3"/></ssv:Parameter>'
    first = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), inner_a=old, bindings=bound(values.format("Real"), "1.0")))
    for version in ("2.0", "2.1", "2.0-rc.1"):
        system = flat_pair(
            connection("A.y", "B.u"), inner_a=new + META.join(["", ""]), bindings=bound(values.format("Float64"), version)
        )
        flat = second(
            tmp_path, system, tail=f'<ssd:DefaultExperiment startTime="1" stopTime="4"/>{META}{VARIANT}', version=version
        )
        assert (flat.connections, flat.start) == (first.connections, first.start) and flat.notes == []


def test_whole_numbers_and_values_in_elements(tmp_path):
    given = '<ssv:Parameter name="B.p"><ssv:Int32 value="3"/></ssv:Parameter><ssv:Parameter name="A.p"><ssv:UInt8 value="4"/></ssv:Parameter>'
    assert second(tmp_path, flat_pair(connection("A.y", "B.u"), bindings=bound(given))).start == {("B", "p"): 3, ("A", "p"): 4}
    word = '<ssv:Parameter name="B.p"><ssv:String><ssv:Value>a word</ssv:Value></ssv:String></ssv:Parameter>'
    assert second(tmp_path, flat_pair(connection("A.y", "B.u"), bindings=bound(word))).start == {("B", "p"): "a word"}


def test_a_component_without_a_source_gives_nothing(tmp_path):
    flat = second(tmp_path, flat_pair(connection("A.y", "B.u"), inner_a=A.replace(' source="resources/source.fmu"', "")))
    assert flat.connections == {} and list(flat.fmus) == ["B"]
    assert len(flat.notes) == 1 and "A has no source" in flat.notes[0]


def test_a_local_variable_gives_as_an_output(tmp_path):
    pins = '<ssd:Connectors><ssd:Connector name="out" kind="local"/></ssd:Connectors>'
    inner = f'<ssd:System name="In">{pins}<ssd:Elements>{A}</ssd:Elements><ssd:Connections>{connection("A.y", "out")}</ssd:Connections></ssd:System>'
    assert second(tmp_path, flat_pair(connection("In.out", "B.u"), inner_a=inner)).connections["B", "u"][0] == ("In/A", "y")


@pytest.mark.parametrize(
    "system, says",
    [
        (flat_pair(connection("A.y", "B.u"), inner_b=B.replace('"u" kind="input"/>', '"u" kind="input"><ssc:Float64/><ssc:Dimension size="3"/></ssd:Connector>')), "'u' has 1 dimensions; in its FMU it is no array"),
        (flat_pair(connection("A.y", "B.u", "", ' endIndices="1"')), "u is no array, and a connection names its element 1"),
        (flat_pair(connection("A.y", "B.u"), inner_b=component("B", "sink", [("u", "input")]).replace("<ssd:Component ", '<ssd:Component implementation="ScheduledExecution" ')), "ScheduledExecution"),
        (flat_pair(connection("A.y", "B.u"), bindings=bound('<ssv:Parameter name="B.p"><ssv:String><ssv:Value>a</ssv:Value><ssv:Value>b</ssv:Value></ssv:String></ssv:Parameter>')), "B.p is given 2 values, and is no array"),
    ],
)  # fmt: skip
def test_what_fmi_2_has_no_place_for_is_refused_by_name(tmp_path, system, says):
    with pytest.raises(DescriptionError, match=says):
        second(tmp_path, system)


def test_a_third_version_is_refused(tmp_path):
    with pytest.raises(DescriptionError, match="version '3.0' of SSP is not known"):
        second(tmp_path, flat_pair(connection("A.y", "B.u")), version="3.0")


def test_it_is_written_as_asked(native, system, tmp_path, refused):
    made = system({"r": (native("relaxation"), {"rate": 3.0, "u": 1.0})}, stop=1.0, step=0.1)
    path = export(made, tmp_path / "second.ssp", version="2.0")
    with zipfile.ZipFile(path) as whole:
        for name in whole.namelist():
            if name.endswith((".ssd", ".ssv")):
                assert etree.fromstring(whole.read(name)).get("version") == "2.0"
    assert master.run(path).table.equals(master.run(made).table) and master.load(path).notes == []
    refused(lambda: export(made, tmp_path / "third.ssp", version="3.0"), '"3.0"', "1.0, 2.0")
