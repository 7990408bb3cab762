"""An .ssd beside its files and an unpacked folder run as their archive does; nothing outside is read, nothing there written."""

import re
import shutil
import zipfile

import pytest

from selflock import master
from selflock.master.errors import DescriptionError
from selflock.master.ssp import load, read

from .test_ssp_read import SINK, SOURCE, A, B, archive, connection, flat_pair


@pytest.fixture
def packed(native, system, tmp_path):
    made = system(
        {"a": (native("relaxation"), {"rate": 3.0}), "b": (native("relaxation"), {"rate": 1.0})},
        {"b.u": "a.x"},
        step=0.1,
        open_inputs=True,
    )
    return master.ssp.export(made, tmp_path / "s.ssp")


def everything(folder):
    return sorted(path.relative_to(folder) for path in folder.rglob("*"))


def test_a_folder_and_an_ssd_run_as_their_archive(packed, tmp_path):
    folder = tmp_path / "open"
    with zipfile.ZipFile(packed) as whole:
        whole.extractall(folder)
    before = everything(folder)
    table = master.run(packed).table
    assert len(table) == 11
    for path in (folder, folder / "SystemStructure.ssd", str(folder)):
        assert master.run(path).table.equals(table)
    shutil.copy(folder / "SystemStructure.ssd", folder / "Other.SSD")
    assert master.run(folder / "Other.SSD").table.equals(table)
    assert load(folder, variant="Other.SSD").components.keys() == {"a", "b"}
    (folder / "Other.SSD").unlink()
    assert everything(folder) == before


def opened(tmp_path, extra=None):
    """A pair of FMUs in a folder, one of them in an .ssp of its own."""
    inner = archive(
        tmp_path / "inner.ssp",
        '<ssd:System name="I"><ssd:Connectors><ssd:Connector name="out" kind="output"/></ssd:Connectors>'
        f"<ssd:Elements>{A}</ssd:Elements><ssd:Connections>{connection('A.y', 'out')}</ssd:Connections></ssd:System>",
        extra={"resources/source.fmu": SOURCE},
    )
    outer = '<ssd:Component name="Sub" type="application/x-ssp-package" source="resources/inner.ssp"/>'
    path = archive(tmp_path / "a.ssp", flat_pair(connection("Sub.out", "B.u"), inner_a=outer), extra={"resources/sink.fmu": SINK})
    folder = tmp_path / "open"
    with zipfile.ZipFile(path) as whole:
        whole.extractall(folder)
    shutil.copy(inner, folder / "resources" / "inner.ssp")
    return folder


def test_an_archive_in_a_folder_is_not_unpacked_there(tmp_path):
    folder = opened(tmp_path)
    before = everything(folder)
    assert read(folder, tmp_path / "room").connections["B", "u"][0] == ("Sub/A", "y")
    assert everything(folder) == before and any((tmp_path / "room").iterdir())


@pytest.mark.parametrize(
    "source", ["../sink.fmu", "link.fmu", "away/sink.fmu", "/etc/passwd", "file:///etc/passwd", "AWAY/sink.fmu"]
)
def test_nothing_outside_the_folder_is_read(tmp_path, source):
    folder = opened(tmp_path)
    outside = tmp_path / "outside"
    outside.mkdir()
    for place in (tmp_path, outside):
        shutil.move(shutil.copy(folder / "resources" / "sink.fmu", tmp_path / "copy"), place / "sink.fmu")
    (folder / "link.fmu").symlink_to(tmp_path / "sink.fmu")
    (folder / "away").symlink_to(outside)
    document = folder / "SystemStructure.ssd"
    document.write_text(document.read_text().replace("resources/sink.fmu", source))
    for path in (folder, document):
        with pytest.raises(
            DescriptionError, match=r"B: source .* (lies outside|is not in|is not a relative path inside) the SSP"
        ):
            read(path, tmp_path / "room")


def test_what_an_archive_in_it_names_lies_in_that(tmp_path):
    folder = opened(tmp_path)
    archive(
        folder / "resources" / "inner.ssp",
        f'<ssd:System name="I"><ssd:Elements>{B.replace("resources/", "../../resources/")}</ssd:Elements></ssd:System>',
    )
    with pytest.raises(DescriptionError, match="Sub/B: source .* lies outside"):
        read(folder, tmp_path / "room")


def test_a_folder_that_is_none(tmp_path):
    with pytest.raises(DescriptionError, match="there is no SystemStructure.ssd in it"):
        read(tmp_path, tmp_path / "room")
    with pytest.raises(DescriptionError, match="there is no such file"):
        read(tmp_path / "none.ssd", tmp_path / "room")
    (tmp_path / "bomb.ssd").write_text('<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>')
    with pytest.raises(DescriptionError, match="document type"):
        read(tmp_path / "bomb.ssd", tmp_path / "room")


@pytest.mark.parametrize(
    "source, words",
    [
        ("a%00b.fmu", "is no path of a file"),
        ("a" * 5000, "is no path of a file"),
        ("//[::1/x.fmu", "outside the SSP"),
        ("resources/linked", "modelDescription.xml is a link"),
    ],
)
def test_a_source_that_is_none_is_one_sentence(packed, tmp_path, source, words):
    folder = tmp_path / "open"
    with zipfile.ZipFile(packed) as whole:
        whole.extractall(folder)
    (folder / "resources" / "linked").mkdir()
    (folder / "resources" / "linked" / "modelDescription.xml").symlink_to("/etc/passwd")
    document = folder / "SystemStructure.ssd"
    text, count = re.subn(r'source="resources/[^"]*"', f'source="{source}"', document.read_text(), count=1)
    assert count == 1
    document.write_text(text)
    with pytest.raises(DescriptionError, match=words) as told:
        load(folder)
    assert len(str(told.value)) < 400
