"""An FMU as a file: valid, the same bytes twice, running alone, undisturbed by others of its kind."""

import hashlib
import io
import json
import subprocess
import sys
import zipfile
from importlib.metadata import distribution
from pathlib import Path

import fmpy
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from selflock.fmus import documentation, loader
from selflock.fmus.build import build, build_all, built
from selflock.fmus.documentation import _prose
from selflock.fmus.errors import BuildError

NAMES = ("Motor", "Controller", "Load", "Sensor", "Reducer")
ROOT = Path(__file__).parents[2]
SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi2" / "fmi2ModelDescription.xsd"


@pytest.mark.parametrize("name", NAMES)
def test_valid_for_fmpy_and_the_schema(fmu, name):
    assert validate_fmu(str(fmu(name))) == []
    with zipfile.ZipFile(fmu(name)) as archive:
        description = etree.parse(io.BytesIO(archive.read("modelDescription.xml")))
    schema = etree.XMLSchema(etree.parse(str(SCHEMA)))
    assert schema.validate(description), schema.error_log
    root = description.getroot()
    assert root.find("CoSimulation").get("canSerializeFMUstate") == "true"
    variables = root.findall("ModelVariables/ScalarVariable")
    assert all(variable.get("description") for variable in variables)
    units = {unit.get("name") for unit in root.iterfind("UnitDefinitions/Unit")}
    assert units >= {variable[0].get("unit") for variable in variables if variable[0].get("unit")}
    assert all(unknown.get("dependencies") is not None for unknown in root.iterfind("ModelStructure/Outputs/Unknown"))


@pytest.mark.alike
@pytest.mark.parametrize("name", NAMES)
def test_same_bytes_twice(tmp_path, name):
    first, second = build(name, tmp_path / "a"), build(name, tmp_path / "b")
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.slow
def test_guid_follows_content(fmu):
    def guid(path):
        return fmpy.read_model_description(path).guid

    assert guid(fmu("Motor")) != guid(fmu("Motor", resistance=2.0)) != guid(fmu("Motor", resistance=3.0))


@pytest.mark.parametrize("name", NAMES)
def test_documentation_and_icon_inside(fmu, name):
    with zipfile.ZipFile(fmu(name)) as archive:
        html = archive.read("documentation/index.html").decode()
        assert archive.read("model.png").startswith(b"\x89PNG")
    assert "<svg" in html and "Equations" in html and "name='viewport'" in html
    assert 'src="http' not in html and 'href="http' not in html.replace('xlink:href="http://www.w3.org', "")


@pytest.mark.parametrize("name", NAMES)
def test_the_licences_of_all_that_it_carries_are_inside(fmu, name):
    with zipfile.ZipFile(fmu(name)) as archive:
        told = archive.read("documentation/licenses/license.txt").decode()
    (theirs,) = (file for file in distribution("pythonfmu").files if file.name == "LICENSE")
    for text in ((ROOT / "LICENSE").read_text(), theirs.read_text()):
        assert text.strip() in told


def test_a_law_is_drawn_once_whatever_the_fmu_s_start_values_are(tmp_path, monkeypatch):
    monkeypatch.setenv("SELFLOCK_CACHE", str(tmp_path / "cache"))
    drawn = []
    for way in ("_svg", "_icon"):
        draw = getattr(documentation, way)
        monkeypatch.setattr(documentation, way, lambda *asked, way=way, draw=draw: drawn.append(way) or draw(*asked))
    one, other = build("Motor", tmp_path / "one.fmu"), build("Motor", tmp_path / "other.fmu", resistance=2.0)
    assert sorted(drawn) == ["_icon", "_svg"]
    figures = [
        zipfile.ZipFile(path).read("documentation/index.html").split(b"<figure>")[1].split(b"</figure>")[0]
        for path in (one, other)
    ]
    assert figures[0] == figures[1]


def test_a_law_s_text_becomes_paragraphs_formulas_and_a_list_of_symbols():
    text = "One\nparagraph with `code` & a < b.\n\nF  force, N\nmu N  product\n\n    y = 2 x   (eq 1)\n      + 1\n\nLast."
    assert _prose(text) == (
        "<p>One paragraph with <code>code</code> &amp; a &lt; b.</p><dl><dt>F</dt><dd>force, N</dd><dt>mu N</dt>"
        "<dd>product</dd></dl><pre>y = 2 x   (eq 1)\n  + 1</pre><p>Last.</p>"
    )


def test_the_library_for_windows_is_pythonfmu_s_own(fmu):
    with zipfile.ZipFile(fmu("Motor")) as archive:
        assert archive.read("binaries/win64/Motor.dll") == (loader.PYTHONFMU / "win64" / "pythonfmu-export.dll").read_bytes()
        if loader.compiler():
            assert (
                archive.read("binaries/linux64/Motor.so")
                != (loader.PYTHONFMU / "linux64" / "libpythonfmu-export.so").read_bytes()
            )


def test_the_loader_is_compiled_once_for_a_machine(monkeypatch):
    if not loader.compiler():
        pytest.skip("there is no C compiler here")
    first = loader.loader()

    def again(*given, **more):
        raise AssertionError("compiled again")

    loader._compiled.cache_clear()  # as in the next process
    monkeypatch.setattr(loader.subprocess, "run", again)
    assert first and loader.loader() == first
    loader._compiled.cache_clear()
    monkeypatch.setattr(loader, "OPTIONS", (*loader.OPTIONS, "-DOTHER"))
    with pytest.raises(AssertionError, match="compiled again"):
        loader.loader()


@pytest.mark.slow
def test_built_without_a_compiler_it_runs_in_python_and_says_so(tmp_path, monkeypatch, fmu):
    own = fmu("Motor")
    monkeypatch.setenv("CC", "/nowhere/cc")
    with pytest.warns(UserWarning, match="Python hosts only"):
        path = build("Motor", tmp_path)
    assert run_alone(tmp_path, path) == run_alone(tmp_path, own)


@pytest.mark.slow
def test_pythonfmu_s_library_alone_is_ended_before_its_memory_is(tmp_path, monkeypatch):
    """At the end of a process it counts down in freed memory: an abort after all work, once in some hundred runs."""
    monkeypatch.setenv("CC", "/nowhere/cc")
    with pytest.warns(UserWarning, match="Python hosts only"), zipfile.ZipFile(build("Motor", tmp_path)) as archive:
        archive.extractall(tmp_path / "motor")
    (package,) = (tmp_path / "motor" / "resources").glob("selflock_*/")
    done = "import atexit, sys; sys.path.insert(0, sys.argv[1]); n = atexit._ncallbacks(); __import__(sys.argv[2]); print(atexit._ncallbacks() - n)"
    told = subprocess.run([sys.executable, "-c", done, str(package.parent), package.name], capture_output=True, text=True)
    assert (told.returncode, told.stdout, told.stderr) == (0, "1\n", "")


ALONE = """
import sys, json
sys.path += {site}
try:
    from selflock import fmus
except ImportError:
    pass
else:
    raise SystemExit("the project is importable")
from fmpy import simulate_fmu
out = []
for path in {paths}:
    result = simulate_fmu(path, start_values=dict(voltage=6.0, speed=20.0), stop_time=0.01, step_size=1e-3, output_interval=1e-3)
    out.append([float(x) for x in result["torque"]])
print(json.dumps(out))
"""


def run_alone(tmp_path, *paths):
    """Simulate motors in one fresh process in which nothing of the project can be imported."""
    site = [p for p in sys.path if p.endswith("site-packages")]
    code = ALONE.format(site=site, paths=[str(path) for path in paths])
    options = {"cwd": tmp_path, "env": {"MALLOC_PERTURB_": "165"}, "capture_output": True, "text": True, "timeout": 60}
    done = subprocess.run([sys.executable, "-I", "-S", "-c", code], **options)  # freed memory is overwritten
    assert done.returncode == 0 and not done.stderr, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_runs_alone_and_two_builds_beside_each_other(fmu, tmp_path):
    from selflock.fmus.motor import dc

    def expected(resistance):
        p = dc.Parameters(resistance=resistance)
        s, torques = dc.start(p), [0.0]
        for _ in range(10):
            s, out = dc.advance(p, s, 6.0, 20.0, 1e-3)
            torques.append(out.torque)
        return torques

    both = run_alone(tmp_path, fmu("Motor"), fmu("Motor", resistance=3.0))
    assert both[0] == pytest.approx(expected(0.6), rel=1e-14)  # FMPy's steps differ in the last bit
    assert both[1] == pytest.approx(expected(3.0), rel=1e-14)


@pytest.mark.slow
def test_an_effect_can_be_baked_in(instance):
    motor = instance("Motor", brush_voltage=1.5, inductance=0.0)
    motor.begin(voltage=3.0)
    assert motor.get("current") == (3.0 - 1.5) / 0.6


@pytest.mark.slow
def test_cache_gives_the_same_file_until_something_changes(tmp_path, monkeypatch):
    monkeypatch.setenv("SELFLOCK_CACHE", str(tmp_path))
    first = built("Sensor")
    when = first.stat().st_mtime_ns
    assert built("Sensor") == first and first.stat().st_mtime_ns == when
    assert built("Sensor", bias=1.0) != first
    assert hashlib.sha256(first.read_bytes()).digest() == hashlib.sha256(build("Sensor", tmp_path / "x").read_bytes()).digest()


@pytest.mark.slow
def test_build_all_makes_what_is_named(tmp_path):
    assert [path.name for path in build_all(tmp_path, ["Motor", "Sensor"])] == ["Motor.fmu", "Sensor.fmu"]


@pytest.mark.parametrize(
    ("name", "starts", "words"),
    [
        ("Engine", {}, "no FMU 'Engine'"),
        ("Motor", {"ohms": 1.0}, "no parameter or input 'ohms'"),
        ("Motor", {"resistance": -1.0}, "outside its range"),
        ("Motor", {"resistance": float("nan")}, "not a finite number"),
        ("Motor", {"resistance": "low"}, "a Real value is needed"),
        ("Motor", {"resistance": 0.0, "inductance": 0.0}, "nothing limits the current"),
        ("Controller", {"irreversible": 2.0}, "a Boolean value is needed"),
        ("Controller", {"voltage_min": 30.0}, "above voltage_max"),
    ],
)
def test_a_mistake_is_told(tmp_path, name, starts, words):
    with pytest.raises(BuildError, match=words):
        build(name, tmp_path, **starts)
    assert list(tmp_path.iterdir()) == []


def test_an_unwritable_place_is_told(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BuildError, match="Cannot write"):
        build("Sensor", tmp_path / "file")
