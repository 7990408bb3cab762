"""What other exporters write: descriptions and archives that are not as the standard has them, read where their meaning is clear."""

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
                new.writestr(binary, old.read(f"binaries/linux64/{name}.so"))
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
        (("canHandleVariableCommunicationStepSize=\"true\"", 'canHandleVariableCommunicationStepSize="True"'), "True is taken as true"),
        ((' variability="fixed"', ""), 'taken as "fixed": gain'),
        (('index="8"', 'index="0"'), "names no variable; it is left out: 0"),
        (('index="8"', 'index="-1"'), "names no variable; it is left out: -1"),
        (('index="8"', 'index="80"'), "names no variable; it is left out: 80"),
        (('dependencies="7"', 'dependencies="7,1"'), "taken as not told: 5"),
        (('<Integer start="1"/>', '<Integer start="1" declaredType="Count"/>'), "'Count' is not defined"),
        (('name="at_entry" valueReference="7" causality="output"><Real/>', 'name="at_entry" valueReference="7" causality="output"><Real derivative="-1"/>'), "derivative of nothing: at_entry"),
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
