"""Results to look at, written as runs write them, without a run; and a browser to look with."""

import fcntl
import itertools
import json
import os
import select
import shutil
import subprocess
import time

import numpy as np
import pytest

from selflock.master import Variable
from selflock.master.files import sink


@pytest.fixture
def write(tmp_path):
    """write(name, {column: (unit, numbers)}, about): a result file."""

    def put(name, columns, about=None):
        described = [Variable(column, unit) for column, (unit, _) in columns.items()]
        made = sink(described, tmp_path / name, about=about)
        for row in np.column_stack([numbers for _, numbers in columns.values()]):
            made.block[made.fill] = row
            made.fill += 1
            made.checked()
        made.close()
        return tmp_path / name

    return put


@pytest.fixture
def drive():
    """drive(gain=1.0): time, torque 3 sin t N.m, power t W, current and angle of a motor for 4 s."""

    def columns(gain=1.0):
        t = np.linspace(0.0, 4.0, 401)
        return {
            "time": ("s", t),
            "motor.torque": ("N.m", gain * 3.0 * np.sin(t)),
            "motor.current": ("A", gain * 2.0 * np.cos(t)),
            "motor.power": ("W", gain * t),
            "gear.output_torque": ("N.m", gain * 150.0 * np.sin(t)),
            "gear.angle": ("rad", gain * t),
        }

    return columns


LIMITS = {"limits": [{"name": "motor", "column": "motor.current", "unit": "A", "high": 8.0, "voltage": 4.0, "resistance": 2.0}]}
ROBOT = ("chassis_x", "chassis_y", "chassis_pitch", "front_angle", "rear_angle", "front_sprocket_angle", "rear_sprocket_angle")


@pytest.fixture
def limits():
    """A motor of 2 Ohm at 8 V: its stall current is 4 A."""
    return LIMITS


@pytest.fixture
def rolling():
    """rolling(): columns of a robot that rolls 0.5 m forward."""

    def columns(shift=0.0):
        t = np.linspace(0.0, 2.0, 101)
        of = {"time": ("s", t)} | {f"robot.{name}": ("rad", 0.0 * t) for name in ROBOT}
        return of | {
            "robot.chassis_x": ("m", 0.25 * t + shift),
            "robot.chassis_y": ("m", 0.06 + 0.0 * t),
            "robot.front_angle": ("rad", 0.3 * t),
            "robot.front_sprocket_angle": ("rad", -5.0 * t),
            "drive.torque": ("N.m", np.sin(t)),
        }

    return columns


class Chromium:
    """A browser that is told what to do over a pipe (the Chrome DevTools Protocol)."""

    def __init__(self, program, folder):
        options = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars")
        options += ("--disable-background-networking", "--disable-component-update", "--disable-sync", "--remote-debugging-pipe")
        (theirs, self.into), (self.out, back) = os.pipe(), os.pipe()
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 60) for end in (theirs, back)]
        command = [program, *options, f"--user-data-dir={folder}", "about:blank"]
        place = lambda: [os.dup2(end, place) for place, end in enumerate(ends, 3)]  # it reads from 3 and writes to 4
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen(command, preexec_fn=place, pass_fds=(3, 4), **quiet)
        for end in (theirs, back, *ends):
            os.close(end)
        self.numbers, self.rest, self.events = itertools.count(1), b"", []

    def call(self, method, session=None, **params):
        number = next(self.numbers)
        message = {"id": number, "method": method, "params": params} | ({"sessionId": session} if session else {})
        os.write(self.into, json.dumps(message).encode() + b"\0")
        while (answer := self.message()).get("id") != number:
            self.events.append(answer)
        assert "error" not in answer, answer
        return answer["result"]

    def message(self):
        while b"\0" not in self.rest:
            assert select.select([self.out], [], [], 120)[0], "the browser does not answer"
            self.rest += os.read(self.out, 1 << 20)
        one, _, self.rest = self.rest.partition(b"\0")
        return json.loads(one)

    def close(self):
        self.process.terminate()
        self.process.wait(30)
        os.close(self.into)
        os.close(self.out)


class Tab:
    """A page in it, of some width in px. `js` gives what an expression is there, `complaints` what the console was told."""

    def __init__(self, chromium, page, width=1400, dark=False):
        self.chromium = chromium
        self.target = chromium.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = chromium.call("Target.attachToTarget", targetId=self.target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
        self.call("Emulation.setDeviceMetricsOverride", **size)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
        self.call("Page.navigate", url=page.as_uri())
        while self.js("location.href + document.readyState") != page.as_uri() + "complete":
            time.sleep(0.02)
        self.settle()

    def call(self, method, **params):
        return self.chromium.call(method, self.session, **params)

    def js(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def settle(self):
        self.js("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def mouse(self, kind, x, y, held=False):
        self.call(
            "Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left" if held else "none", buttons=int(held), clickCount=1
        )

    def key(self, key, text=""):
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, text=text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key)

    def complaints(self):
        loud = ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded")
        return [one for one in self.chromium.events if one.get("sessionId") == self.session and one["method"] in loud]


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if program is None:
        pytest.skip("there is no Chromium here")
    started = Chromium(program, tmp_path_factory.mktemp("chromium"))
    yield started
    started.close()


@pytest.fixture
def tab(chromium):
    """tab(page, width=1400, dark=False): the page in a real browser, to be asked and clicked."""
    opened = []

    def show(page, **how):
        opened.append(Tab(chromium, page, **how))
        return opened[-1]

    yield show
    for one in opened:
        chromium.call("Target.closeTarget", targetId=one.target)
