"""FMUs as files and as running instances, for every test of this folder."""

import shutil

import pytest
from fmpy import calloc, extract, free, read_model_description
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)

from selflock.fmus.build import build, built

NAMES = ("Motor", "Controller", "Load", "Sensor")


@pytest.fixture(scope="session")
def fmu(tmp_path_factory):
    """fmu(name, **starts) -> path of the FMU, built once a session."""
    made = {}

    def path(name, **starts):
        key = (name, *sorted(starts.items()))
        if key not in made:
            made[key] = build(name, tmp_path_factory.mktemp("fmu"), **starts) if starts else built(name)
        return made[key]

    return path


class Instance:
    """A running FMU: named values in and out, its log, statuses as exceptions of FMPy."""

    def __init__(self, path, name="it"):
        description = read_model_description(path)
        self.vr = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.type = {variable.name: variable.type for variable in description.modelVariables}
        self.folder, self.said = extract(path), []
        self.raw = FMU2Slave(
            guid=description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.callbacks = fmi2CallbackFunctions()
        self.callbacks.logger = fmi2CallbackLoggerTYPE(lambda env, who, status, category, text: self.said.append(text.decode()))
        self.callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        self.callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        self.raw.instantiate(loggingOn=True, callbacks=self.callbacks)

    def set(self, **values):
        for name, value in values.items():
            getattr(self.raw, f"set{self.type[name]}")([self.vr[name]], [value])

    def get(self, *names):
        values = [getattr(self.raw, f"get{self.type[name]}")([self.vr[name]])[0] for name in names]
        return values[0] if len(names) == 1 else values

    def begin(self, **values):
        self.raw.setupExperiment(startTime=0.0)
        self.set(**values)
        self.raw.enterInitializationMode()
        self.raw.exitInitializationMode()
        return self

    def step(self, time, size, **values):
        self.set(**values)
        self.raw.doStep(currentCommunicationPoint=time, communicationStepSize=size)
        return self

    def close(self):
        self.raw.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


@pytest.fixture
def instance(fmu):
    """instance(name, **starts) -> a fresh Instance of the FMU, closed after the test."""
    opened = []

    def make(name, **starts):
        opened.append(Instance(fmu(name, **starts)))
        return opened[-1]

    yield make
    for one in opened:
        one.close()
