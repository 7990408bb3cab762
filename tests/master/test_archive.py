"""Archives of strangers: refused before they take memory or disk, and nothing of them is left."""

import io
import stat
import struct
import tracemalloc
import zipfile
from importlib import import_module

import pytest

from selflock import master
from selflock.master import archive
from selflock.master.archive import root_of, unpack
from selflock.master.errors import DescriptionError


def zipped(path, entries, **options):
    """entries: (name or ZipInfo, content)."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, **options) as made:
        for name, content in entries:
            made.writestr(name, content)
    return path


def told(name, mode=0, flags=0):
    entry = zipfile.ZipInfo(name)
    entry.external_attr, entry.flag_bits = mode << 16, flags
    return entry


HOSTILE = {
    "../out": "outside", "a/../../out": "outside", "/etc/out": "outside", "C:/out": "outside", "a\\..\\out": "outside",
    "\x1b[31mred": "no name", "a:stream": "no name",
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
@pytest.mark.parametrize("unlimited", [False, True])
def test_names_that_leave_the_folder(tmp_path, name, unlimited):
    path = zipped(tmp_path / "a.fmu", [("good", b"1"), (told(name), b"2")])
    with pytest.raises(DescriptionError, match=HOSTILE[name]):
        unpack(path, tmp_path / "in" / "folder", "FMU", unlimited)
    assert [p.name for p in tmp_path.rglob("*")] == ["a.fmu"]


def encrypted(path):
    zipped(path, [("good", b"1" * 100)])
    data = bytearray(path.read_bytes())
    for sign, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        data[data.index(sign) + place] |= 1
    path.write_bytes(data)


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_what_is_no_plain_file(tmp_path):
    path = tmp_path / "a.fmu"
    cases = {
        "link or a device": lambda: zipped(path, [(told("link", stat.S_IFLNK | 0o777), b"/etc/passwd")]),
        "link or a device, ": lambda: zipped(path, [(told("pipe", stat.S_IFIFO | 0o777), b"")]),
        "encrypted": lambda: encrypted(path),
        "twice": lambda: zipped(path, [("a", b"1"), ("a", b"2")]),
        "twice ": lambda: zipped(path, [("a/b", b"1"), ("a//b", b"2")]),
        "below another": lambda: zipped(path, [("a", b"1"), ("a/b", b"2")]),
        "not a zip": lambda: path.write_bytes(b"PK\x05\x06"),
        "not a zip archive": lambda: path.write_bytes(b""),
    }  # fmt: skip
    for words, make in cases.items():
        make()
        with pytest.raises(DescriptionError, match=words.strip(" ,")):
            unpack(path, tmp_path / "folder", "FMU")
        assert not (tmp_path / "folder").exists()


@pytest.mark.slow
def test_too_many_entries(tmp_path):
    path = zipped(tmp_path / "a.fmu", [(f"e{k}", b"") for k in range(archive.ENTRIES + 1)])
    with pytest.raises(DescriptionError, match=f"{archive.ENTRIES + 1} entries.*At most {archive.ENTRIES} entries.*--unlimited"):
        unpack(path, tmp_path / "folder", "FMU")
    unpack(path, tmp_path / "folder", "FMU", unlimited=True)
    assert len(list((tmp_path / "folder").iterdir())) == archive.ENTRIES + 1


@pytest.mark.in_turn
@pytest.mark.slow
def test_a_bomb_takes_neither_memory_nor_disk(tmp_path):
    """3 GB of zeros in 3 MB, at the place of an FMU's resources."""
    path = tmp_path / "bomb.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        for k in range(6):
            with made.open(f"resources/{k}", "w") as file:
                for _ in range(8):
                    file.write(bytes(64 << 20))
    import_module("selflock.master.simulation")  # which takes memory of its own
    tracemalloc.start()
    with pytest.raises(DescriptionError, match="would take 3072 MiB"):
        master.run(master.from_dict({"components": {"a": {"fmu": str(path)}}}))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6


@pytest.mark.slow
def test_a_high_ratio_and_a_header_that_lies(tmp_path, monkeypatch):
    path = zipped(tmp_path / "a.fmu", [("zeros", bytes(100 << 20))])
    with pytest.raises(DescriptionError, match="times its size"):
        unpack(path, tmp_path / "folder", "FMU")
    data = bytearray(path.read_bytes())
    place = data.index(b"PK\x01\x02") + 24
    data[place : place + 4] = struct.pack("<I", 10)  # says 10 bytes
    path.write_bytes(data)
    with pytest.raises(DescriptionError, match="damaged"):
        unpack(path, tmp_path / "folder", "FMU")
    assert not (tmp_path / "folder").exists()
    good = zipped(tmp_path / "b.fmu", [(f"{k}", b"x" * 1000) for k in range(3)])
    monkeypatch.setattr(archive, "_checked", lambda opened, *_: [(one, one.filename) for one in opened.infolist()])
    monkeypatch.setattr(archive, "LARGEST", 2500)
    with pytest.raises(DescriptionError, match="more than it says"):
        unpack(good, tmp_path / "folder", "FMU")
    assert not (tmp_path / "folder").exists()


def test_a_list_of_contents_that_is_too_large(tmp_path):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as made:
        for k in range(400):
            entry = zipfile.ZipInfo(f"e{k}")
            entry.comment = b"c" * 65000
            made.writestr(entry, b"")
    (tmp_path / "a.fmu").write_bytes(content.getvalue())
    with pytest.raises(DescriptionError, match="list of contents"):
        unpack(tmp_path / "a.fmu", tmp_path / "folder", "FMU")


LAUGHS = (
    """<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "{0}">{1}]><fmiModelDescription fmiVersion="2.0">&b9;</fmiModelDescription>"""
)
LAUGHS = LAUGHS.format("ha" * 100, "".join(f'<!ENTITY b{k} "{f"&b{k - 1};" * 10}">' for k in range(1, 10)).replace("&b0;", "&b;"))
READS = '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><fmiModelDescription fmiVersion="2.0" modelName="&b;"/>'


@pytest.mark.parametrize(
    "text", [LAUGHS, READS, '<!DOCTYPE a SYSTEM "http://localhost/x.dtd"><a/>'], ids=["laughs", "reads", "asks"]
)
@pytest.mark.parametrize("code", ["utf-8", "utf-16"])
def test_no_document_types(tmp_path, text, code):
    fmu = zipped(tmp_path / "a.fmu", [("modelDescription.xml", text.replace('<?xml version="1.0"?>', "").encode(code))])
    with pytest.raises(DescriptionError, match="declares a document type"):
        master.run(master.from_dict({"components": {"a": {"fmu": str(fmu)}}}))
    ssp = zipped(tmp_path / "a.ssp", [("SystemStructure.ssd", text.encode() if code == "utf-8" else text.encode(code))])
    with pytest.raises(DescriptionError, match="declares a document type"):
        master.load(ssp)


def test_xml_of_any_size_is_not_read(tmp_path, monkeypatch):
    (tmp_path / "a.xml").write_text(f"<a b='1'>{' ' * 2000}</a>")
    assert root_of(tmp_path / "a.xml", "it") == {"b": "1"}
    monkeypatch.setattr(archive, "XML", 1000)
    with pytest.raises(DescriptionError, match="--unlimited"):
        root_of(tmp_path / "a.xml", "it")
    assert root_of(tmp_path / "a.xml", "it", unlimited=True) == {"b": "1"}
    (tmp_path / "a.xml").write_text("<?xml version='1.0' encoding='nonsense'?><a b='1'/>")
    assert root_of(tmp_path / "a.xml", "it") == {"b": "1"}
    for text in ("", "<", "no xml", "<?xml version='1.0' encoding='nonsense'?><a", "\0"):
        (tmp_path / "a.xml").write_text(text)
        with pytest.raises(DescriptionError, match="cannot be understood"):
            root_of(tmp_path / "a.xml", "it")


def test_a_structure_in_itself_comes_to_an_end(tmp_path):
    ssd = (
        '<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" version="1.0" name="a">'
        '<ssd:System name="s"><ssd:Elements><ssd:Component name="c" type="application/x-ssp-definition" source="SystemStructure.ssd"/>'
        "</ssd:Elements></ssd:System></ssd:SystemStructureDescription>"
    )
    path = zipped(tmp_path / "a.ssp", [("SystemStructure.ssd", ssd)])
    with pytest.raises(DescriptionError, match="in one another"):
        master.load(path)


@pytest.mark.slow
def test_a_script_that_is_not_there_is_a_message(tmp_path, counter):
    for text in (b"", b"no_such_script", b"../../../etc/passwd", b"\xff\xfe\x00", b"a" * 5000):
        with zipfile.ZipFile(counter) as good:
            entries = [(n, text if n == "resources/slavemodule.txt" else good.read(n)) for n in good.namelist()]
        with pytest.raises(DescriptionError, match="slavemodule.txt"):
            master.run(master.from_dict({"components": {"a": {"fmu": str(zipped(tmp_path / "a.fmu", entries))}}}))


def test_paths_and_files_that_no_system_takes_are_one_message(tmp_path):
    with pytest.raises(DescriptionError, match="a\\\\x00b.*control characters"):
        master.from_dict({"components": {"a": {"fmu": "a\0b"}}})
    with pytest.raises(DescriptionError, match="no path"):
        master.run(master.System(components={"a": master.Component(fmu="a\0b")}))
    with pytest.raises(DescriptionError, match="a\\\\x00b"):
        master.load("a\0b.toml")
    for text in ("x = " + "[" * 100_000, "x = " + "{a=" * 50_000, "[" * 100_000):
        (tmp_path / "system.toml").write_text(text)
        with pytest.raises(DescriptionError, match="not valid TOML"):
            master.load(tmp_path / "system.toml")


MANY = """
<ScalarVariable name="v{k}" valueReference="0" causality="{causality}" variability="continuous"{initial}>
<Real/>
</ScalarVariable>"""


@pytest.mark.in_turn
@pytest.mark.parametrize("causality", ["output", "input", "local"])
@pytest.mark.slow
def test_a_hundred_thousand_variables_load(tmp_path, native, causality):
    """In seconds. Work that grows with the square of their number, as it once did, would take an hour here."""
    count = 100_000
    path = tmp_path / f"{count}.fmu"
    initial = ' initial="calculated"' if causality == "output" else ""
    more = "".join(MANY.format(k=k, causality=causality, initial=initial) for k in range(count))
    with zipfile.ZipFile(native("relaxation")) as good:
        zipped(
            path,
            [(n, good.read(n).replace(b"</ModelVariables>", more.encode() + b"</ModelVariables>")) for n in good.namelist()],
        )
    tables = {"run": {"stop": 0.1, "step": 0.1, "open_inputs": True}, "components": {"a": {"fmu": str(path)}}}
    table = master.run(master.from_dict(tables)).table
    assert len(table.columns) >= (count if causality == "output" else 1)
