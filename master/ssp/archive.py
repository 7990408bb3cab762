"""SSP 1.0 files as trees of XML: unpacking, schema checks, namespaces.

Source: System Structure and Parameterization 1.0, Modelica Association, 2019. The schemas are those that FMPy ships.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

import fmpy.ssp
from lxml import etree

from .. import archive
from ..errors import DescriptionError

BASE = "http://ssp-standard.org/SSP1/SystemStructure"
NAMESPACES = {
    "ssd": BASE + "Description",
    "ssc": BASE + "Common",
    "ssv": BASE + "ParameterValues",
    "ssm": BASE + "ParameterMapping",
}
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


def parse(path: Path) -> etree._Element:
    """Read and check one XML document of an SSP. Raises DescriptionError."""
    try:
        archive.root_of(path, path.name)
        root = etree.parse(str(path), etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)).getroot()
    except (OSError, etree.XMLSyntaxError) as error:
        raise DescriptionError(f"{path.name}: cannot be read as XML: {error}") from None
    if not str(root.tag).startswith("{" + BASE):
        raise DescriptionError(f"{path.name}: the root element is {root.tag}, not one of SSP 1.0 (namespace {BASE}…).")
    check(root, path.name)
    return root


def unpack(path: Path, folder: Path, unlimited: bool = False) -> Path:
    """Unpack an .ssp into a folder; the folder. Raises DescriptionError for a missing, corrupt or hostile archive."""
    archive.unpack(path, folder, "SSP", unlimited)
    if not (folder / "SystemStructure.ssd").is_file():
        raise DescriptionError(f"{path}: not an SSP: SystemStructure.ssd is missing in it.")
    return folder


def inside(uri: str, base: Path, root: Path, what: str) -> Path:
    """The file that a relative URI names, seen from `base`. Absolute URIs and files outside `root` are refused."""
    parts = urlsplit(uri)
    if parts.scheme or parts.netloc:
        raise DescriptionError(f"{what}: source {uri!r} is not a relative path inside the SSP; only those are supported.")
    path = (base / unquote(parts.path)).resolve()
    if not path.is_relative_to(root.resolve()):
        raise DescriptionError(f"{what}: source {uri!r} lies outside the SSP, which is not supported.")
    if not path.is_file():
        raise DescriptionError(f"{what}: source {uri!r} is not in the SSP.")
    return path
