"""Tests run side by side: threads inside them would only stand in each other's way. And where their random numbers come from."""

import os
import re
import secrets
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

pytest_plugins = ["pytester"]

# on a machine that is busy with other work everything is slow, and nothing is wrong
settings.register_profile("busy", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("busy")

for threads in ("OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

# tests send Ctrl-C, which what a script starts in the background ignores
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# what is compiled of sources is kept, whatever the shell says: workers, and the commands that tests start, read the same files
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

sys.path.append(str(Path(__file__).parent / "native"))

TURNS = 14
"""Days in which every test that is marked `in_turn` has had its turn under --turns."""


def pytest_addoption(parser):
    parser.addoption("--turns", action="store_true", help=f"long tests take turns: each runs on one day of {TURNS}, by date")
    parser.addoption("--draws", type=int, default=1, help="run each test that draws random numbers so often, and no other")


def pytest_generate_tests(metafunc):
    if metafunc.config.getoption("--draws") > 1 and "rng" in metafunc.fixturenames:
        metafunc.fixturenames.append("draw")
        metafunc.parametrize("draw", range(metafunc.config.getoption("--draws")))


@pytest.hookimpl(tryfirst=True)  # before -m chooses
def pytest_collection_modifyitems(config, items):
    """Of tests that are marked `alike` all but the first are slow. Under --turns, skip those whose day it is not.

    What a change breaks at one place shows in many of them at once. The longest, which take turns, begin first: a worker was left
    with the last of them, and the other with nothing to do.
    """
    items.sort(key=lambda item: item.get_closest_marker("in_turn") is None)
    if config.getoption("--draws") > 1:
        items[:] = [item for item in items if "rng" in getattr(item, "fixturenames", ())]
    first = set()
    for item in items:
        if item.get_closest_marker("alike"):
            name = item.nodeid.partition("[")[0]
            if name in first:
                item.add_marker("slow")
            first.add(name)
    if config.getoption("--turns"):
        later = pytest.mark.skip(reason=f"has its turn on another day of {TURNS}; make test-all runs all")
        today = int(time.time() // 86_400)
        numbers: dict[str, int] = {}
        for item in items:
            if mark := item.get_closest_marker("in_turn"):  # in_turn(2): on that day; the longest are spread by hand
                number = mark.args[0] if mark.args else numbers.setdefault(item.nodeid, len(numbers))
                if (number + today) % TURNS:
                    item.add_marker(later)


HOSTILE = '"\'><script>document.documentElement.dataset.owned=1</script><img src=x onerror="document.documentElement.dataset.owned=2">$\\frac{'
"""A name that runs as a script, twice, wherever it is put into a page as it is, and breaks a figure that takes it for a formula."""

ADDRESSES = ("href", "src", "srcset", "action", "formaction", "data", "poster", "background", "xlink:href")


@pytest.fixture(scope="session")
def hostile():
    return HOSTILE


@pytest.fixture
def harmless():
    """harmless(page, scripts=0): the page loads nothing, runs no script but its own, and forbids the rest. Returns its tree."""
    from lxml import html

    def check(page, scripts=0):
        tree = html.document_fromstring(page.read_bytes(), parser=html.HTMLParser(encoding="utf-8"))
        found = tree.xpath("//script")
        assert len(found) == scripts and not any(script.attrib for script in found)
        for element in tree.iter():
            assert not isinstance(element.tag, str) or element.tag not in (
                "iframe",
                "object",
                "embed",
                "link",
                "base",
                "form",
                "math",
            )
            for name, value in element.attrib.items():
                assert not name.lower().startswith("on"), (element.tag, name)
                assert name.lower() not in ADDRESSES or value.startswith(("data:image/png;base64,", "#")), (
                    element.tag,
                    name,
                    value[:80],
                )
                assert "javascript:" not in value.lower()
        assert "url(" not in "".join(tree.xpath("//style/text()")).lower()
        rules = tree.xpath("//head/meta[@http-equiv='Content-Security-Policy']/@content")
        assert len(rules) == 1 and "default-src 'none'" in rules[0]
        assert "unsafe-inline" not in rules[0].replace("style-src 'unsafe-inline'", "") and ("script-src" in rules[0]) == bool(
            scripts
        )
        return tree

    return check


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """browser(page): what a real browser makes of the page, as HTML, after its scripts ran."""
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if program is None:
        pytest.skip("there is no Chromium here")

    def show(page):
        options = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run")
        options += (
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--virtual-time-budget=3000",
        )
        data = f"--user-data-dir={tmp_path_factory.mktemp('browser')}"
        command = [program, *options, data, "--dump-dom", page.as_uri()]
        shown = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
        assert re.search("<html", shown)
        return shown

    return show


@pytest.fixture(scope="session")
def native(tmp_path_factory):
    """native("ball"): the path of a C FMU of tests/native, compiled here."""
    from pack import pack

    folder, made = tmp_path_factory.mktemp("native"), {}

    def path(name):
        if name not in made:
            made[name] = pack(name, folder)
        return made[name]

    return path


@pytest.fixture
def rng(request):
    """Another generator in each run, whose seed a failure prints; SELFLOCK_SEED=... draws the same again."""
    seed = int(os.environ.get("SELFLOCK_SEED") or secrets.randbits(32))
    request.node.add_report_section("setup", "random numbers", f"SELFLOCK_SEED={seed} draws the same again")
    return np.random.default_rng(seed)
