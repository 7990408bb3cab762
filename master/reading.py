"""The modelDescription.xml of an FMU, slips that real ones have mended where the meaning is clear, each told in a sentence.

FMPy reads it. What FMPy cannot read is mended and read again; what it then still cannot is refused with its first word.
"""

from __future__ import annotations

import tempfile
import zipfile
from pathlib import Path

import fmpy
from fmpy.model_description import ModelDescription
from lxml import etree

from ..fmus.place import ending
from . import archive, xml
from .described import INTERFACES, NEGATED, number_of, offered
from .errors import DescriptionError
from .folder import DESCRIPTION
from .mending import Note, mend

REFERENCES = 2**32 - 1
TYPES = ("Real", "Integer", "Boolean", "String", "Enumeration")
TRUE = ("true", "1")
BLANKS = str.maketrans("\t\n\r", "   ")
CAPABILITIES = ("canHandleVariableCommunicationStepSize", "canBeInstantiatedOnlyOncePerProcess", "canInterpolateInputs")


def read_description(path: Path) -> tuple[ModelDescription, list[str]]:
    """What an FMU, packed or unpacked, says of itself, and what was mended in it. Raises whatever a parser meets."""
    root, notes = xml.root_of(_content(path))
    said = dict[str, list[str]]()

    def note(what: str, name: object) -> None:
        said.setdefault(what, []).append(str(name))

    _plain(root, note)
    _complete(root)
    _unheard(root, note)
    try:
        described = _read(root)  # without comments, which FMPy takes for a type where they stand in front of one
    except Exception as error:
        try:
            mend(root, note)
            described = _read(root)
        except DescriptionError:
            raise
        except Exception:
            raise error from None
    notes += [f"{what}: {', '.join(n[:5])}" + (f" and {len(n) - 5} more" if len(n) > 5 else "") for what, n in said.items()]
    if described.fmiVersion == "1.0" and described.coSimulation is not None:
        for node in root.iter("Capabilities"):  # which FMPy passes over
            for name in CAPABILITIES:
                setattr(described.coSimulation, name, node.get(name) in ("true", "1"))
        described.coSimulation.needsExecutionTool = next(root.iter("CoSimulation_Tool"), None) is not None
    if described.fmiVersion == "1.0":
        negated = {node.get("name") for node in root.iterfind(f"ModelVariables/*[@alias='{NEGATED}']")}
        for variable in described.modelVariables:
            variable.alias = NEGATED if variable.name in negated else None  # which FMPy passes over, too
    if described.fmiMajorVersion == 3:
        _third(root, described)
    return described, notes + _doubles(described)


def _third(root: etree._Element, described: ModelDescription) -> None:
    """What FMPy passes over in FMI 3.0."""
    for name, way in offered(described).items():
        node = root.find(f"{INTERFACES[name][0].upper()}{INTERFACES[name][1:]}")
        if node is not None and "providesDirectionalDerivatives" in node.attrib:
            way.providesDirectionalDerivative = node.get("providesDirectionalDerivatives") in TRUE
    updated = {node.get("name") for node in root.iterfind("ModelVariables/*") if node.get("intermediateUpdate") in TRUE}
    for variable in described.modelVariables:
        variable.intermediateUpdate = variable.name in updated


def _content(path: Path) -> bytes:
    """Its description's bytes, of whatever lies there: nothing of it was looked at yet."""
    ending(path)
    if path.is_dir():
        if (path / DESCRIPTION).is_symlink():
            raise DescriptionError(f"its {DESCRIPTION} is a link, no file; nothing outside the folder is read.")
        if (size := ending(path / DESCRIPTION).stat().st_size) > archive.XML:
            raise _too_large(size)
        return (path / DESCRIPTION).read_bytes()
    if (size := archive.contents(path)) > archive.DIRECTORY:
        raise _too_large(size)
    with zipfile.ZipFile(path) as packed:
        names = packed.namelist()
        alike = [one for one in names if one.lower().rpartition("/")[2] == DESCRIPTION.lower() and one.count("/") < 2]
        name = DESCRIPTION if DESCRIPTION in names else min(alike, key=lambda one: one.count("/"), default=DESCRIPTION)
        if (size := packed.getinfo(name).file_size) > archive.XML:
            raise _too_large(size)
        return packed.read(name)


def _too_large(size: int) -> DescriptionError:
    return DescriptionError(f"it has {size >> 20} MiB; at most {archive.XML >> 20} MiB are read.")


def _read(root: etree._Element) -> ModelDescription:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "modelDescription.xml"
        etree.ElementTree(root).write(str(file), encoding="utf-8", xml_declaration=True)
        return fmpy.read_model_description(str(file), validate=False)


def _counts(root: etree._Element) -> None:
    """FMI 1.0: how many states and event indicators there are matters to model exchange alone, which cannot do without."""
    for name in ("numberOfContinuousStates", "numberOfEventIndicators"):
        if not (root.get(name) or "").strip().isdecimal():
            if root.find("Implementation") is None:
                raise DescriptionError(f"its {name} is {root.get(name)!r}, which is no number; its equations cannot be solved.")
            root.set(name, "0")


def version_of(text: str) -> str:
    """A version of FMI as it should be written: "2" and " 2.0" are "2.0"."""
    text = text.strip()
    return f"{text}.0" if text in ("1", "2", "3") else text


def _plain(root: etree._Element, note: Note) -> None:
    """What FMI has no namespace for, the version in its words, and names that are one line."""
    space = etree.QName(root).namespace or ""
    if "fmi" in space.lower():
        note("FMI has no namespace; this one is left out", space)
        for node in list(root.iter(f"{{{space}}}*")):
            node.tag = etree.QName(node).localname
        etree.cleanup_namespaces(root)
    root.set("fmiVersion", version_of(root.get("fmiVersion", "")))
    for node in root.iterfind("ModelVariables/*"):
        name = node.get("name", "")
        if (plain := name.translate(BLANKS)) != name:  # as xs:normalizedString, which a name is, has it
            note("a line break or tab in a name is a blank", plain)
            node.set("name", plain)


def _complete(root: etree._Element) -> None:
    """Refuse by name what lacks what nobody can guess: FMPy passes over it, or takes a type from the variable before."""
    if root.tag != "fmiModelDescription":
        raise DescriptionError(f"its root element is {root.tag}, not fmiModelDescription.")
    variables = root.find("ModelVariables")
    if variables is None:
        raise DescriptionError("it has no ModelVariables.")
    if root.get("fmiVersion", "").startswith("1."):
        _counts(root)
    typed = not root.get("fmiVersion", "").startswith("3.")
    for node in variables:
        name = node.get("name")
        if name is None:
            raise DescriptionError(f"line {node.sourceline}: a variable has no name.")
        reference = node.get("valueReference", "").strip()
        if not reference.isdecimal() or int(reference) > REFERENCES:
            raise DescriptionError(f"its variable {name} has the valueReference {node.get('valueReference')!r}, which is none.")
        if typed and not any(child.tag in TYPES for child in node):
            raise DescriptionError(f"its variable {name} is of no type.")


def _unheard(root: etree._Element, note: Note) -> None:
    """Mend what FMPy reads as something else: an index below 1 counts from the end in Python, and True is no true."""
    for way in root.iter("CoSimulation", "ModelExchange", "ScheduledExecution"):
        for name, text in way.attrib.items():
            if (
                name.startswith(("can", "needs", "provides", "has", "is"))
                and text.lower() in ("true", "false")
                and text != text.lower()
            ):
                note(f"{text} is taken as {text.lower()}", name)
                way.set(name, text.lower())
    known = list(root.iterfind("ModelVariables/*"))
    references = {node.get("valueReference") for node in known}
    for node in list(root.iterfind("ModelStructure//*")):
        _unknown(node, len(known), references, note)
    if root.get("fmiVersion", "").startswith("2."):
        derivatives = [number_of(holder.get("derivative")) for node in known for holder in node]
        if root.find("ModelExchange") is not None and root.find("ModelStructure/Derivatives") is None and any(derivatives):
            _derivatives(root, note)
        for node in known:
            for holder in node:
                derivative = number_of(holder.get("derivative", "1"))
                if derivative is None or not 1 <= derivative <= len(known):
                    note("the derivative of what is not there; it is the derivative of nothing", node.get("name"))
                    del holder.attrib["derivative"]


def _derivatives(root: etree._Element, note: Note) -> None:
    """The derivatives of states where the structure lists none: by their own word. Without them nothing would move."""
    structure = root.find("ModelStructure")
    if structure is None:
        structure = etree.SubElement(root, "ModelStructure")
    listed = etree.SubElement(structure, "Derivatives")
    for index, node in enumerate(root.iterfind("ModelVariables/*"), 1):
        if any(holder.get("derivative") for holder in node):
            etree.SubElement(listed, "Unknown", index=str(index))
            note("the model structure lists no derivatives; they are those that say of what", node.get("name"))


def _doubles(described: ModelDescription) -> list[str]:
    """Variables of one name: each but the first gets a number behind it, so that none stands in another's place."""
    seen, notes = dict[str, int](), []
    for variable in described.modelVariables:
        name = variable.name
        seen[name] = seen.get(name, 0) + 1
        if seen[name] > 1:
            variable.name = f"{name} ({seen[name]})"
            notes.append(f"several variables are named {name!r}; the first is that, this one is {variable.name!r}")
    return notes


def _unknown(node: etree._Element, count: int, references: set[str | None], note: Note) -> None:
    """An entry of the model structure: what names nothing is left out."""

    def there(text: str | None) -> bool:
        if "valueReference" in node.attrib:
            return text in references
        number = number_of(text)
        return number is not None and 1 <= number <= count

    if "index" not in node.attrib and "valueReference" not in node.attrib:
        return
    own = node.get("index", node.get("valueReference"))
    if not there(own):
        parent = node.getparent()
        if parent is not None:
            parent.remove(node)
        note("an entry of the model structure names no variable; it is left out", str(own))
        return
    if node.get("dependencies") is not None:
        words = node.get("dependencies", "").split()
        if all(map(there, words)):
            node.set("dependencies", " ".join(words))
        else:
            note("dependencies of the model structure name no variable; they are taken as not told", str(own))
            del node.attrib["dependencies"]
