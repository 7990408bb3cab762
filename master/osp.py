"""A system structure of the Open Simulation Platform, OspSystemStructure.xml, as a system.

Its algorithm fixedStep is Jacobi with a base step, of which a simulator's own step is the next whole multiple below.
Values are passed on as they are: OSP converts no units. Of a connection the end that is an output gives; groups of
variables, which an OspModelDescription.xml beside the FMU or beside the structure names, are connected in their order.
Functions act at each communication point without a step: a linear transformation in its connections, a sum as a part.

Sources: libcosim's OspSystemStructure.xsd, osp_config_parser.cpp, fixed_step_algorithm.cpp; OspModelDescription 1.0.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from fmpy.model_description import ModelDescription
from lxml import etree

from ..fmus.variable import Variable
from . import archive, xml
from .described import is_name, number_of
from .errors import DescriptionError
from .face import Part
from .reading import read_description
from .ssp.archive import proxied, split
from .ssp.others import Others
from .system import System, from_dict

FILE = "OspSystemStructure.xml"
BASE_STEP = 0.1  # s, where none is told; libcosim's
GIVING = ("output", "calculatedParameter")
End = tuple[str, str]  # (simulator or function, variable)


def is_osp(path: Path) -> bool:
    """Whether it is one, or a folder with one in it."""
    return path.suffix.lower() == ".xml" or (path / FILE).is_file()


def load(path: Path) -> System:
    """The system of an OspSystemStructure.xml, or of a folder with one in it. FMUs lie where it says, relative to it.

    Raises DescriptionError.
    """
    path = path / FILE if path.is_dir() else path
    try:
        archive.root_of(path, path.name)
        root, notes = xml.root_of(path.read_bytes())
    except OSError as error:
        raise DescriptionError(f"{path} cannot be read: {error.strerror or error}.") from None
    except etree.XMLSyntaxError as error:
        raise DescriptionError(f"{path.name}: cannot be read as XML: {error}") from None
    for node in root.iter(tag=etree.Element):
        node.tag = etree.QName(node).localname  # namespaces differ from version to version
    if root.tag != "OspSystemStructure":
        raise DescriptionError(
            f"{path.name}: its root element is {root.tag}. Of .xml files systems are read from an {FILE} alone; of an unpacked FMU "
            "give the folder that its modelDescription.xml lies in."
        )
    return _Structure(path, root, [f"{path.name}: {note}" for note in notes]).system()


class _Structure:
    def __init__(self, path: Path, root: etree._Element, notes: list[str]):
        self.path, self.root, self.notes = path, root, notes
        self.described: dict[str, ModelDescription] = {}
        self.files: dict[str, Path] = {}  # of FMUs, by simulator
        self.causality: dict[End, str] = {}
        self.units: dict[End, str] = {}
        self.others = Others(step=self._number("BaseStepSize", BASE_STEP), algorithm="jacobi")
        self.connections: dict[str, dict[str, Any]] = {}  # by target
        self.bonds: dict[str, list[tuple[End, End]]] = {}  # (source, target) by the bond's name

    def system(self) -> System:
        start, stop = self._number("StartTime", 0.0), self._number("EndTime", None)
        stop = start + 1.0 if stop is None else stop
        if not self.others.step > 0.0 or not stop > start:
            raise DescriptionError(f"{self.path.name}: a base step above 0 and an end behind the start are wanted.")
        components = {node.get("name", ""): self._simulator(node) for node in self.root.iterfind("Simulators/Simulator")}
        run = self.others.run(self.others.step, stop - start) | {"start": start, "stop": stop, "open_inputs": True}
        for name, component in components.items():
            component |= self.others.component(name, run["step"])
        functions = {node.get("name", ""): node for node in self.root.iterfind("Functions/*")}
        if both := functions.keys() & components.keys():
            raise DescriptionError(f"{self.path.name}: a simulator and a function are both named {min(both)!r}.")
        for name, node in functions.items():
            if (part := self._function(name, node)) is not None:
                components[name] = part
        for one in self.root.iterfind("Connections/*"):
            self._connect(one)
        self._transform(functions)
        algorithm = (self.root.findtext("Algorithm") or "fixedStep").strip()
        if algorithm != "fixedStep":
            self.notes.append(
                f"the algorithm {algorithm} is not used: all steps are of one size here; [run] step_control follows the energy"
            )
        told: dict[str, Any] = {
            "system": {"name": self.path.parent.resolve().name or "system"},
            "run": run,
            "components": components,
        }
        told |= {"connections": self.connections, "bonds": self._bonds()}
        system = from_dict(told, self.path.parent)
        system.description = " ".join((self.root.findtext("Description") or "").split())
        system.notes = self.notes + self.others.notes
        return system

    def _number(self, name: str, otherwise: Any) -> Any:
        text = self.root.findtext(name)
        if text is None or not text.strip():
            return otherwise
        if (number := number_of(text)) is None:
            raise DescriptionError(f"{self.path.name}: {name} = {text.strip()!r} is no number.")
        return number

    # --- what there is --------------------------------------------------------------------------------------------------

    def _simulator(self, node: etree._Element) -> dict[str, Any]:
        name, where = node.get("name", ""), f"{self.path.name}, line {node.sourceline}"
        source, place = proxied(node.get("source", ""))
        parts = split(source)
        if not name or not source or parts.scheme not in ("", "file"):
            raise DescriptionError(f"{where}: a simulator needs a name, and a source that is a path or a file:// URI.")
        file = self.path.parent / unquote(parts.path)
        try:
            description, mended = read_description(file)
        except FileNotFoundError:
            raise DescriptionError(f"{name}: there is no FMU at {file}.") from None
        except OSError as error:
            raise DescriptionError(f"{name}: {source} cannot be read: {error.strerror or error}.") from None
        except Exception as error:  # fmpy raises whatever its parser meets
            raise DescriptionError(f"{name}: {source} cannot be read as an FMU: {error}") from None
        if name in self.described:
            raise DescriptionError(f"{where}: two simulators are named {name!r}.")
        self.notes += [f"{name}: {note}" for note in mended]
        self.described[name], self.files[name] = description, file
        for variable in description.modelVariables:
            self.causality[name, variable.name] = variable.causality or "local"
            self.units[name, variable.name] = variable.unit or ""
        if node.get("stepSize"):
            if (step := number_of(node.get("stepSize"))) is None:
                raise DescriptionError(f"{where}: stepSize = {node.get('stepSize')!r} is no number.")
            self.others.steps[name] = step
        made: dict[str, Any] = {"fmu": str(file.absolute()), "start": {}}
        if place is not None:
            made |= {"host": place} if place else {"process": True}
        for one in node.iterfind("InitialValues/InitialValue"):
            value = one[0].get("value") if len(one) else None
            if value is None or one.get("variable") is None:
                raise DescriptionError(f"{self.path.name}, line {one.sourceline}: an initial value needs a variable and a value.")
            made["start"][one.get("variable")] = value
        return made

    def _function(self, name: str, node: etree._Element) -> dict[str, Any] | None:
        """The part of a sum; None of a linear transformation, which is in its connections."""
        if node.tag == "LinearTransformation":
            self.causality |= {(name, "in"): "input", (name, "out"): "output"}
            return None
        if node.tag not in ("Sum", "VectorSum"):
            raise DescriptionError(f"{self.path.name}, line {node.sourceline}: a function {node.tag} is not known here.")
        vector = node.tag == "VectorSum"
        count, width = (_count(node.get(key, "1")) for key in ("inputCount", "dimension"))
        if not 0 < count * width <= 10_000:
            raise DescriptionError(f"{self.path.name}, line {node.sourceline}: {name} has no inputs, or too many.")
        columns = [f"[{k}]" for k in range(width)] if vector else [""]
        terms = {f"out{column}": [f"in[{k}]{column}" for k in range(count)] for column in columns}
        for given, taken in terms.items():
            self.causality |= {(name, given): "output"} | {(name, one): "input" for one in taken}
        return {"part": f"{Sum.__module__}:{Sum.__qualname__}", "options": {"terms": terms}}

    # --- what is connected ------------------------------------------------------------------------------------------------

    def _connect(self, node: etree._Element) -> None:
        ends = [self._end(one) for one in node if one.tag in ("Variable", "Signal", "VariableGroup", "SignalGroup")]
        if len(ends) != 2:
            raise DescriptionError(f"{self.path.name}, line {node.sourceline}: a connection has two ends.")
        for one, other in self._paired(ends[0], ends[1], node):
            for end in (one, other):
                if end not in self.causality:
                    raise DescriptionError(f"{self.path.name}, line {node.sourceline}: {end[0]} has no variable {end[1]}.")
            source, target = (one, other) if self.causality[one] in GIVING else (other, one)
            key = ".".join(target)
            if key in self.connections:
                raise DescriptionError(f"{self.path.name}, line {node.sourceline}: {key} is connected twice.")
            self.connections[key] = {"from": ".".join(source), "convert": False}
            units = [self.units.get(end, "") for end in (source, target)]
            if all(units) and units[0] != units[1]:
                self.notes.append(f"{'.'.join(source)} in {units[0]} goes to {key} in {units[1]} as it is: OSP converts no units")
            if node.get("powerBond"):
                self.bonds.setdefault(node.get("powerBond", ""), []).append((source, target))

    def _end(self, node: etree._Element) -> End:
        return node.get("simulator", node.get("function", "")), node.get("name", "")

    def _paired(self, one: End, other: End, node: etree._Element) -> list[tuple[End, End]]:
        """The variables that a connection is of; of groups those at the same place."""
        if not node.tag.endswith("GroupConnection"):
            return [(one, other)]
        where = f"{self.path.name}, line {node.sourceline}"
        first, second = self._group(one, where), self._group(other, where)
        if len(first) != len(second):
            raise DescriptionError(f"{where}: groups of {len(first)} and {len(second)} variables do not fit.")
        return list(zip(first, second))

    def _group(self, end: End, where: str) -> list[End]:
        owner, name = end
        if owner not in self.described:  # a function's
            found = [one for one in self.causality if one[0] == owner and one[1].startswith(f"{name}[")]
        else:
            beside = [self.files[owner].parent, self.path.parent]
            stems = [one for one in (self.described[owner].modelName or "", self.files[owner].stem) if is_name(one)]
            files = [folder / f"{stem}_OspModelDescription.xml" for folder in beside for stem in stems]
            file = next((file for file in files if file.is_file()), None)
            if file is None:
                wanted = files[0].name if files else "OspModelDescription.xml"
                raise DescriptionError(f"{where}: {owner} has no {wanted}, which says what is in {name!r}.")
            archive.root_of(file, file.name)
            try:
                found = [(owner, one) for one in _variables(xml.root_of(file.read_bytes())[0], name)]
            except etree.XMLSyntaxError as error:
                raise DescriptionError(f"{file.name}: cannot be read as XML: {error}") from None
        if not found:
            raise DescriptionError(f"{where}: {owner} has no group of variables {name!r}.")
        return found

    def _transform(self, functions: dict[str, etree._Element]) -> None:
        """What goes through linear transformations comes from where they take it."""
        lines = {name: node for name, node in functions.items() if node.tag == "LinearTransformation"}
        for target, told in list(self.connections.items()):
            seen = set[str]()
            while (name := told["from"].removesuffix(".out")) in lines and f"{name}.out" == told["from"]:
                before = self.connections.get(f"{name}.in")
                if before is None or name in seen:
                    raise DescriptionError(f"{self.path.name}: {name} gives {target} something and is given nothing itself.")
                seen.add(name)
                factor, offset = (number_of(lines[name].get(key, default)) for key, default in (("factor", "1"), ("offset", "0")))
                if factor is None or offset is None:
                    raise DescriptionError(f"{self.path.name}: the factor or offset of {name} is no number.")
                rest = told.get("factor", 1.0)
                told |= {"factor": rest * factor, "offset": rest * offset + told.get("offset", 0.0), "from": before["from"]}
        for name in lines:
            self.connections.pop(f"{name}.in", None)

    def _bonds(self) -> list[dict[str, str]]:
        told = []
        for name, pairs in self.bonds.items():
            there, back = (*pairs, None, None)[:2]
            if len(pairs) == 2 and there and back and (there[0][0], there[1][0]) == (back[1][0], back[0][0]):
                told.append({"effort": ".".join(there[0]), "flow": ".".join(back[0]), "name": name})
            else:
                self.notes.append(f"the power bond {name} is not used: it is no pair of connections there and back")
        return told


def _count(text: str) -> int:
    return int(text) if text.strip().isdecimal() and len(text) < 6 else 0


def _variables(root: etree._Element, name: str) -> Iterator[str]:
    """The variables of a group, those of the groups in it in their order."""
    for group in root.iter(tag=etree.Element):
        if group.get("name") == name and etree.QName(group).localname != "Variable":
            for one in group.iter(tag=etree.Element):
                if etree.QName(one).localname == "Variable":
                    yield one.get("ref") or one.get("name") or ""
            return


class Sum(Part):
    """Sums of what goes in: `terms` by output. What it gives it gives at once."""

    passes = True
    can_roll_back = True

    def __init__(self, name: str, terms: dict[str, list[str]]):
        taken = [Variable(one, start=0.0, causality="input") for ones in terms.values() for one in ones]
        given = [Variable(one, causality="output", depends_on=tuple(ones)) for one, ones in terms.items()]
        super().__init__(name, taken + given)
        self.terms = terms

    def compute(self) -> None:
        self.values |= {given: sum(self.values[one] for one in taken) for given, taken in self.terms.items()}
