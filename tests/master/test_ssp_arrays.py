"""SSP 2.0: arrays as one connector, signal dictionaries, mappings of values, Binary, systems by id; each against its closed form."""

import shutil
import zipfile

import numpy as np
import pytest

from selflock import master
from selflock.master.errors import DescriptionError
from selflock.master.ssp import export, load

from .test_ssp_read import HEAD, binding, connection

SSB = 'xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary"'


def connector(name, kind, type_="Float64", inner=""):
    return f'<ssd:Connector name="{name}" kind="{kind}"><ssc:{type_}/>{inner}</ssd:Connector>'


def size(*sizes):
    return "".join(f'<ssc:Dimension size="{one}"/>' for one in sizes)


def component(name, *connectors, inner="", source="f"):
    return (
        f'<ssd:Component name="{name}" source="resources/{source}.fmu"><ssd:Connectors>{"".join(connectors)}</ssd:Connectors>'
        f"{inner}</ssd:Component>"
    )


def parameter(name, type_, value, inner=""):
    return f'<ssv:Parameter name="{name}"><ssv:{type_} value="{value}"/>{inner}</ssv:Parameter>'


def system(*elements, links="", bindings="", pins="", more=""):
    return (
        f'<ssd:System name="S">{pins}{bindings}<ssd:Elements>{"".join(elements)}</ssd:Elements>'
        f"<ssd:Connections>{links}</ssd:Connections>{more}</ssd:System>"
    ).replace("<ssd:Connections></ssd:Connections>", "")


@pytest.fixture
def packed(native, tmp_path):
    """packed(system, fmu, **files): the path of an SSP 2.0 of this system, whose FMUs are `fmu`."""

    def pack(text, fmu="sampler", files=()):
        path = tmp_path / "a.ssp"
        with zipfile.ZipFile(path, "w") as out:
            out.writestr(
                "SystemStructure.ssd",
                f'<ssd:SystemStructureDescription {HEAD} {SSB} version="2.0" name="hand">{text}'
                '<ssd:DefaultExperiment startTime="0" stopTime="1"/></ssd:SystemStructureDescription>',
            )
            out.write(native(fmu), "resources/f.fmu")
            for name, content in dict(files).items():
                out.writestr(name, content)
        return path

    return pack


def end(path, *columns, **settings):
    table = master.run(path, settings=settings).table
    return [table[column].iloc[-1] for column in columns]


# --- arrays -----------------------------------------------------------------------------------------------------------

Y, U, N = (
    connector("y", "output", inner=size(2)),
    connector("u", "input", inner=size(2)),
    connector("n", "structuralParameter", "UInt64"),
)
K = parameter("A.K", "Float64", "1 2 3 4", size(2, 2))
GIVEN = parameter("A.u", "Float64", "5 7", size(2))


def test_arrays_are_connected_and_given_as_one(packed):
    """y = K u: A has K = [[1 2] [3 4]] and u = (5, 7), B passes on."""
    path = packed(
        system(
            component("A", Y, U), component("B", Y, U), links=connection("A.y", "B.u"), bindings=binding(K + GIVEN, units=False)
        )
    )
    assert end(path, "A.y[1]", "A.y[2]", "B.y[1]", "B.y[2]") == [19.0, 43.0, 19.0, 43.0]
    assert load(path).notes == []


def test_they_are_written_as_one_and_read_back(packed, tmp_path):
    links = connection("A.y", "B.u") + connection("B.y", "C.u", "", ' startIndices="1" endIndices="2"')
    parts = component("A", Y, U), component("B", Y, U), component("C", Y, U)
    made = load(packed(system(*parts, links=links, bindings=binding(K + GIVEN, units=False))))
    path = export(made, tmp_path / "again.ssp", version="2.0")
    with zipfile.ZipFile(path) as archive:
        text = archive.read("SystemStructure.ssd").decode()
        values = archive.read("resources/A.ssv").decode()
    assert 'name="y" kind="output"' in text and "y[1]" not in text
    assert text.count("<ssd:Connection ") == 2 and text.count('startIndices="1"') == text.count('endIndices="2"') == 1
    assert '<ssv:Real value="1.0 2.0 3.0 4.0"/>' in values
    assert end(path, "B.y[1]", "B.y[2]", "C.y[1]", "C.y[2]") == [19.0, 43.0, 0.0, 19.0]


def test_through_the_connectors_of_systems_whose_size_nobody_says(packed):
    pin = f"<ssd:Connectors>{connector('out', 'output', inner='<ssc:Dimension/>')}</ssd:Connectors>"
    inner = f'<ssd:System name="In">{pin}<ssd:Elements>{component("A", Y, U)}</ssd:Elements><ssd:Connections>{connection("A.y", "out")}</ssd:Connections></ssd:System>'
    given = binding(parameter("In.A.u", "Float64", "5 7", size(2)), units=False)
    assert end(
        packed(system(inner, component("B", Y, U), links=connection("In.out", "B.u"), bindings=given)), "B.y[1]", "B.y[2]"
    ) == [5.0, 7.0]


def test_single_elements(packed):
    crossed = connection("A.y", "B.u", "", ' startIndices="1" endIndices="2"') + connection(
        "A.y", "B.u", "", ' startIndices="2" endIndices="1"'
    )
    one = component("A", Y, U), component("B", Y, U)
    given = binding(GIVEN, units=False)
    assert end(packed(system(*one, links=crossed, bindings=given)), "B.y[1]", "B.y[2]") == [7.0, 5.0]
    from_0 = crossed.replace('"1"', '"0"').replace('"2"', '"1"')
    assert end(packed(system(*one, links=from_0, bindings=given)), "B.y[1]", "B.y[2]") == [7.0, 5.0]
    open_ = packed(system(*one, links=connection("A.y", "B.u", "", ' startIndices="1" endIndices="1"'), bindings=given))
    assert end(open_, "B.y[1]", "B.y[2]") == [5.0, 0.0]
    assert any("counted from 1" in note for note in load(open_).notes)  # the standard does not say it


def test_the_size_is_a_structural_parameter(packed):
    given = (
        parameter("A.n", "UInt64", 3)
        + parameter("A.u", "Float64", "5 7 9", size(3))
        + parameter("A.K", "Float64", "1 0 0 0 1 0 0 0 2", size(3, 3))
    )
    path = packed(
        system(component("A", N, U.replace(size(2), "<ssc:Dimension sizeConnector='n'/>")), bindings=binding(given, units=False))
    )
    assert end(path, "A.y[1]", "A.y[2]", "A.y[3]") == [5.0, 7.0, 18.0]


@pytest.mark.parametrize(
    "links, given, says",
    [
        (connection("A.y", "B.u", "", ' startIndices="3"'), "", "A.y has no element 3"),
        (connection("A.y", "B.u", "", ' startIndices="1"'), "", "numbers of elements differ"),
        (connection("A.y", "B.u", "", ' startIndices="1 1 1" endIndices="1"'), "", "numbers of elements differ"),
        ("", parameter("A.u", "Float64", "5 7 9", size(3)), "A.u has 2 elements, it is given 3 values"),
        ("", parameter("A.u", "Float64", "5 7", size(3)), "A.u is an array of 3 and has 2 values"),
        ("", parameter("A.x", "Float64", "5 7", size(2)), "A.x is given 2 values, and is no array"),
    ],
)
def test_what_does_not_fit_is_refused(packed, links, given, says):
    path = packed(
        system(component("A", Y, U), component("B", Y, U), links=links, bindings=binding(given, units=False) if given else "")
    )
    with pytest.raises(DescriptionError, match=says):
        load(path)


def test_binaries_strings_and_sized_integers_cross(packed):
    pairs = [("bytes", "Binary"), ("word", "String"), ("i64", "Int64"), ("flag", "Boolean"), ("kind", "Integer")]
    pins = [connector(name, "output", type_) for name, type_ in pairs] + [
        connector(f"{name}_in", "input", type_) for name, type_ in pairs
    ]
    given = binding(
        parameter("A.bytes_in", "Binary", "c0ffee")
        + parameter("A.word_in", "String", "a b")
        + parameter("A.i64_in", "Int64", 2**40),
        units=False,
    )
    links = "".join(connection(f"A.{name}", f"B.{name}_in") for name, _ in pairs)
    path = packed(system(component("A", *pins), component("B", *pins), links=links, bindings=given))
    assert end(path, "B.bytes", "B.word", "B.i64") == ["c0ffee", "a b", 2**40]


# --- signal dictionaries ----------------------------------------------------------------------------------------------

ENTRIES = '<ssb:DictionaryEntry name="signal"><ssc:Real/></ssb:DictionaryEntry>'
INLINE = f'<ssd:SignalDictionary name="bus"><ssb:SignalDictionary version="2.0">{ENTRIES}</ssb:SignalDictionary></ssd:SignalDictionary>'
FILE = '<ssd:SignalDictionary name="bus" source="bus.ssb"/>'
BUS = {"bus.ssb": f'<ssb:SignalDictionary {SSB} {HEAD} version="1.0">{ENTRIES}</ssb:SignalDictionary>'}
REFERENCE = '<ssd:SignalDictionaryReference name="{}" dictionary="bus"><ssd:Connectors><ssd:Connector name="signal" kind="inout"/></ssd:Connectors></ssd:SignalDictionaryReference>'


@pytest.mark.parametrize("dictionary", [INLINE, FILE])
def test_a_signal_dictionary_takes_from_one_and_gives_to_all_levels(packed, dictionary):
    """f32 passes on its input; A gives to the bus, B, in a system below, takes from it."""
    pins = connector("f32", "output"), connector("f32_in", "input")
    below = f'<ssd:System name="In"><ssd:Elements>{component("B", *pins)}{REFERENCE.format("there")}</ssd:Elements><ssd:Connections>{connection("there.signal", "B.f32_in")}</ssd:Connections></ssd:System>'
    text = system(
        component("A", *pins), REFERENCE.format("here"), below, links=connection("A.f32", "here.signal"),
        bindings=binding(parameter("A.f32_in", "Real", 2.5), units=False), more=f"<ssd:SignalDictionaries>{dictionary}</ssd:SignalDictionaries>",
    )  # fmt: skip
    assert end(packed(text, files=BUS), "In/B.f32") == [2.5]


def test_two_who_give_to_a_signal_are_refused(packed):
    pin = connector("f32", "output")
    text = system(
        component("A", pin), component("B", pin), REFERENCE.format("here"), links=connection("A.f32", "here.signal") + connection("B.f32", "here.signal"),
        more=f"<ssd:SignalDictionaries>{INLINE}</ssd:SignalDictionaries>",
    )  # fmt: skip
    with pytest.raises(DescriptionError, match="has two sources: A.f32 and B.f32"):
        load(packed(text))


# --- values that become others ----------------------------------------------------------------------------------------


def table(kind, *pairs):
    entries = "".join(f'<ssc:MapEntry source="{old}" target="{new}"/>' for old, new in pairs)
    return f"<ssc:{kind}MappingTransformation>{entries}</ssc:{kind}MappingTransformation>"


@pytest.mark.parametrize(
    "name, type_, given, change, found",
    [
        ("i32", "Integer", 3, table("Integer", (3, 30), (30, 5)), 30),
        ("i32", "Integer", 4, table("Integer", (3, 30)), 4),  # what it does not name stays
        ("flag", "Boolean", "true", table("Boolean", ("true", "false")), 0),
        ("flag", "Boolean", "false", table("Boolean", ("false", "true")), 1),
        ("kind", "Enumeration", "other", table("Enumeration", ("other", "plain")), 1),
        ("kind", "Enumeration", "plain", table("Integer", (1, 2)), 2),
    ],
)
def test_a_connection_maps_values(packed, name, type_, given, change, found):
    plain = {"Enumeration": 'Enumeration name="Kind"'}.get(type_, type_)
    pins = [
        f'<ssd:Connector name="{one}" kind="{kind}"><ssc:{plain}/></ssd:Connector>'
        for one, kind in ((name, "output"), (f"{name}_in", "input"))
    ]
    text = system(
        component("A", *pins), component("B", *pins), links=connection(f"A.{name}", f"B.{name}_in", change),
        bindings=binding(parameter(f"A.{name}_in", type_, given), units=False),
    )  # fmt: skip
    text += '<ssd:Enumerations><ssc:Enumeration name="Kind"><ssc:Item name="plain" value="1"/><ssc:Item name="other" value="2"/></ssc:Enumeration></ssd:Enumerations>'
    path = packed(text)
    run = master.run(path)
    assert run.table[f"B.{name}"].iloc[0] == run.table[f"B.{name}"].iloc[-1] == found


def test_a_mapping_is_kept_in_a_system_file_and_in_ssp(packed, tmp_path):
    pins = connector("i32", "output", "Integer"), connector("i32_in", "input", "Integer")
    text = system(
        component("A", *pins), component("B", *pins), links=connection("A.i32", "B.i32_in", table("Integer", (3, 30))),
        bindings=binding(parameter("A.i32_in", "Integer", 3), units=False),
    )  # fmt: skip
    made = load(packed(text))
    for name in ("s.toml", "s.ssp"):
        made.save(tmp_path / name)
        assert end(tmp_path / name, "B.i32") == [30]


def test_a_parameter_mapping_maps_values(packed):
    entries = f'<ssm:MappingEntry source="k" target="A.kind_in">{table("Enumeration", ("first", "other"))}</ssm:MappingEntry>'
    entries += f'<ssm:MappingEntry source="f" target="A.flag_in">{table("Boolean", ("true", "false"))}</ssm:MappingEntry>'
    entries += f'<ssm:MappingEntry source="i" target="A.i8_in">{table("Integer", (7, -7))}</ssm:MappingEntry>'
    values = (
        '<ssv:Parameter name="k"><ssv:Enumeration value="first"/></ssv:Parameter>'
        + parameter("f", "Boolean", "true")
        + parameter("i", "Integer", 7)
    )
    bound = (
        f'<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="2.0" name="p"><ssv:Parameters>{values}</ssv:Parameters>'
        f'</ssv:ParameterSet></ssd:ParameterValues><ssd:ParameterMapping><ssm:ParameterMapping version="2.0">{entries}</ssm:ParameterMapping></ssd:ParameterMapping>'
        "</ssd:ParameterBinding></ssd:ParameterBindings>"
    )
    assert end(
        packed(system(component("A"), bindings=bound).replace("<ssd:Connectors></ssd:Connectors>", "")),
        "A.kind",
        "A.flag",
        "A.i8",
    ) == [2, 0, -7]


# --- sources ----------------------------------------------------------------------------------------------------------


def test_a_system_is_used_again_by_its_id(packed):
    pin = f"<ssd:Connectors>{connector('out', 'output')}</ssd:Connectors>"
    first = f'<ssd:System name="one" id="here">{pin}<ssd:Elements>{component("A", connector("f32", "output"))}</ssd:Elements><ssd:Connections>{connection("A.f32", "out")}</ssd:Connections></ssd:System>'
    again = f'<ssd:Component name="two" type="application/x-ssp-definition" source="#here">{pin}</ssd:Component>'
    given = binding(parameter("one.A.f32_in", "Real", 1.5) + parameter("two.A.f32_in", "Real", 4.5), units=False)
    assert end(packed(system(first, again, bindings=given)), "one/A.f32", "two/A.f32") == [1.5, 4.5]
    with pytest.raises(DescriptionError, match="no system with the id 'there'"):
        load(packed(system(first, again.replace("#here", "#there"))))


def test_values_that_lie_in_the_fmu(packed, native, tmp_path):
    values = f'<ssv:ParameterSet {HEAD} version="1.0" name="p"><ssv:Parameters>{parameter("f32_in", "Real", 3.5)}</ssv:Parameters></ssv:ParameterSet>'
    own = tmp_path / "own.fmu"
    shutil.copy(native("sampler"), own)
    with zipfile.ZipFile(own, "a") as fmu:
        fmu.writestr("resources/own.ssv", values)
    bound = (
        '<ssd:ParameterBindings><ssd:ParameterBinding source="resources/own.ssv" sourceBase="component"/></ssd:ParameterBindings>'
    )
    path = packed(system(component("A", connector("f32", "output"), inner=bound, source="own")))
    with zipfile.ZipFile(path, "a") as out:
        out.write(own, "resources/own.fmu")
    assert end(path, "A.f32") == [3.5]


def test_one_name_for_two_elements_means_both(packed):
    """SSP, ParameterBindings: with system B of component C, and component B.C beside it, B.C.f32_in is of both."""
    pin = connector("f32", "output")
    inner = f'<ssd:System name="B"><ssd:Elements>{component("C", pin)}</ssd:Elements></ssd:System>'
    given = binding(parameter("B.C.f32_in", "Real", 2.0), units=False)
    table_ = master.run(packed(system(inner, component("B.C", pin), bindings=given))).table
    assert np.all(table_.iloc[-1][["B/C.f32", "B.C.f32"]] == 2.0)
