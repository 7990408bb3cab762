"""Small systems and small FMUs for testing the master."""

import subprocess
import sys
from pathlib import Path

import pytest

from selflock import master

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

SLAVE = '''
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String
from pythonfmu.enums import Fmi2Status


class Counter(Fmi2Slave):
    """Adds gain * u at every step, and says no at stop_at."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.gain, self.stop_at, self.u, self.n, self.sum, self.even, self.word = 1.0, 1e9, 0.0, 0, 0.0, True, "start"
        for name in ("gain", "stop_at"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed))
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("sum", causality=Fmi2Causality.output))
        self.register_variable(Integer("n", causality=Fmi2Causality.output))
        self.register_variable(Boolean("even", causality=Fmi2Causality.output))
        self.register_variable(String("word", causality=Fmi2Causality.output))

    def do_step(self, t, h):
        if t + h > self.stop_at:
            self.log(f"no more after {self.stop_at}", Fmi2Status.error)
            return False
        self.sum += self.gain * self.u
        self.n += 1
        self.even = self.n % 2 == 0
        self.word = f"step {self.n}"
        return True
'''


@pytest.fixture(scope="session")
def native(native):
    """As a system file names it."""
    return lambda name: str(native(name))


@pytest.fixture(scope="session")
def counter(tmp_path_factory):
    """The path of a tiny pythonfmu FMU."""
    folder = tmp_path_factory.mktemp("slave")
    (folder / "counter_slave.py").write_text(SLAVE)
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", "counter_slave.py", "-d", ".", "--handle-state"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return str(folder / "Counter.fmu")


@pytest.fixture
def system():
    """system({name: (part, start, more)}, {target: source}, **run): a system of small parts."""

    def make(components, connections=(), **run):
        tables = {}
        for name, given in components.items():
            part, start, more = (given, {}, {}) if isinstance(given, str) else (*given, {})[:3]
            key = "fmu" if part.endswith(".fmu") else "part"
            tables[name] = {key: part if key == "fmu" else f"small_parts:{part}", "start": start, **more}
        made = master.from_dict({"run": run, "components": tables, "connections": dict(connections)})
        made.allow_code = True  # small_parts is not of the package
        return made

    return make


@pytest.fixture
def refused():
    """refused(function, *words): the message of the DescriptionError that it raises holds all words."""

    def check(call, *words):
        with pytest.raises(master.DescriptionError) as caught:
            call()
        for word in words:
            assert word in str(caught.value), str(caught.value)
        return str(caught.value)

    return check
