"""What OSP and OMSimulator say in annotations of step, algorithm and tolerance: used, or told in a sentence."""

import zipfile

import pytest

from selflock import master
from selflock.master import ssp

NAMES = " ".join(
    f'xmlns:{prefix}="{uri}"'
    for prefix, uri in {
        "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
        "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
        "osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
        "oms": "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd",
        "x": "urn:x",
    }.items()
)


def annotated(kind, content):
    return f'<ssd:Annotations><ssc:Annotation type="{kind}">{content}</ssc:Annotation></ssd:Annotations>'


def osp(content):
    return annotated("com.opensimulationplatform", content)


def oms(content):
    return annotated(
        "org.openmodelica",
        f"<oms:Annotations><oms:SimulationInformation>{content}</oms:SimulationInformation></oms:Annotations>",
    )


@pytest.fixture
def structure(native, tmp_path):
    """structure(experiment=, system=, component=, inner=): an .ssp of two FMUs, `f` and `Inner/g`, with these annotations."""

    def write(experiment="", system="", component="", inner=""):
        text = f"""<ssd:SystemStructureDescription {NAMES} name="a" version="1.0"><ssd:System name="s"><ssd:Elements>
          <ssd:Component name="f" source="resources/forgetful.fmu">{component}</ssd:Component>
          <ssd:System name="Inner"><ssd:Elements><ssd:Component name="g" source="resources/forgetful.fmu"/></ssd:Elements>
            {inner}</ssd:System></ssd:Elements>{system}</ssd:System>
          <ssd:DefaultExperiment startTime="0" stopTime="1">{experiment}</ssd:DefaultExperiment></ssd:SystemStructureDescription>"""
        path = tmp_path / "a.ssp"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("SystemStructure.ssd", text)
            archive.write(native("forgetful"), "resources/forgetful.fmu")
        return path

    return write


def test_what_is_not_annotated_is_as_before(structure):
    system = ssp.load(structure())
    assert (system.run.step, system.run.algorithm, system.run.fmu_tolerance) == (0.1, "gauss-seidel", None)
    assert system.notes == []


def test_osp_says_algorithm_and_steps(structure):
    fixed = osp('<osp:Algorithm><osp:FixedStepAlgorithm baseStepSize="2e-2"/></osp:Algorithm>')
    system = ssp.load(structure(experiment=fixed, component=osp('<osp:StepSizeHint value="0.1"/>')))
    assert (system.run.step, system.run.algorithm) == (0.02, "jacobi")
    assert system.components["f"].step == 0.1 and system.components["Inner/g"].step == 0.0 and system.notes == []
    assert len(master.run(system).table) == 51
    system = ssp.load(structure(experiment=fixed, component=osp('<osp:StepSizeHint value="0.05"/>')))
    assert system.components["f"].step == 0.04  # a whole multiple, as libcosim takes it
    assert len(system.notes) == 1 and "not 0.05 s" in master.run(system).summary()


def test_omsimulator_says_step_and_tolerances(structure):
    outer = oms('<oms:FixedStepMaster description="oms-ma" stepSize="0.05" absoluteTolerance="1e-4" relativeTolerance="1e-3"/>')
    inner = oms('<oms:FixedStepMaster description="oms-ma" stepSize="0.05" relativeTolerance="1e-6"/>')
    system = ssp.load(structure(system=outer, inner=inner))
    assert (system.run.step, system.run.algorithm) == (0.05, "jacobi")
    result = master.run(system)
    assert (result.table["f.tolerance"] == 1e-3).all() and (result.table["Inner/g.tolerance"] == 1e-6).all()
    assert (master.run(system, tolerance=1e-4).table["f.tolerance"] == 1e-4).all()
    without_prefix = oms('<FixedStepMaster xmlns="" description="oms-ma" stepSize="0.05"/>')
    assert ssp.load(structure(system=without_prefix)).run.step == 0.05


@pytest.mark.parametrize(
    "where, annotation, words",
    [
        ("experiment", osp('<osp:Algorithm><osp:EccoAlgorithm baseStepSize="1e-2"/></osp:Algorithm>'), ("EccoAlgorithm", "1e-2")),
        ("experiment", osp('<osp:Algorithm><osp:FixedStepAlgorithm baseStepSize="soon"/></osp:Algorithm>'), ("'soon'",)),
        ("component", osp('<osp:StepSizeHint value="-1"/>'), ("f: StepSizeHint", "'-1'")),
        ("system", oms('<oms:VariableStepMaster description="oms-mav" maximumStepSize="0.01"/>'), ("oms-mav", "one size")),
        ("system", oms('<oms:FixedStepMaster description="oms-own" stepSize="0.1"/>'), ("oms-own",)),
        ("system", oms('<oms:FixedStepMaster description="oms-ma" stepSize="0.3"/>'), ("not 0.3 s",)),
        ("inner", oms('<oms:VariableStepSolver description="cvode" relativeTolerance="1e-4"/>'), ("cvode",)),
        ("experiment", annotated("org.nobody", '<x:y z="1"/>'), ("'org.nobody'", "not known")),
    ],
)
def test_what_is_not_used_is_told(structure, where, annotation, words):
    result = master.run(structure(**{where: annotation}))
    assert len(result.notes) == 1, result.notes
    for word in words:
        assert word in result.notes[0] and word in result.summary()


def test_a_variable_step_is_never_longer_than_told(structure):
    annotation = oms('<oms:VariableStepMaster description="oms-mav" maximumStepSize="0.01"/>')
    assert ssp.load(structure(system=annotation)).run.step == pytest.approx(0.01)


def test_our_own_annotation_wins(structure, tmp_path):
    annotation = osp('<osp:Algorithm><osp:FixedStepAlgorithm baseStepSize="2e-2"/></osp:Algorithm>')
    system = ssp.load(structure(experiment=annotation))
    system.run.step, system.run.algorithm = 0.05, "gauss-seidel"
    ssp.export(system, tmp_path / "ours.ssp")
    with zipfile.ZipFile(tmp_path / "ours.ssp") as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    text = files["SystemStructure.ssd"].decode()
    assert "opensimulationplatform" not in text
    alien = (
        '<ssc:Annotation type="com.opensimulationplatform"><osp:Algorithm xmlns:osp="urn:osp">'
        '<osp:FixedStepAlgorithm baseStepSize="0.1"/></osp:Algorithm></ssc:Annotation>'
    )
    files["SystemStructure.ssd"] = text.replace("<ssd:Annotations>", f"<ssd:Annotations>{alien}", 1).encode()
    with zipfile.ZipFile(tmp_path / "both.ssp", "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    again = ssp.load(tmp_path / "both.ssp")
    assert (again.run.step, again.run.algorithm) == (0.05, "gauss-seidel")
    assert len(again.notes) == 1 and "com.opensimulationplatform" in again.notes[0]
