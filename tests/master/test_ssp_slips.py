"""Slips that real SSP files have: mended and told where the meaning is clear, refused in a sentence where it is not."""

import math
import zipfile

import pytest

from selflock import master
from selflock.master import ssp
from selflock.master.errors import DescriptionError
from selflock.master.ssp import read
from selflock.master.ssp.flat import Affine

from .test_ssp_read import (
    SINK,
    SOURCE,
    UNITS,
    A,
    B,
    archive,
    binding,
    component,
    connection,
    flat_pair,
    mapped,
    read_system,
    real,
)

NAMES = {"resources/source.fmu": SOURCE, "resources/sink.fmu": SINK}


def told(flat, *words):
    """The one note that holds all these words."""
    found = [note for note in flat.notes if all(word in note for word in words)]
    assert len(found) == 1, flat.notes
    return found[0]


def test_a_file_without_slips_has_nothing_told(tmp_path):
    assert read_system(tmp_path, flat_pair(connection("A.y", "B.u"))).notes == []


def test_empty_attributes_are_none(tmp_path):
    inner = B.replace('"p" kind="parameter"/>', '"p" kind="parameter"><ssc:Real unit=""/></ssd:Connector>')
    link = '<ssd:Connection startElement="" startConnector="pin" endElement="B" endConnector="p" suppressUnitConversion=""/>'
    pin = '<ssd:Connectors><ssd:Connector name="pin" kind="parameter"/></ssd:Connectors>'
    system = f'<ssd:System name="S">{pin}{binding(real("pin", 2, ""))}<ssd:Elements>{A}{inner}</ssd:Elements><ssd:Connections>{link}</ssd:Connections></ssd:System>'
    flat = read_system(tmp_path, system, tail='<ssd:DefaultExperiment startTime="" stopTime="4"/>')
    assert flat.start == {("B", "p"): 2.0} and (flat.start_time, flat.stop_time) == (0.0, 4.0)
    for words in (
        ('startElement=""', "SystemStructure.ssd, line 6"),
        ('unit=""',),
        ('startTime=""',),
        ('suppressUnitConversion=""',),
    ):
        told(flat, *words)


def test_a_prefix_that_is_not_declared_is_the_standards(tmp_path):
    values = f'<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>{real("p", 1, "")}</ssv:Parameters></ssv:ParameterSet>'
    bound = '<ssd:ParameterBindings><ssd:ParameterBinding source="b.ssv"/></ssd:ParameterBindings>'
    inner = component("B", "sink", [("u", "input")], bound)
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), inner_b=inner), extra=NAMES | {"b.ssv": values})
    assert flat.start == {("B", "p"): 1.0}
    told(flat, "b.ssv", "prefix ssv")
    for broken in (values[:-20], values.replace("<ssv:Parameters>", "<none:Parameters>", 1)):
        with pytest.raises(DescriptionError, match="b.ssv"):
            read_system(tmp_path, flat_pair(connection("A.y", "B.u"), inner_b=inner), extra=NAMES | {"b.ssv": broken})


def test_osps_annotations_without_their_prefix_are_heard(native, tmp_path):
    said = '<ssc:Annotation type="com.opensimulationplatform"><osp:Algorithm><osp:FixedStepAlgorithm baseStepSize="0.02"/></osp:Algorithm></ssc:Annotation>'
    tail = f"<ssd:DefaultExperiment><ssd:Annotations>{said}</ssd:Annotations></ssd:DefaultExperiment>"
    system = f'<ssd:System name="S"><ssd:Elements>{component("A", "f", [])}</ssd:Elements></ssd:System>'.replace(
        "<ssd:Connectors></ssd:Connectors>", ""
    )
    path = archive(tmp_path / "a.ssp", system, tail=tail)
    with zipfile.ZipFile(path, "a") as out:
        out.write(native("forgetful"), "resources/f.fmu")
    made = ssp.load(path)
    assert (made.run.step, made.run.algorithm) == (0.02, "jacobi") and len(made.notes) == 1 and "prefix osp" in made.notes[0]
    assert made.notes[0] in master.run(made, stop=0.1).summary()


def test_elements_in_another_order_and_lists_twice(tmp_path):
    one, two = binding(real("B.p", 1, "")), binding(real("B.p", 2, "") + real("A.p", 3, ""))
    links = f"<ssd:Connections>{connection('A.y', 'B.u')}</ssd:Connections>"
    flat = read_system(
        tmp_path, f'<ssd:System name="S">{links}{one}<ssd:Elements>{A}{B}</ssd:Elements>{two}<ssd:Connectors/></ssd:System>'
    )
    assert flat.start == {("B", "p"): 2.0, ("A", "p"): 3.0} and ("B", "u") in flat.connections
    told(flat, "second ParameterBindings")
    told(flat, "another order")


@pytest.mark.slow  # where it is the first that asks pint
def test_a_unit_that_is_not_declared_goes_by_its_name(tmp_path):
    said = A.replace('"y" kind="output"/>', '"y" kind="output"><ssc:Real unit="deg"/></ssd:Connector>')
    values = binding(real("B.p", 180, "deg") + real("B.v", 20, "degC"), units=False)
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), inner_a=said, bindings=values), units="")
    assert flat.connections["B", "u"][1].factor == pytest.approx(math.pi / 180)
    assert flat.start == {("B", "p"): pytest.approx(math.pi), ("B", "v"): pytest.approx(293.15)}
    told(flat, "'deg'")
    with pytest.raises(DescriptionError, match="nobody knows the unit quirks"):
        read_system(
            tmp_path,
            flat_pair(bindings=binding(real("B.p", 1, "quirks"), units=False)).replace("<ssd:Connections></ssd:Connections>", ""),
        )


def test_start_and_end_say_nothing_of_the_direction(tmp_path):
    """SSP 1.0, Connections: it is that of the connectors' kinds. The transformation acts on what is given."""
    change = '<ssc:LinearTransformation factor="2" offset="1"/>'
    for ends in (("A.y", "B.u"), ("B.u", "A.y")):
        flat = read_system(tmp_path, flat_pair(connection(*ends, change, ' suppressUnitConversion="true"')))
        assert flat.connections == {("B", "u"): (("A", "y"), Affine(2.0, 1.0))} and flat.notes == []


def test_a_system_connector_without_a_unit_has_that_of_its_neighbours(tmp_path):
    """deg goes through a connector that says nothing and arrives in rad; so does a value in deg given there."""
    pins = (
        '<ssd:Connectors><ssd:Connector name="out" kind="output"/><ssd:Connector name="pin" kind="parameter"/></ssd:Connectors>'
    )
    links = connection("A.y", "out") + connection("pin", "A.p")
    inner = f'<ssd:System name="In">{pins}<ssd:Elements>{A}</ssd:Elements><ssd:Connections>{links}</ssd:Connections></ssd:System>'
    flat = read_system(
        tmp_path, flat_pair(connection("In.out", "B.u"), inner_a=inner, bindings=binding(real("In.pin", 180, "deg")))
    )
    assert flat.connections["B", "u"][1](180.0) == pytest.approx(math.pi)
    assert flat.start["In/A", "p"] == pytest.approx(math.pi)


def test_connectors_that_are_not_listed_or_not_there(tmp_path):
    bare = component("A", "source", [("none", "output"), ("p", "parameter")])
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), inner_a=bare))
    assert flat.connections["B", "u"][0] == ("A", "y")
    told(flat, "A.y", "no connector")
    told(flat, "'none'", "not a variable")
    with pytest.raises(DescriptionError, match="'A.none', which is not a connector"):
        read_system(tmp_path, flat_pair(connection("A.none", "B.u"), inner_a=bare))


def test_values_that_find_no_place_are_told(tmp_path):
    """SSP 1.0, ParameterBindings: what no name matches is not used, and with a mapping what it does not name."""
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), bindings=binding(real("B.q", 1) + real("B.p", 2))))
    assert flat.start == {("B", "p"): 2.0}
    told(flat, "'B.q'", "not used")
    flat = read_system(tmp_path, mapped('<ssm:MappingEntry source="x" target="B.p"/>', real("x", 1) + real("B.u", 2)))
    assert flat.start == {("B", "p"): 1.0}
    told(flat, "B.u", "mapping")


def test_what_a_connector_gives_wins_over_what_is_given_at_its_end(tmp_path):
    """A connected parameter has the value of its connection, whichever of the two is said last."""
    pins = '<ssd:Connectors><ssd:Connector name="pin" kind="parameter"/></ssd:Connectors>'
    for values in (real("pin", 1) + real("B.p", 2), real("B.p", 2) + real("pin", 1)):
        system = f'<ssd:System name="S">{pins}{binding(values)}<ssd:Elements>{A}{B}</ssd:Elements><ssd:Connections>{connection("pin", "B.p")}</ssd:Connections></ssd:System>'
        assert read_system(tmp_path, system).start == {("B", "p"): 1.0}


def test_connectors_in_a_circle(tmp_path):
    pins = '<ssd:Connectors><ssd:Connector name="i" kind="input"/><ssd:Connector name="o" kind="output"/></ssd:Connectors>'
    inner = f'<ssd:System name="In">{pins}<ssd:Connections>{connection("i", "o")}</ssd:Connections></ssd:System>'
    for values in ("", binding(real("In.i", 1))):
        system = f'<ssd:System name="S">{values}<ssd:Elements>{inner}{A}{B}</ssd:Elements><ssd:Connections>{connection("In.o", "In.i")}{connection("In.o", "B.u")}</ssd:Connections></ssd:System>'
        with pytest.raises(DescriptionError, match="circle"):
            read_system(tmp_path, system)


def test_the_same_connection_twice(tmp_path):
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), connection("A.y", "B.u")))
    assert flat.connections["B", "u"][0] == ("A", "y")
    told(flat, "twice")


def test_a_unit_that_its_file_defines_otherwise_than_the_fmu(tmp_path):
    """deg without its factor: the numbers at the FMU's face are in the FMU's."""
    said = A.replace('"y" kind="output"/>', '"y" kind="output"><ssc:Real unit="deg"/></ssd:Connector>')
    wrong = '<ssd:Units><ssc:Unit name="deg"><ssc:BaseUnit rad="1"/></ssc:Unit></ssd:Units>'
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), inner_a=said), units=wrong)
    assert flat.connections["B", "u"][1].factor == pytest.approx(math.pi / 180)
    told(flat, "'deg'", "another unit")


@pytest.mark.parametrize("old, new", [("SystemStructure.ssd", "Model.ssd"), ("", "folder/")])
def test_packed_with_its_folder_or_by_another_name(tmp_path, old, new):
    path = archive(tmp_path / "a.ssp", flat_pair(connection("A.y", "B.u")), extra=NAMES)
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(tmp_path / "b.ssp", "w") as out:
        for name in whole.namelist():
            out.writestr(name.replace(old, new, 1) if old else new + name, whole.read(name))
    flat = read(tmp_path / "b.ssp", tmp_path / "unpacked")
    assert flat.connections["B", "u"][0] == ("A", "y")
    told(flat, "b.ssp", new)


def test_the_system_itself_by_its_name(tmp_path):
    """In a connection and in a parameter set the name of what they are in is that; the standard has it left out."""
    pins = '<ssd:Connectors><ssd:Connector name="pin" kind="parameter"/></ssd:Connectors>'
    inner = component("A", "source", [("p", "parameter")], binding(real("A.p", 3)))
    links = f"<ssd:Connections>{connection('S.pin', 'B.p')}</ssd:Connections>"
    system = f'<ssd:System name="S">{pins}{binding(real("S.pin", 2))}<ssd:Elements>{inner}{B}</ssd:Elements>{links}</ssd:System>'
    flat = read_system(tmp_path, system)
    assert flat.start == {("A", "p"): 3.0, ("B", "p"): 2.0}
    told(flat, "connection", "'S'")
    told(flat, "parameter set of S", "'S.pin'")
    told(flat, "parameter set of A", "'A.p'")


def test_paths_of_windows(tmp_path):
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), inner_a=A.replace("resources/source", "Resources\\Source")))
    assert flat.fmus["A"].name == "source.fmu"
    told(flat, "Windows")
    told(flat, "taken as 'resources/source.fmu'")


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('version="1.0"', "", ("no version", '"1.0"')),
        ('version="1.0"', 'version="1"', ('"1"',)),
        (' name="hand"', "", ("no name",)),
        ('kind="output"', 'kind="Output"', ("Output",)),
        ('<ssc:LinearTransformation factor="1"/>', '<ssd:LinearTransformation factor="1"/>', ("ssc:LinearTransformation",)),
        ('suppressUnitConversion="false"', 'suppressUnitConversion="False"', ("False",)),
    ],
)
def test_small_slips(tmp_path, old, new, words):
    change = '<ssc:LinearTransformation factor="1"/>'
    path = archive(
        tmp_path / "a.ssp", flat_pair(connection("A.y", "B.u", change, ' suppressUnitConversion="false"')), extra=NAMES
    )
    with zipfile.ZipFile(path) as whole:
        files = {name: whole.read(name) for name in whole.namelist()}
    text = files["SystemStructure.ssd"].decode()
    assert old in text
    files["SystemStructure.ssd"] = text.replace(old, new).encode()
    with zipfile.ZipFile(path, "w") as changed:
        for name, content in files.items():
            changed.writestr(name, content)
    flat = read(path, tmp_path / "unpacked")
    told(flat, *words)
    assert flat.connections["B", "u"][1].factor == pytest.approx(math.pi / 180)


@pytest.mark.parametrize(
    "system, says",
    [
        (flat_pair(connection("A.y", "B.u"), inner_b=B.replace('name="B"', 'name="B" type="x/y"')), "type x/y"),
        (flat_pair(connection("A.y", "B.u")).replace('name="u"', 'name="u" type="Real"'), "attribute 'type'"),
        (flat_pair(connection("A.y", "B.u"), bindings=binding(real("B.p", "1,5"))), "'1,5' is not a valid value"),
        (flat_pair(connection("A.y", "B.u", '<ssc:LinearTransformation factor="NaN"/>')), "give no number"),
        (mapped('<ssm:MappingEntry source="x" destination="B.p"/>', real("x", 1)), "'destination'"),
        (flat_pair(connection("A.y", "B.u"), inner_b=B.replace("resources/sink.fmu", "")), "source '' is not in the SSP"),
    ],
)
def test_what_is_not_clear_is_refused(tmp_path, system, says):
    with pytest.raises(DescriptionError, match=says):
        read_system(tmp_path, system)


@pytest.mark.parametrize("stop", ["NaN", "INF"])
def test_an_experiment_without_an_end_is_refused(tmp_path, stop):
    with pytest.raises(DescriptionError, match="has no end"):
        read_system(tmp_path, flat_pair(connection("A.y", "B.u")), tail=f'<ssd:DefaultExperiment stopTime="{stop}"/>')


def test_a_system_without_fmus_tells_the_values_of_its_connectors(tmp_path):
    pins = '<ssd:Connectors><ssd:Connector name="c" kind="parameter"><ssc:Real unit="deg"/></ssd:Connector></ssd:Connectors>'
    inner = f'<ssd:System name="In">{pins}</ssd:System>'
    system = f'<ssd:System name="S">{pins}{binding(real("c", math.pi) + real("In.c", 90, "deg"))}<ssd:Elements>{inner}</ssd:Elements></ssd:System>'
    result = master.run(archive(tmp_path / "a.ssp", system, units=UNITS))
    assert result.table["S.c"].to_numpy() == pytest.approx(180.0) and (result.table["In.c"] == 90.0).all()
    assert "no FMU" in result.summary()


def table(tmp_path, native, text, source="t.csv", connectors='<ssd:Connector name="u" kind="output"><ssc:Real/></ssd:Connector>'):
    """A relaxation (x' = rate (u - x)) with a table at its input."""
    columns = f'<ssd:Component name="T" type="application/table" source="{source}"><ssd:Connectors>{connectors}</ssd:Connectors></ssd:Component>'
    part = component("A", "relaxation", [("u", "input"), ("x", "output")])
    system = f'<ssd:System name="S"><ssd:Elements>{columns}{part}</ssd:Elements><ssd:Connections>{connection("T.u", "A.u")}</ssd:Connections></ssd:System>'
    path = archive(tmp_path / "a.ssp", system, tail='<ssd:DefaultExperiment stopTime="1"/>', extra={source: text})
    with zipfile.ZipFile(path, "a") as out:
        out.write(native("relaxation"), "resources/relaxation.fmu")
    return path


def test_a_table_of_omsimulator_is_a_component(native, tmp_path, refused):
    """u = 2 t, straight between rows."""
    result = master.run(table(tmp_path, native, '"time","u"\n0,0\n0.5,1\n1,2\n'), step=0.1, settings={"A.rate": 50.0})
    times = result.table["time"].to_numpy()
    assert result.table["T.u"].to_numpy() == pytest.approx(2.0 * times) and len(times) == 11
    assert result.table["A.x"].iloc[-1] == pytest.approx(2.0, abs=0.21)  # a step late at the most
    refused(lambda: master.run(table(tmp_path, native, "time,w\n0,0\n1,2\n")), "t.csv has no column u")
    refused(lambda: ssp.load(table(tmp_path, native, "", "t.mat")), "T: tables are read from .csv", "'t.mat'")


def test_a_unit_by_one_name_and_two_definitions(tmp_path):
    """As where `bar` is said to be kg.m-2: a value in the unit of its variable's name is in that unit, and the two are told."""
    wrong = UNITS.replace('<ssc:BaseUnit rad="1" factor="0.017453292519943295"/>', '<ssc:BaseUnit kg="1" factor="1e5"/>')
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), bindings=binding(real("B.p", 2, "rad"))), units=UNITS)
    assert flat.start == {("B", "p"): 2.0} and flat.notes == []
    pin = '<ssd:Connectors><ssd:Connector name="out" kind="output"><ssc:Real unit="deg"/></ssd:Connector></ssd:Connectors>'
    inner = f'<ssd:System name="In">{pin}<ssd:Elements>{A}</ssd:Elements><ssd:Connections>{connection("A.y", "out")}</ssd:Connections></ssd:System>'
    flat = read_system(
        tmp_path, flat_pair(connection("In.out", "B.u", "", ' suppressUnitConversion="true"'), inner_a=inner), units=wrong
    )
    assert flat.connections["B", "u"][1] == Affine()
    told(flat, "'deg' is one unit at one end and another at the other", "passed on as it is")


@pytest.mark.parametrize(
    "source, file",
    [
        ("resources/so#ur.fmu", "resources/so#ur.fmu"),
        ("resources/so?ur.fmu", "resources/so?ur.fmu"),
        ("resources/so%20ur.fmu", "resources/so%20ur.fmu"),
        ("/resources/source.fmu", "resources/source.fmu"),
        ("file:resources/source.fmu", "resources/source.fmu"),
        ("file:///resources/source.fmu", "resources/source.fmu"),
    ],
)
def test_a_source_as_it_is_written_or_from_the_archive_s_root(tmp_path, source, file):
    inner = A.replace("resources/source.fmu", source)
    system = flat_pair(connection("A.y", "B.u"), inner_a=inner)
    flat = read_system(tmp_path, system, extra={file: SOURCE, "resources/sink.fmu": SINK})
    assert ("B", "u") in flat.connections
    told(flat, f"{source!r} is taken as {file!r}")


def test_a_source_from_the_root_leads_nowhere_else(tmp_path):
    (tmp_path / "outside.fmu").write_text("x")
    for source in (f"{tmp_path}/outside.fmu", f"file://{tmp_path}/outside.fmu", "file:../outside.fmu", "/../outside.fmu"):
        with pytest.raises(DescriptionError, match="inside the SSP|outside the SSP|not in the SSP"):
            read_system(tmp_path, flat_pair(inner_a=A.replace("resources/source.fmu", source)))


def test_odd_bytes_in_a_source_and_types_that_the_name_says(tmp_path):
    odd = A.replace("resources/source.fmu", "resources/so%ur.fmu").replace(
        "<ssd:Component ", '<ssd:Component type="application/zip" '
    )
    flat = read_system(
        tmp_path,
        flat_pair(connection("A.y", "B.u"), inner_a=odd),
        extra={"resources/so%ur.fmu": SOURCE, "resources/sink.fmu": SINK},
    )
    assert ("B", "u") in flat.connections
    told(flat, "'application/zip'", "is taken as an FMU")
    inner = archive(tmp_path / "in.ssp", flat_pair(connection("A.y", "B.u")), extra=NAMES)
    outer = '<ssd:System name="S"><ssd:Elements><ssd:Component name="In" source="resources/in.ssp"/></ssd:Elements></ssd:System>'
    made = archive(tmp_path / "out.ssp", outer)
    with zipfile.ZipFile(made, "a") as whole:
        whole.write(inner, "resources/in.ssp")
    assert ("In/B", "u") in read(made, tmp_path / "nested").connections


def test_a_system_without_a_name_and_an_experiment_that_ends_before_it_begins(tmp_path):
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u")).replace('<ssd:System name="S">', "<ssd:System>"))
    assert flat.root == "hand"
    told(flat, "its system has no name")
    with pytest.raises(DescriptionError, match="from 4 to 1 s ends before it has begun"):
        read_system(tmp_path, flat_pair(), tail='<ssd:DefaultExperiment startTime="4" stopTime="1"/>')


def test_several_structures_and_none_that_is_first(tmp_path):
    path = archive(tmp_path / "a.ssp", flat_pair(), extra=NAMES)
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(tmp_path / "b.ssp", "w") as new:
        for name in old.namelist():
            for one in ("Summer.ssd", "Winter.ssd") if name.endswith(".ssd") else (name,):
                new.writestr(one, old.read(name))
    with pytest.raises(DescriptionError, match="It has Summer.ssd, Winter.ssd: unpack it and run one of these"):
        ssp.load(tmp_path / "b.ssp")
    assert len(ssp.load(tmp_path / "b.ssp", "Winter.ssd").components) == 2
