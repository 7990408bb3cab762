"""OspSystemStructure.xml: runs as the same system in our words; what it says is used, told, or refused in a sentence."""

import os
import shutil
import zipfile

import numpy as np
import pytest

from selflock import master

HEAD = '<?xml version="1.0" encoding="utf-8"?><OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">'
RATES = {"a": 2.0, "b": 3.0, "c": 4.0}


def simulators(source, **more):
    made = ""
    for name, rate in RATES.items():
        value = f'<InitialValues><InitialValue variable="rate"><Real value="{rate}"/></InitialValue></InitialValues>'
        made += f'<Simulator name="{name}" source="{source}" {more.get(name, "")}>{value}</Simulator>'
    return f"<Simulators>{made}</Simulators>"


def variables(a, b, more=""):
    ends = "".join(f'<Variable simulator="{s}" name="{v}"/>' for s, v in (a, b))
    return f"<VariableConnection {more}>{ends}</VariableConnection>"


def signal(variable, function, name):
    return f'<SignalConnection><Variable simulator="{variable[0]}" name="{variable[1]}"/><Signal function="{function}" name="{name}"/></SignalConnection>'


@pytest.fixture
def structure(native, tmp_path):
    """structure(connections, functions="", head="", **simulators): its file, the FMUs a folder above it."""

    def write(connections, functions="", head="", **more):
        shutil.copy(native("relaxation"), tmp_path)
        folder = tmp_path / "osp"
        folder.mkdir(exist_ok=True)
        path = folder / "OspSystemStructure.xml"
        path.write_text(
            f"{HEAD}<StartTime>0.0</StartTime><EndTime>0.5</EndTime><BaseStepSize>1e-2</BaseStepSize>{head}"
            f"{simulators('../relaxation.fmu', **more)}<Functions>{functions}</Functions>"
            f"<Connections>{connections}</Connections></OspSystemStructure>"
        )
        return path

    return write


def ours(system, native, connections, more=None, **run):
    components = {name: (native("relaxation"), {"rate": rate}, (more or {}).get(name, {})) for name, rate in RATES.items()}
    made = system(components, connections, stop=0.5, step=0.01, algorithm="jacobi", open_inputs=True, **run)
    return master.run(made).table


def test_it_runs_as_the_same_system_in_our_words(structure, system, native):
    path = structure(variables(("b", "u"), ("a", "x")) + variables(("c", "x"), ("a", "u")))
    table = master.run(path).table
    assert table.equals(ours(system, native, {"b.u": "a.x", "a.u": "c.x"}))
    assert master.run(path.parent).table.equals(table)


def test_a_linear_transformation_is_in_its_connections(structure, system, native):
    function = '<LinearTransformation name="half" factor="0.5" offset="1.5"/>'
    path = structure(signal(("a", "x"), "half", "in") + signal(("b", "u"), "half", "out"), function)
    wanted = ours(system, native, {"b.u": {"from": "a.x", "factor": 0.5, "offset": 1.5}})
    assert master.run(path).table.equals(wanted)


def test_a_sum_acts_at_the_communication_point(structure, system, native):
    """What c is given at t_n is the sum of what a and b are at t_n; a part that steps would be one step late."""
    chain = signal(("a", "x"), "sum", "in[0]") + signal(("b", "x"), "sum", "in[1]") + signal(("c", "u"), "sum", "out")
    path = structure(chain + variables(("c", "x"), ("a", "u")), '<Sum name="sum" inputCount="2"/>')
    table = master.run(path).table
    assert np.array_equal(table["sum.out"], table["a.x"] + table["b.x"])
    decay = np.exp(-4.0 * 0.01)  # x' = -rate (x - u) with u held
    c, u = table["c.x"].to_numpy(), table["sum.out"].to_numpy()
    assert c[1:] == pytest.approx(u[:-1] + (c[:-1] - u[:-1]) * decay, rel=1e-12)


def test_a_longer_step_of_ones_own_is_the_multiple_below_and_held(structure, system, native):
    path = structure(variables(("b", "x"), ("c", "u")), b='stepSize="0.025"')
    result = master.run(path)
    assert "b: its step is 0.02 s, not 0.025 s" in result.notes[0]
    x = result.table["b.x"].to_numpy()
    assert np.array_equal(x[0:-1:2], x[1::2]) and x[2] != x[1]
    held = ours(system, native, {"c.u": "b.x"}, {"b": {"step": 0.02}}, hold_outputs=True)
    assert result.table.equals(held)
    line = ours(system, native, {"c.u": "b.x"}, {"b": {"step": 0.02}})["b.x"].to_numpy()
    assert line[1] == pytest.approx(0.5 * (line[0] + line[2]), rel=1e-12)


def test_groups_are_connected_in_their_order(structure, system, native, tmp_path):
    group = '<VariableGroupConnection><VariableGroup simulator="a" name="port"/><VariableGroup simulator="b" name="port"/></VariableGroupConnection>'
    path = structure(group)
    with pytest.raises(
        master.DescriptionError, match="a has no Relaxation_OspModelDescription.xml, which says what is in 'port'"
    ):
        master.run(path)
    for folder in (path.parent, tmp_path):  # beside the structure, or beside the FMU
        file = folder / "Relaxation_OspModelDescription.xml"
        file.write_text(
            '<OspModelDescription xmlns="https://open-simulation-platform.com/OspModelDescription/1.0.0" version="1.0"><VariableGroups>'
            '<LinearMechanicalPort name="port"><Force name="f"><Variable ref="x"/></Force></LinearMechanicalPort></VariableGroups></OspModelDescription>'
        )
        with pytest.raises(
            master.DescriptionError, match="b has no input x|b.x"
        ):  # an output on an output: told, not passed over
            master.run(path)
        file.unlink()
    functions = '<VectorSum name="vector" inputCount="2" dimension="1"/>'
    ends = [("a", "in[0]"), ("b", "in[1]")]
    groups = "".join(
        f'<SignalGroupConnection><VariableGroup simulator="{s}" name="port"/><SignalGroup function="vector" name="{n}"/></SignalGroupConnection>'
        for s, n in ends
    )
    path = structure(groups + signal(("c", "u"), "vector", "out[0]"), functions)
    (path.parent / "relaxation_OspModelDescription.xml").write_text(
        '<OspModelDescription><VariableGroups><VariableGroup name="port"><Variable name="x"/></VariableGroup></VariableGroups></OspModelDescription>'
    )
    table = master.run(path).table
    assert np.array_equal(table["vector.out[0]"], table["a.x"] + table["b.x"])


def test_what_is_not_used_is_told(structure):
    pair = variables(("b", "u"), ("a", "x"), 'powerBond="shaft"')
    result = master.run(structure(pair, head="<Algorithm>ecco</Algorithm>"))
    assert "the algorithm ecco is not used" in result.notes[0]
    assert "the power bond shaft is not used" in result.notes[1]
    both = pair + variables(("a", "u"), ("b", "x"), 'powerBond="shaft"')
    assert master.run(structure(both)).energy.index.tolist() == ["shaft"]


@pytest.mark.parametrize(
    "connections, functions, head, words",
    [
        (variables(("b", "u"), ("a", "y")), "", "", "a has no variable y"),
        (variables(("b", "u"), ("a", "x")) * 2, "", "", "b.u is connected twice"),
        (signal(("b", "u"), "half", "out"), '<LinearTransformation name="half"/>', "", "half gives b.u something and is given nothing"),
        ("", '<Sum name="a" inputCount="1"/>', "", "both named 'a'"),
        ("", '<Sum name="s" inputCount="-1"/>', "", "s has no inputs"),
        ("", '<Product name="s"/>', "", "a function Product is not known here"),
        ("<VariableConnection/>", "", "", "a connection has two ends"),
    ],
)  # fmt: skip
def test_what_nobody_can_guess_is_a_sentence(structure, refused, connections, functions, head, words):
    refused(lambda: master.load(structure(connections, functions, head)), words)


def test_other_xml_and_missing_fmus(structure, refused, tmp_path):
    path = structure("")
    (tmp_path / "relaxation.fmu").unlink()
    refused(lambda: master.load(path), "a: there is no FMU at")
    path.write_text(path.read_text().replace("<EndTime>0.5", "<EndTime>-1"))
    refused(lambda: master.load(path), "an end behind the start")
    path.write_text(path.read_text().replace("1e-2", "ten"))
    refused(lambda: master.load(path), "BaseStepSize = 'ten' is no number")
    path.write_text("<fmiModelDescription/>")
    refused(lambda: master.load(path), "its root element is fmiModelDescription")
    path.write_text("<OspSystemStructure>")
    refused(lambda: master.load(path), "OspSystemStructure.xml")


@pytest.mark.parametrize(
    "change, words",
    [
        (('source="../relaxation.fmu"', 'source="//[::1/x.fmu"'), "there is no FMU at"),
        (('source="../relaxation.fmu"', 'source="/dev/zero"'), "it is a device or a pipe"),
        (('name="b" source', 'name="a" source'), "two simulators are named 'a'"),
        (('name="b" source', 'name="b" stepSize="often" source'), "stepSize = 'often' is no number"),
        (("1e-2</Base", "1e-300</Base"), "is beyond any number of steps of 1e-300 s"),
        (('<?xml version="1.0" encoding="utf-8"?>', '<!DOCTYPE a [<!ENTITY b "c">]>'), "declares a document type"),
    ],
)
def test_what_is_hostile_is_refused(structure, refused, change, words):
    path = structure("")
    text = path.read_text()
    assert change[0] in text
    path.write_text(text.replace(*change))
    refused(lambda: master.run(path), words)


def test_documents_beside_it_are_as_little_trusted(structure, refused, native, tmp_path):
    """The list of groups torn; a description of gigabytes, or with entities, in a folder as an FMU."""
    path = structure(
        '<VariableGroupConnection><VariableGroup simulator="a" name="g"/><VariableGroup simulator="b" name="g"/></VariableGroupConnection>'
    )
    beside = path.parent / "relaxation_OspModelDescription.xml"
    beside.write_text("<OspModelDescription><b")
    refused(lambda: master.load(path), "relaxation_OspModelDescription.xml", "cannot be read as XML")
    fmu = tmp_path / "relaxation.fmu"
    with zipfile.ZipFile(fmu) as archive:
        content = archive.read("modelDescription.xml")
        fmu.unlink()
        archive.extractall(fmu)
    described = fmu / "modelDescription.xml"
    assert b"?>" in content
    described.write_bytes(content.replace(b"?>", b'?><!DOCTYPE a [<!ENTITY b "c">]>', 1))
    refused(lambda: master.load(path), "cannot be read as an FMU: it declares a document type")
    os.truncate(described, 1 << 32)
    refused(lambda: master.load(path), "it has 4096 MiB")
