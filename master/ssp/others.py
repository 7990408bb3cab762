"""What other tools say in annotations of how their systems are run: OSP (libcosim) and OMSimulator.

SSP itself says nothing of step, algorithm and tolerance. What these say of it is used where our master has the same, and
else told in a sentence; so is every annotation of a kind that is not known here. Elements go by their local names: the
namespaces differ from version to version.

- OSP: of the experiment `FixedStepAlgorithm baseStepSize`, of a component `StepSizeHint value`. libcosim steps all
  components from the outputs of the step's start, each with a whole multiple of the base step, and others see what comes of
  it when it is over: Jacobi, with outputs held.
- OMSimulator: of a system `FixedStepMaster stepSize relativeTolerance`, Jacobi too; the tolerance is that which it gives
  co-simulation FMUs at fmi2SetupExperiment. Of an experiment its recording alone, which bears on no number.

Sources: libcosim's ssp_parser.cpp; OMSimulator's SystemWC.cpp, ComponentFMUCS.cpp.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from lxml import etree

from .archive import ANNOTATION, tag

OSP, OMS = "com.opensimulationplatform", "org.openmodelica"
SOLVERS = ("FixedStepSolver", "VariableStepSolver")


@dataclass
class Others:
    """What was said, and in sentences what of it is not used."""

    step: float = 0.0  # communication step, s; 0: not told
    largest: float = 0.0  # communication step where it follows the error there, s; 0: not told
    algorithm: str = ""
    steps: dict[str, float] = field(default_factory=dict)  # own steps by component, s
    tolerances: dict[str, float] = field(default_factory=dict)  # by the path of a system, "" the outermost
    kinds: list[str] = field(default_factory=list)  # of all annotations but ours
    notes: list[str] = field(default_factory=list)

    def look(self, node: etree._Element | None, path: str = "") -> None:
        """Take in the annotations of a document, its experiment, a system or a component."""
        annotations = () if node is None else node.findall(f"{tag('ssd:Annotations')}/{tag('ssc:Annotation')}")
        for annotation in annotations:
            kind = annotation.get("type", "")
            if kind != ANNOTATION and kind not in self.kinds:
                self.kinds.append(kind)
                if kind not in (OSP, OMS):
                    self.notes.append(f"annotations of type {kind!r} are not known here, and not used")
            for element in annotation.iter(tag=etree.Element):
                name = etree.QName(element).localname
                where = f"{path or 'the system'}: {name} of {kind}"
                if kind == OSP:
                    self._osp(name, element, path, where)
                elif kind == OMS:
                    self._oms(name, element, path, where)

    def _osp(self, name: str, element: etree._Element, path: str, where: str) -> None:
        if name == "FixedStepAlgorithm":
            self.step, self.algorithm = self._number(element, "baseStepSize", where), "jacobi"
        elif name == "StepSizeHint":
            self.steps[path] = self._number(element, "value", where)
        elif name.endswith("Algorithm") and name != "Algorithm":
            self._unused(element, where, "that algorithm is not known here")

    def _oms(self, name: str, element: etree._Element, path: str, where: str) -> None:
        if name in ("FixedStepMaster", "VariableStepMaster"):
            self.tolerances[path] = self._number(element, "relativeTolerance", where)
        if name == "VariableStepMaster" and not path:
            self.largest, self.algorithm = self._number(element, "maximumStepSize", where), "jacobi"
            self._unused(element, where, "steps are of one size here, no longer than its longest")
        elif name == "FixedStepMaster" and not path:
            self.step, self.algorithm = self._number(element, "stepSize", where), "jacobi"
            if element.get("description", "oms-ma") != "oms-ma":
                self._unused(element, where, "its step is, with Jacobi")
        elif name in ("FixedStepMaster", "VariableStepMaster"):
            self._unused(element, where, "all systems have the step of the outermost here; its tolerance is")
        elif name in SOLVERS:
            self._unused(element, f"{name} of {OMS}", "FMUs for co-simulation have solvers of their own")

    def _unused(self, element: etree._Element, where: str, why: str) -> None:
        said = ", ".join(f"{key} = {value}" for key, value in element.attrib.items())
        note = f"{where} ({said}) is not used: {why}"
        if note not in self.notes:  # of several systems
            self.notes.append(note)

    def _number(self, element: etree._Element, name: str, where: str) -> float:
        """A number above 0 in an attribute; 0 where it is not there, or is none, which is noted."""
        text = element.get(name, "0")
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if 0.0 <= number < math.inf:
            return number
        self.notes.append(f"{where}: {name} = {text!r} is no number above 0, and is not used")
        return 0.0

    def beside_ours(self) -> Others:
        """What is left of it in a file that says by our own annotation how it is run."""
        kinds = ", ".join(map(repr, self.kinds))
        return Others(notes=[f"annotations of type {kinds} are not used: {ANNOTATION!r} says how it is run"] if kinds else [])

    def run(self, step: float, length: float) -> dict[str, Any]:
        """What [run] would say, for an experiment of `length` s. step: that of the FMUs, where nothing else is told."""
        wanted = self.step or min(step, self.largest or math.inf)
        told: dict[str, Any] = {"step": length / max(1, math.ceil(length / wanted - 1e-6))}  # a whole number of them
        if self.step and abs(told["step"] - wanted) > 1e-5 * wanted:
            self.notes.append(
                f"the step is {told['step']:.9g} s, not {wanted:g} s as is said: of that, {length:g} s is no multiple"
            )
        if self.algorithm:
            told["algorithm"] = self.algorithm
        if self.steps:  # as libcosim does
            told["hold_outputs"] = True
        if self.tolerances.get(""):
            told["fmu_tolerance"] = self.tolerances[""]
        return told

    def component(self, path: str, step: float) -> dict[str, Any]:
        """What [components.PATH] would say, in a run with this communication step."""
        told = {}
        if hint := self.steps.get(path, 0.0):
            count = max(1, math.floor(hint / step + 1e-6))
            if count > 1:
                told["step"] = count * step
            if abs(count * step - hint) > 1e-5 * hint:
                self.notes.append(
                    f"{path}: its step is {count * step:.9g} s, not {hint:g} s as is said: a multiple of {step:g} s"
                )
        system = path
        while system:  # the innermost around it that tells one; the outermost is that of the run
            system = system.rpartition("/")[0]
            if system and self.tolerances.get(system):
                return told | {"tolerance": self.tolerances[system]}
        return told
