"""Reading SSP 1.0: hierarchy, transformations, units and parameters, on archives written by hand.

Flattening looks at descriptions only, so the FMUs here consist of a modelDescription.xml alone.
"""

import math
import zipfile

import pytest

from selflock.master.errors import DescriptionError
from selflock.master.ssp import read
from selflock.master.ssp.flat import Affine
from selflock.master.ssp.structure import load

HEAD = (
    'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
    'xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"'
)
UNITS = """<ssd:Units>
  <ssc:Unit name="rad"><ssc:BaseUnit rad="1"/></ssc:Unit>
  <ssc:Unit name="deg"><ssc:BaseUnit rad="1" factor="0.017453292519943295"/></ssc:Unit>
  <ssc:Unit name="degC"><ssc:BaseUnit K="1" offset="273.15"/></ssc:Unit>
  <ssc:Unit name="K"><ssc:BaseUnit K="1"/></ssc:Unit>
</ssd:Units>"""


def fmu(**variables):
    """The bytes of an FMU's description; variables: name = (causality, unit)."""
    rows = "".join(
        f'<ScalarVariable name="{name}" valueReference="{i}" causality="{causality}" '
        f'variability="{"fixed" if causality == "parameter" else "continuous"}">'
        f'<Real unit="{unit}"{"" if causality == "output" else " start=" + chr(34) + "0" + chr(34)}/></ScalarVariable>'
        for i, (name, (causality, unit)) in enumerate(variables.items())
    )
    return (
        '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g"><CoSimulation modelIdentifier="m"/>'
        '<UnitDefinitions><Unit name="rad"><BaseUnit rad="1"/></Unit>'
        '<Unit name="deg"><BaseUnit rad="1" factor="0.017453292519943295"/></Unit><Unit name="K"><BaseUnit K="1"/></Unit></UnitDefinitions>'
        f'<DefaultExperiment stepSize="0.01"/><ModelVariables>{rows}</ModelVariables><ModelStructure/></fmiModelDescription>'
    )


SOURCE = fmu(y=("output", "deg"), p=("parameter", "rad"))
SINK = fmu(u=("input", "rad"), v=("input", "K"), p=("parameter", "rad"))


def archive(path, system, *, units=UNITS, extra=None, tail='<ssd:DefaultExperiment startTime="1" stopTime="4"/>'):
    with zipfile.ZipFile(path, "w") as out:
        out.writestr(
            "SystemStructure.ssd",
            f'<ssd:SystemStructureDescription {HEAD} version="1.0" name="hand">{system}{units}{tail}</ssd:SystemStructureDescription>',
        )
        for name, text in (extra or {}).items():
            if name.endswith(".fmu"):
                inner = path.parent / "inner.fmu"
                with zipfile.ZipFile(inner, "w") as packed:
                    packed.writestr("modelDescription.xml", text)
                out.write(inner, name)
            else:
                out.writestr(name, text)
    return path


def read_system(tmp_path, system, **options):
    options.setdefault("extra", {"resources/source.fmu": SOURCE, "resources/sink.fmu": SINK})
    return read(archive(tmp_path / "a.ssp", system, **options), tmp_path / "unpacked")


def component(name, source, connectors, inner=""):
    rows = "".join(f'<ssd:Connector name="{n}" kind="{k}"/>' for n, k in connectors)
    return f'<ssd:Component name="{name}" source="resources/{source}.fmu"><ssd:Connectors>{rows}</ssd:Connectors>{inner}</ssd:Component>'


A = component("A", "source", [("y", "output"), ("p", "parameter")])
B = component("B", "sink", [("u", "input"), ("v", "input"), ("p", "parameter")])


def connection(start, end, inner="", attributes=""):
    ends = ""
    for side, port in (("start", start), ("end", end)):
        element, _, connector = port.rpartition(".")
        ends += (f' {side}Element="{element}"' if element else "") + f' {side}Connector="{connector}"'
    return f"<ssd:Connection{ends}{attributes}>{inner}</ssd:Connection>"


def flat_pair(*connections, bindings="", inner_a=A, inner_b=B):
    return (
        f'<ssd:System name="S">{bindings}<ssd:Elements>{inner_a}{inner_b}</ssd:Elements>'
        f"<ssd:Connections>{''.join(connections)}</ssd:Connections></ssd:System>"
    )


def test_units_are_converted_on_the_way(tmp_path):
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u")))
    (port, change) = flat.connections["B", "u"]
    assert port == ("A", "y")
    assert change(180.0) == pytest.approx(math.pi, rel=1e-15)
    assert (flat.start_time, flat.stop_time, flat.smallest_step) == (1.0, 4.0, 0.01)


def test_conversion_can_be_suppressed_and_a_linear_transformation_is_applied(tmp_path):
    linear = '<ssc:LinearTransformation factor="2" offset="1"/>'
    plain = read_system(tmp_path, flat_pair(connection("A.y", "B.u", linear, ' suppressUnitConversion="true"')))
    assert plain.connections["B", "u"][1] == Affine(2.0, 1.0)
    both = read_system(tmp_path, flat_pair(connection("A.y", "B.u", linear)))
    assert both.connections["B", "u"][1](90.0) == pytest.approx(2.0 * math.pi / 2 + 1.0)


def nested():
    """A inside system In; its angle leaves through a connector in rad, doubled there, and again doubled outside."""
    inner = (
        '<ssd:System name="In"><ssd:Connectors><ssd:Connector name="out" kind="output"><ssc:Real unit="rad"/></ssd:Connector>'
        '<ssd:Connector name="pin" kind="parameter"><ssc:Real unit="deg"/></ssd:Connector></ssd:Connectors>'
        f"<ssd:Elements>{A}</ssd:Elements><ssd:Connections>"
        + connection("A.y", "out", '<ssc:LinearTransformation factor="2" offset="0.5"/>')
        + connection("pin", "A.p")
        + "</ssd:Connections></ssd:System>"
    )
    return inner


def test_a_nested_system_becomes_one_connection_with_everything_multiplied_out(tmp_path):
    flat = read_system(
        tmp_path, flat_pair(connection("In.out", "B.u", '<ssc:LinearTransformation factor="2"/>'), inner_a=nested())
    )
    port, change = flat.connections["B", "u"]
    assert port == ("In/A", "y")
    for degrees in (0.0, 90.0, -30.0):
        assert change(degrees) == pytest.approx(2.0 * (2.0 * math.radians(degrees) + 0.5))


def test_a_value_of_a_system_connector_reaches_the_fmu_in_its_unit(tmp_path):
    bindings = binding('<ssv:Parameter name="In.pin"><ssv:Real value="90" unit="deg"/></ssv:Parameter>')
    flat = read_system(tmp_path, flat_pair(connection("In.out", "B.u"), bindings=bindings, inner_a=nested()))
    assert flat.start == {("In/A", "p"): pytest.approx(math.pi / 2)}


def binding(parameters, attributes="", mapping="", units=True):
    said = UNITS.replace("ssd:Units", "ssv:Units") if units else ""
    return (
        f"<ssd:ParameterBindings><ssd:ParameterBinding{attributes}><ssd:ParameterValues>"
        f'<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>{parameters}</ssv:Parameters>{said}</ssv:ParameterSet>'
        f"</ssd:ParameterValues>{mapping}</ssd:ParameterBinding></ssd:ParameterBindings>"
    )


def real(name, value, unit="rad"):
    return f'<ssv:Parameter name="{name}"><ssv:Real value="{value}" unit="{unit}"/></ssv:Parameter>'


def test_a_higher_level_wins_over_a_lower_one(tmp_path):
    low = component("B", "sink", [("u", "input"), ("p", "parameter")], binding(real("p", 1) + real("u", 5)))
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), bindings=binding(real("B.p", 2)), inner_b=low))
    assert flat.start["B", "p"] == 2.0
    assert flat.start["B", "u"] == 5.0


def test_prefix_and_mapping_rename_and_change(tmp_path):
    prefixed = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), bindings=binding(real("p", 3), ' prefix="B."')))
    assert prefixed.start == {("B", "p"): 3.0}
    mapping = (
        '<ssd:ParameterMapping><ssm:ParameterMapping version="1.0"><ssm:MappingEntry source="angle" target="B.p">'
        '<ssc:LinearTransformation factor="10"/></ssm:MappingEntry></ssm:ParameterMapping></ssd:ParameterMapping>'
    )
    mapped = read_system(
        tmp_path, flat_pair(connection("A.y", "B.u"), bindings=binding(real("angle", 3) + real("other", 1), mapping=mapping))
    )
    assert mapped.start == {("B", "p"): 30.0}


def mapped(entry, parameters):
    mapping = f'<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">{entry}</ssm:ParameterMapping></ssd:ParameterMapping>'
    return flat_pair(connection("A.y", "B.u"), bindings=binding(parameters, mapping=mapping))


def test_a_mapping_converts_first_and_transforms_then_or_does_not_convert(tmp_path):
    change = '<ssc:LinearTransformation factor="2" offset="1"/>'
    for attribute, expected in (("", 2.0 * math.pi + 1.0), (' suppressUnitConversion="true"', 2.0 * 180.0 + 1.0)):
        flat = read_system(
            tmp_path,
            mapped(f'<ssm:MappingEntry source="x" target="B.p"{attribute}>{change}</ssm:MappingEntry>', real("x", 180, "deg")),
        )
        assert flat.start["B", "p"] == pytest.approx(expected)
    whole = read_system(
        tmp_path,
        mapped(
            f'<ssm:MappingEntry source="x" target="B.p">{change}</ssm:MappingEntry>',
            '<ssv:Parameter name="x"><ssv:Integer value="3"/></ssv:Parameter>',
        ),
    )
    assert whole.start["B", "p"] == 7.0


def test_a_connector_says_the_unit_where_the_fmu_says_none(tmp_path):
    silent = SOURCE.replace(' unit="deg"', "", 1)
    said = A.replace(
        '<ssd:Connector name="y" kind="output"/>', '<ssd:Connector name="y" kind="output"><ssc:Real unit="deg"/></ssd:Connector>'
    )
    extra = {"resources/source.fmu": silent, "resources/sink.fmu": SINK}
    for inner, factor in ((said, math.pi / 180), (A, 1.0)):
        flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), inner_a=inner), extra=extra)
        assert flat.connections["B", "u"][1].factor == pytest.approx(factor)


def test_values_from_a_file_of_their_own(tmp_path):
    ssv = f'<ssv:ParameterSet {HEAD} version="1.0" name="p"><ssv:Parameters>{real("p", 180, "deg")}</ssv:Parameters>{UNITS.replace("ssd:", "ssv:")}</ssv:ParameterSet>'
    bound = component(
        "B",
        "sink",
        [("u", "input")],
        '<ssd:ParameterBindings><ssd:ParameterBinding source="resources/b.ssv"/></ssd:ParameterBindings>',
    )
    extra = {"resources/source.fmu": SOURCE, "resources/sink.fmu": SINK, "resources/b.ssv": ssv}
    flat = read_system(tmp_path, flat_pair(connection("A.y", "B.u"), inner_b=bound), extra=extra)
    assert flat.start == {("B", "p"): pytest.approx(math.pi)}


def test_a_packed_ssp_inside_an_ssp(tmp_path):
    inside = archive(
        tmp_path / "inner.ssp",
        '<ssd:System name="I"><ssd:Connectors><ssd:Connector name="out" kind="output"><ssc:Real unit="deg"/></ssd:Connector></ssd:Connectors>'
        f"<ssd:Elements>{A}</ssd:Elements><ssd:Connections>{connection('A.y', 'out')}</ssd:Connections></ssd:System>",
        extra={"resources/source.fmu": SOURCE},
    )
    outer = (
        '<ssd:Component name="Sub" type="application/x-ssp-package" source="resources/inner.ssp">'
        '<ssd:Connectors><ssd:Connector name="out" kind="output"/></ssd:Connectors></ssd:Component>'
    )
    path = archive(tmp_path / "a.ssp", flat_pair(connection("Sub.out", "B.u"), inner_a=outer), extra={"resources/sink.fmu": SINK})
    with zipfile.ZipFile(path, "a") as out:
        out.write(inside, "resources/inner.ssp")
    flat = read(path, tmp_path / "unpacked")
    assert flat.connections["B", "u"][0] == ("Sub/A", "y")


@pytest.mark.parametrize(
    ("system", "says"),
    [
        (flat_pair(connection("A.y", "B.v")), "deg cannot be converted to K"),
        (flat_pair(connection("A.y", "B.u"), connection("A.y", "B.u", '<ssc:LinearTransformation factor="2"/>')), "two sources"),
        (flat_pair(connection("A.y", "C.u")), "'C'"),
        (flat_pair(connection("A.z", "B.u")), "'A.z'"),
        (flat_pair(connection("B.u", "B.p")), "neither of them gives a value"),
        (flat_pair(connection("A.y", "A.y")), "both of them give a value"),
        (flat_pair(connection("A.y", "B.u"), bindings=binding(real("B.p", 1, "lightyear"))), "lightyear"),
        (flat_pair(connection("A.y", "B.u"), inner_b=B.replace("resources/sink.fmu", "../../sink.fmu")), "outside"),
        (flat_pair(connection("A.y", "B.u"), inner_b=B.replace("resources/sink.fmu", "resources/none.fmu")), "not in the SSP"),
        (
            flat_pair(
                connection("A.y", "B.u"),
                inner_b=B.replace('"u" kind="input"/>', '"u" kind="input"><ssc:Real unit="deg"/></ssd:Connector>'),
            ),
            "'u' is in deg, its FMU says rad",
        ),
        (
            flat_pair(connection("A.y", "B.u"), inner_b=B + '<ssd:SignalDictionaryReference name="bus" dictionary="d"/>'),
            "no signal dictionary 'd'",
        ),
        (
            mapped(
                '<ssm:MappingEntry source="x" target="B.p"><ssc:LinearTransformation factor="2"/></ssm:MappingEntry>',
                '<ssv:Parameter name="x"><ssv:Boolean value="true"/></ssv:Parameter>',
            ),
            "x = True is no number",
        ),
        ("<ssd:Sytem/>", "not valid SSP 1.0"),
    ],
)
def test_what_cannot_be_read_is_refused_by_name(tmp_path, system, says):
    with pytest.raises(DescriptionError, match=says):
        read_system(tmp_path, system)


def test_files_that_are_no_ssp(tmp_path):
    (tmp_path / "text.ssp").write_text("hello")
    with pytest.raises(DescriptionError, match="not a zip archive"):
        read(tmp_path / "text.ssp", tmp_path / "u")
    with pytest.raises(DescriptionError, match="no such file"):
        read(tmp_path / "none.ssp", tmp_path / "u")
    with zipfile.ZipFile(tmp_path / "bare.ssp", "w") as out:
        out.writestr("readme", "")
    with pytest.raises(DescriptionError, match="SystemStructure.ssd is missing"):
        read(tmp_path / "bare.ssp", tmp_path / "u2")


@pytest.mark.parametrize(
    ("source", "host"),
    [("proxyfmu://localhost?file=a%20b.fmu", ""), ("proxyfmu://10.0.0.7:9090?file=a%20b.fmu", "10.0.0.7:9090")],
)
def test_sources_of_osps_proxy_run_in_a_process_or_where_they_are_served(tmp_path, source, host):
    one = f'<ssd:Component name="one" source="{source}"/>'
    text = f'<ssd:System name="s"><ssd:Elements>{one}</ssd:Elements></ssd:System>'
    system = load(archive(tmp_path / "x.ssp", text, extra={"a b.fmu": SOURCE}))
    made = system.components["one"]
    assert (made.host, made.process) == (host, not host) and made.fmu.endswith("a b.fmu")
