"""SSP files as trees of XML: where they lie, unpacking, schema checks.

Source: System Structure and Parameterization 1.0, Modelica Association, 2019. The schemas are those that FMPy ships.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from urllib.parse import SplitResult, parse_qs, unquote, urlsplit

import fmpy.ssp
from lxml import etree

from .. import archive
from ..errors import DescriptionError
from ..folder import is_fmu
from .mend import BASE, NAMESPACES, bare, mend, tree

FIRST = "SystemStructure.ssd"
ANNOTATION = "org.selflock.run"  # how our master ran the system: step, algorithm, order


def tag(name: str) -> str:
    """'ssd:System' as the qualified name that lxml uses."""
    prefix, _, local = name.partition(":")
    return f"{{{NAMESPACES[prefix]}}}{local}"


@cache
def _schema(name: str) -> etree.XMLSchema:
    folder = Path(fmpy.ssp.__file__).parent / "schema"
    return etree.XMLSchema(etree.parse(str(folder / f"SystemStructure{name}.xsd")))


def check(root: etree._Element, what: str) -> None:
    """Hold a document (ssd, ssv or ssm root) to its schema; DescriptionError names the line and what is wrong."""
    schema = _schema(root.tag[len("{" + BASE) :].partition("}")[0])
    if not schema.validate(root):
        first = schema.error_log[0]
        raise DescriptionError(f"{what}, line {first.line}: not valid SSP 1.0: {first.message}")


def parse(path: Path, notes: list[str]) -> etree._Element:
    """Read, mend and check one XML document of an SSP; what was mended is told in `notes`. Raises DescriptionError."""
    try:
        archive.root_of(path, path.name)
        root = tree(path, notes)
    except (OSError, etree.XMLSyntaxError) as error:
        raise DescriptionError(f"{path.name}: cannot be read as XML: {error}") from None
    if not str(root.tag).startswith("{" + BASE):
        raise DescriptionError(f"{path.name}: the root element is {root.tag}, not one of SSP (namespace {BASE}…).")
    return sound(root, path.name, notes)


def sound(root: etree._Element, file: str, notes: list[str]) -> etree._Element:
    """Mend and check a document, or one that stands inside another."""
    mend(root, file, notes)
    check(bare(root), file)
    return root


def opened(path: Path, folder: Path, variant: str, unlimited: bool, notes: list[str]) -> Path:
    """The .ssd that `path` leads to: in an archive, unpacked into `folder`, in a folder like an unpacked one, or itself."""
    if path.suffix.lower() == ".ssd" and not path.is_dir():
        if not path.is_file():
            raise DescriptionError(f"{path}: there is no such file.")
        return path
    if not path.is_dir():
        document = unpack(path, folder, notes, unlimited, variant)
        if variant in (FIRST, document.name):
            return document
        folder = document.parent
    else:
        folder = path
    if not (folder / variant).is_file():
        more = "" if path.suffix else ", nor an OspSystemStructure.xml or a modelDescription.xml"
        raise DescriptionError(f"{path}: there is no {variant} in it{more}.")
    return folder / variant


def unpack(path: Path, folder: Path, notes: list[str], unlimited: bool = False, variant: str = FIRST) -> Path:
    """Unpack an .ssp into a folder; its .ssd. Raises DescriptionError for a missing, corrupt or hostile archive."""
    archive.unpack(path, folder, "SSP", unlimited)
    for name in (variant, FIRST):
        if (folder / name).is_file():
            return folder / name
    found = sorted(folder.glob("*.ssd")) or sorted(folder.glob(f"*/{FIRST}"))  # packed with the folder it was in
    if len(found) != 1:
        others = ", ".join(one.relative_to(folder).as_posix() for one in found[:5])
        said = f" It has {others}: unpack it and run one of these, or load(path, variant=…) in Python." if found else ""
        raise DescriptionError(f"{path}: not an SSP: {FIRST} is missing in it.{said}")
    notes.append(f"{path.name} has no {FIRST} where it should be; {found[0].relative_to(folder).as_posix()!r} is taken as that")
    return found[0]


def inside(uri: str, base: Path, root: Path, what: str, notes: list[str]) -> Path:
    """The file that a relative URI names, seen from `base`. Absolute URIs and files outside `root` are refused."""
    try:
        return _inside(uri, base, root, what, notes)
    except (OSError, ValueError) as error:  # too long, or with a zero byte
        raise DescriptionError(
            f"{what}: source {uri[:200]!r} is no path of a file: {getattr(error, 'strerror', None) or error}."
        ) from None


def _inside(uri: str, base: Path, root: Path, what: str, notes: list[str]) -> Path:
    if (path := _as_written(uri, base, root.resolve())) is not None:
        notes.append(f"{what}: source {uri!r} is taken as {path.relative_to(root.resolve()).as_posix()!r}")
        return path
    parts = split(uri)
    if parts.scheme or parts.netloc:
        raise DescriptionError(f"{what}: source {uri!r} is not a relative path inside the SSP; only those are supported.")
    path, root = (base / unquote(parts.path)).resolve(), root.resolve()
    if not path.is_relative_to(root):
        raise DescriptionError(f"{what}: source {uri!r} lies outside the SSP, where nothing is read: copy it into it.")
    if not path.is_file() and not is_fmu(path):
        alike = root
        for part in path.relative_to(root).parts:  # as systems find it that do not tell A from a
            names = [entry for entry in _names(alike, root) if entry.name.lower() == part.lower()]
            alike = next((entry for entry in names if entry.name == part), names[0] if len(names) == 1 else root / part / "?")
        if not (alike.is_file() or is_fmu(alike)) or not alike.resolve().is_relative_to(root):
            raise DescriptionError(f"{what}: source {uri!r} is not in the SSP.")
        notes.append(f"{what}: source {uri!r} is taken as {alike.relative_to(root).as_posix()!r}")
        path = alike.resolve()
    return path


def _as_written(uri: str, base: Path, root: Path) -> Path | None:
    """The file of a source that is no relative URI but a path as it is written (with # or %), or begins at the archive's root."""
    if split(uri).path == uri and not uri.startswith("/") and unquote(uri) == uri:
        return None
    plain = re.sub("^file:/*", "/", uri)
    path = (root / plain.lstrip("/") if plain.startswith("/") else base / uri).resolve()
    return path if path.is_relative_to(root) and (path.is_file() or is_fmu(path)) else None


def split(uri: str) -> SplitResult:
    """The parts of a URI; what is none, such as one with half a bracket, is a path."""
    try:
        return urlsplit(uri)
    except ValueError:
        return SplitResult("", "", uri, "", "")


def proxied(uri: str) -> tuple[str, str | None]:
    """The file in OSP's proxyfmu://machine:port?file=X.fmu, and "machine:port", "" without a port; of any other URI itself, None."""
    parts = split(uri)
    files = parse_qs(parts.query).get("file", [])
    if parts.scheme not in ("proxyfmu", "proxy-fmu") or len(files) != 1:
        return uri, None
    return files[0], parts.netloc if parts.netloc.rpartition(":")[2].isdecimal() else ""


def _names(folder: Path, root: Path) -> list[Path]:
    return sorted(folder.iterdir()) if folder.is_dir() and folder.resolve().is_relative_to(root) else []
