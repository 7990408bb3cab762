"""What other exporters write: descriptions and archives that are not as the standard has them, read where their meaning is clear."""

import re
import subprocess
import zipfile
from pathlib import Path

import pytest

from selflock import master
from selflock.master.reading import read_description
from selflock.master.single import single


@pytest.fixture
def altered(native, tmp_path):
    """altered(old, new, …): the path of a small FMU with something else in its description; bytes: its whole description."""

    def make(*pairs, name="forgetful", binary="binaries/linux64/forgetful.so", more=()):
        path = tmp_path / "odd.fmu"
        with zipfile.ZipFile(native(name)) as old, zipfile.ZipFile(path, "w") as new:
            text = old.read("modelDescription.xml").decode()
            for one in pairs:
                if isinstance(one, tuple):
                    assert one[0] in text
                    text = text.replace(*one)
                else:
                    text = one(text)
            new.writestr("modelDescription.xml", text)
            if binary:
                new.writestr(binary, next(old.read(one) for one in old.namelist() if one.endswith(".so")))
            for entry, content in dict(more).items():
                new.writestr(entry, content)
        return path

    return make


def end(path, column="y", **start):
    """The last value of an output, and what was mended."""
    system = single(path)
    (name,) = system.components
    table = master.run(system, {f"{name}.{key}": value for key, value in start.items()}, stop=0.5).table
    return table[f"{name}.{column}"].iloc[-1], read_description(Path(path))[1]


@pytest.mark.parametrize(
    "change",
    [
        lambda text: b"\xef\xbb\xbf" + text.encode(),
        lambda text: text.replace("\n", "\r\n").encode(),
        lambda text: text.replace("UTF-8", "ISO-8859-1").replace("Takes", "T\xe4kes").encode("latin-1"),
        lambda text: text.replace("UTF-8", "UTF-16").encode("utf-16"),
        lambda text: text.replace("UTF-8", "Shift_JIS").replace("Takes", "\u65e5\u672c takes").encode("shift_jis"),
        lambda text: text.replace("UTF-8", "us-ascii").replace("Takes", "T\xe4kes").encode(),
        lambda text: text.replace('fmiVersion="2.0"', 'fmiVersion=" 2 "').encode(),
        lambda text: text.replace("<Real start", "<!-- of 1 --><?x y?><Real start").replace("<ModelVariables>", "<!-- x --><ModelVariables>").encode(),
        lambda text: text.replace("<DefaultExperiment", "<VendorAnnotations><Tool name='x'><y xmlns='urn:z'/></Tool></VendorAnnotations><DefaultExperiment").encode(),
    ],
)  # fmt: skip
def test_what_xml_may_be(altered, change):
    assert end(altered(change), gain=3.0) == (1.5, [])


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda text: text.replace("Takes", "T\xe4kes").encode("latin-1"), "read as Windows-1252"),
        (lambda text: ("\n " + text).encode(), "blank in front"),
        (lambda text: text.replace("UTF-8", "utf-16").encode(), "not in the encoding 'utf-16'"),
        (lambda text: text.replace("UTF-8", "ANSI").encode(), "not in the encoding 'ANSI'"),
        (("Takes", "A & B takes"), "a & that begins no entity"),
        (("Takes", "\x02Takes"), "control characters"),
        (("<fmiModelDescription ", '<fmiModelDescription xmlns="http://fmi-standard.org/fmi2" '), "FMI has no namespace"),
        (lambda text: text.replace("fmiModelDescription", "fmi:fmiModelDescription").replace("<fmi:fmiModelDescription ", '<fmi:fmiModelDescription xmlns:fmi="urn:fmi" '), "FMI has no namespace"),
        (('causality="output"', 'causality="Output"'), 'causality "Output" is taken as "output"'),
        (('variability="fixed"', 'variability="Fixed"'), 'variability "Fixed" is taken as "fixed"'),
        (('name="at_entry" valueReference="7" causality="output"', 'name="at_entry" valueReference="7" causality="none"'), "is one of FMI 1.0"),
        (('name="at_entry" valueReference="7" causality="output"', 'name="at_entry" valueReference="7" causality="output" variability="tunable"'), 'which is taken as "continuous"'),
        (("<ModelVariables>", '<TypeDefinitions><SimpleType name="A"/></TypeDefinitions><ModelVariables>'), "a type says of nothing what it is"),
        (("canHandleVariableCommunicationStepSize=\"true\"", 'canHandleVariableCommunicationStepSize="True"'), "True is taken as true"),
        ((' variability="fixed"', ""), 'taken as "fixed": gain'),
        (('index="8"', 'index="0"'), "names no variable; it is left out: 0"),
        (('index="8"', 'index="-1"'), "names no variable; it is left out: -1"),
        (('index="8"', 'index="80"'), "names no variable; it is left out: 80"),
        (('dependencies="7"', 'dependencies="7,1"'), "taken as not told: 5"),
        (('<Integer start="1"/>', '<Integer start="1" declaredType="Count"/>'), "'Count' is not defined"),
        (('name="at_entry" valueReference="7" causality="output"><Real/>', 'name="at_entry" valueReference="7" causality="output"><Real derivative="-1"/>'), "derivative of nothing: at_entry"),
        (('name="at_entry"', 'name="at&#10;entry"'), "a line break or tab in a name is a blank: at entry"),
        (("<CoSimulation ", '<CoSimulation maxOutputDerivativeOrder="" '), "maxOutputDerivativeOrder is no number"),
        (("<ModelVariables>", '<UnitDefinitions><Unit name="x"><BaseUnit kg="0.5"/></Unit></UnitDefinitions><ModelVariables>'), "goes by its name: x"),
    ],
)  # fmt: skip
def test_slips_are_mended_and_told(altered, change, words):
    value, notes = end(altered(change), gain=3.0)
    assert value == 1.5 and len(notes) == 1 and words in notes[0]


@pytest.mark.parametrize(
    "change, words",
    [
        (('valueReference="7" ', 'valueReference="-1" '), "at_entry has the valueReference '-1'"),
        (('valueReference="7" ', ""), "at_entry has the valueReference None"),
        (('valueReference="7" ', 'valueReference="4294967296" '), "'4294967296', which is none"),
        (('<Real start="1"/>', ""), "its variable gain is of no type"),
        (("Model" + "Variables>", "Variables>"), "it has no ModelVariables"),
        (("<fmiModelDescription ", '<fmiModelDescription xmlns="urn:x" '), "its root element is {urn:x}fmiModelDescription"),
        (('name="gain" ', ""), "a variable has no name"),
        (('fmiVersion="2.0"', 'fmiVersion="2.1"'), "is FMI 2.1"),
        (('modelIdentifier="forgetful"', 'modelIdentifier="../forgetful"'), "is no modelIdentifier"),
    ],
)
def test_what_nobody_can_guess_is_a_sentence(altered, refused, change, words):
    path = altered(change)
    refused(lambda: single(path), words)


@pytest.mark.parametrize(
    "experiment, words",
    [
        ('startTime="2" stopTime="1"', "ends before it has begun"),
        ('startTime="0" stopTime="1.7976931348623157e308"', "has no end"),
        ('startTime="0" stopTime="1e300"', "has no end"),
    ],
)
def test_an_experiment_without_an_end_asks_for_one(altered, refused, experiment, words):
    path = altered(('startTime="0" stopTime="2"', experiment))
    refused(lambda: single(path), words, "--stop")
    assert single(path, stop=3.0).run.stop == 3.0


@pytest.mark.parametrize("size", ["0", "-1", "1e-12", "1e-320"])
def test_a_step_that_is_none_is_a_thousandth(altered, size):
    assert single(altered(('stepSize="0.1"', f'stepSize="{size}"'))).run.step == 2.0 / 1000


def test_what_matters_to_no_number_is_passed_over(altered):
    items = '<TypeDefinitions><SimpleType name="A"><Enumeration><Item name="a" value="1" colour="red"/></Enumeration></SimpleType></TypeDefinitions>'
    assert end(altered(("<ModelVariables>", f"{items}<ModelVariables>")), gain=3.0) == (1.5, [])


def test_states_that_the_structure_does_not_list_move_all_the_same(altered):
    """Of a ball that falls nothing would move without its derivatives: h = 1 - g t^2 / 2."""
    listed = '<Derivatives><Unknown index="2" dependencies=""/><Unknown index="3" dependencies="6"/></Derivatives>'
    path = altered((listed, ""), name="drop", binary="binaries/linux64/drop.so")
    table = master.run(path, step=0.05, stop=0.4).table
    assert table["drop.h"].iloc[-1] == pytest.approx(1 - 9.81 * 0.4**2 / 2, abs=1e-4)  # solved to 1e-6


def test_a_negated_alias_is_the_negative(altered):
    """FMI 1.0: of a ball that falls and bounces, what is recorded and what is set."""
    more = """<ScalarVariable name="sink" valueReference="1" causality="output" alias="negatedAlias"><Real/></ScalarVariable>
    <ScalarVariable name="again" valueReference="1" causality="output" alias="alias"><Real/></ScalarVariable>
    <ScalarVariable name="minus" valueReference="1" causality="output" variability="discrete" alias="negatedAlias"><Integer/></ScalarVariable>
    <ScalarVariable name="lift" valueReference="2" variability="parameter" alias="negatedAlias"><Real start="-9.81"/></ScalarVariable>
  </ModelVariables>"""
    path = altered(("</ModelVariables>", more), name="fall", binary="binaries/linux64/fall.so")
    table = master.run(path, settings={"lift": -1.6}, step=0.1, stop=1.2).table
    assert (table["fall.sink"] == -table["fall.v"]).all() and (table["fall.again"] == table["fall.v"]).all()
    assert table["fall.minus"].iloc[-1] == -table["fall.bounces"].iloc[-1] == -1
    first = table[table["time"] < 1.1]  # before it strikes
    assert first["fall.sink"].to_numpy() == pytest.approx(1.6 * first["time"].to_numpy(), abs=1e-9)


def test_capabilities_of_the_first_version_are_read(altered):
    said = '<Implementation><CoSimulation_StandAlone><Capabilities canInterpolateInputs="true" canHandleVariableCommunicationStepSize="true"/></CoSimulation_StandAlone></Implementation>'
    path = altered(("</fmiModelDescription>", f"{said}</fmiModelDescription>"), name="fall", binary="binaries/linux64/fall.so")
    told = read_description(path)[0].coSimulation
    assert (
        told.canInterpolateInputs and told.canHandleVariableCommunicationStepSize and not told.canBeInstantiatedOnlyOncePerProcess
    )


@pytest.mark.parametrize(
    "name, words",
    [("numberOfContinuousStates", "its equations cannot be solved"), ("numberOfEventIndicators", "is None, which is no number")],
)
def test_equations_that_nobody_counted_are_a_sentence(altered, refused, name, words):
    path = altered(lambda text: re.sub(f' {name}="[0-9]*"', "", text).encode(), name="fall", binary="binaries/linux64/fall.so")
    refused(lambda: single(path), f"its {name}", words)


@pytest.mark.parametrize(
    "change, words",
    [
        (('<Float64 name="u"', '<Float64 name="k" valueReference="9" derivative="99"/><Float64 name="u"'), "derivative of nothing: k"),
        (('<Float64 name="u"', '<Int32 name="k" valueReference="9" clocks="99"/><Float64 name="u"'), "clocks that are not there are left out: k"),
        (('fmiVersion="3.0"', 'fmiVersion="3"'), ""),
    ],
)  # fmt: skip
def test_slips_of_the_third_version(altered, change, words):
    path = altered(change, name="relaxation3", binary="binaries/x86_64-linux/relaxation3.so")
    assert len(master.run(path, settings={"rate": 1.0}, step=0.1, stop=0.5).table) == 6
    notes = read_description(path)[1]
    assert len(notes) == bool(words) and (not words or words in notes[0])


def test_sizes_that_nobody_tells_are_a_sentence(altered, refused):
    array = '<Float64 name="k" valueReference="9"><Dimension valueReference="99"/></Float64><Float64 name="u"'
    path = altered(('<Float64 name="u"', array), name="relaxation3", binary="binaries/x86_64-linux/relaxation3.so")
    refused(lambda: single(path), "the size of its array k is that of a variable that is not there")


@pytest.mark.parametrize(
    "rename, words",
    [
        (lambda name: f"forgetful/{name}", "all of it lies in a folder, 'forgetful'"),
        (lambda name: name.replace("modelDescription", "ModelDescription"), "'ModelDescription.xml' is taken as 'modelDescription.xml'"),
        (lambda name: name.replace("binaries", "Binaries"), "'Binaries' is taken as 'binaries'"),
        (lambda name: name.replace("linux64", "Linux64"), "'Linux64' is taken as 'linux64'"),
        (lambda name: name.replace("forgetful.so", "Forgetful.SO"), "'Forgetful.SO' is taken as 'forgetful.so'"),
    ],
)  # fmt: skip
def test_names_in_other_letters_and_a_folder_around_it(native, tmp_path, caplog, rename, words):
    path = tmp_path / "odd.fmu"
    with zipfile.ZipFile(native("forgetful")) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(rename(name), old.read(name) + b"\n" * name.endswith("xml"))
        new.writestr("resources/name.txt", words)  # another content than the others'
    assert end(path, gain=3.0)[0] == 1.5
    assert words in caplog.text


def test_a_folder_is_an_fmu(native, tmp_path, refused):
    """Alone, in a system, in an SSP; what is changed in it counts."""
    folder = tmp_path / "un packed"
    with zipfile.ZipFile(native("forgetful")) as archive:
        archive.extractall(folder)
    assert end(folder, gain=3.0) == (1.5, [])
    system = master.from_dict(
        {"components": {"f": {"fmu": "un packed", "start": {"offset": 1.0}}}, "run": {"stop": 0.5, "step": 0.1}}, tmp_path
    )
    system.run.open_inputs = True
    assert master.run(system).table["f.y"].iloc[-1] == 1.5
    packed = master.ssp.export(system, tmp_path / "s.ssp")
    assert master.run(packed).table["f.y"].iloc[-1] == 1.5
    with zipfile.ZipFile(packed) as archive:
        archive.extractall(tmp_path / "s")
    inner = next((tmp_path / "s" / "resources").glob("*.fmu"))
    with zipfile.ZipFile(inner) as archive:
        archive.extractall(inner.with_suffix(""))
    inner.unlink()
    inner.with_suffix("").rename(inner)
    assert master.run(tmp_path / "s").table["f.y"].iloc[-1] == 1.5
    description = folder / "modelDescription.xml"
    description.write_text(description.read_text().replace('name="gain"', 'name="slope"'))
    assert end(folder, slope=3.0) == (1.5, [])
    (folder / "resources").mkdir()
    (folder / "resources" / "link").symlink_to(native("forgetful"))
    refused(lambda: single(folder), "is a link or a device")
    empty = tmp_path / "empty"
    empty.mkdir()
    refused(lambda: master.run(master.from_dict({"components": {"f": {"fmu": "empty"}}}, tmp_path)), "is a folder but no FMU")


def test_variables_of_one_name_stay_apart(altered):
    """The second `gain` is the offset: setting gain sets the first alone, the other has a name of its own."""
    path = altered(('name="offset"', 'name="gain"'))
    value, notes = end(path, gain=3.0)
    assert value == 1.5 and notes == ["several variables are named 'gain'; the first is that, this one is 'gain (2)'"]
    assert end(path, **{"gain (2)": 2.0})[0] == 2.5


@pytest.mark.parametrize("name", ["for.getful", "for-getful 1", "1forgetful", "модель"])
def test_a_binary_has_any_name_of_a_file(altered, name):
    path = altered(('modelIdentifier="forgetful"', f'modelIdentifier="{name}"'), binary=f"binaries/linux64/{name}.so")
    assert end(path, gain=3.0)[0] == 1.5


def test_names_of_variables_are_texts(altered):
    name = "a.b[1,2].'q r'\"(x)%"
    assert end(altered(('name="gain"', "name=\"a.b[1,2].'q r'&quot;(x)%\"")), **{name: 3.0})[0] == 1.5


def test_platforms_and_archives_by_other_names(altered):
    assert end(altered(binary="binaries/x86_64-linux/forgetful.so"), gain=3.0)[0] == 1.5  # as in FMI 3.0
    assert end(altered(binary="binaries\\linux64\\forgetful.so"), gain=3.0)[0] == 1.5  # as some tools of Windows pack
    with pytest.warns(UserWarning, match="Duplicate name"):
        again = altered(more={"binaries/linux64/forgetful.so": b"", "a": b"1"})
    with pytest.raises(master.DescriptionError, match="is in it twice"):
        single(again)
    with pytest.warns(UserWarning, match="Duplicate name"), zipfile.ZipFile(path := altered(more={"a": b"1"}), "a") as archive:
        archive.writestr("a", b"1")
    assert end(path, gain=3.0)[0] == 1.5  # twice the same is once


def test_sources_alone_are_refused_with_what_to_do(altered, refused):
    path = altered(binary=None, more={"sources/forgetful.c": "int x;"})
    refused(lambda: single(path), "it has: c-code", "fmpy compile odd.fmu")


@pytest.mark.slow
def test_a_library_beside_the_binary_is_found(native, tmp_path, refused):
    """Linked to one that lies beside it, without a path: Linux alone would not look there."""
    source = Path(__file__).parents[1] / "native"
    text = (source / "relaxation" / "relaxation.c").read_text().replace('"../fmi2.h"', f'"{source / "fmi2.h"}"')
    said = {}
    for name, soname in (("found", ["-Wl,-soname,libfound.so"]), ("nameless", []), ("missing", ["-Wl,-soname,libmissing.so"])):
        folder, path = tmp_path / name, tmp_path / f"{name}.fmu"
        folder.mkdir()
        (folder / "half.c").write_text(f"double {name}(double x) {{ return x / 2; }}\n")
        (folder / "relaxation.c").write_text(f"double {name}(double);\ndouble needed(void) {{ return {name}(2); }}\n{text}")
        compiled = ["gcc", "-std=c99", "-shared", "-fPIC"]
        subprocess.run([*compiled, *soname, "-o", f"lib{name}.so", "half.c"], cwd=folder, check=True)
        linked = ["-o", "relaxation.so", "relaxation.c", source / "rest.c", "-L.", f"-l{name}", "-lm"]
        subprocess.run([*compiled, *linked], cwd=folder, check=True)
        with zipfile.ZipFile(native("relaxation")) as old, zipfile.ZipFile(path, "w") as new:
            new.writestr("modelDescription.xml", old.read("modelDescription.xml"))
            new.write(folder / "relaxation.so", "binaries/linux64/relaxation.so")
            if name != "missing":
                new.write(folder / f"lib{name}.so", f"binaries/linux64/lib{name}.so")
        if name == "found":
            assert len(master.run(single(path), stop=0.1).table) > 1
        else:
            said[name] = refused(lambda: master.run(single(path), stop=0.1))
    assert "libnameless.so, which it needs, lies beside it without a soname" in said["nameless"]
    assert "needs the system library libmissing.so" in said["missing"]
