"""Lives of FMUs as commands to host.c, and the same life in FMPy."""

import zipfile

from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave

H = 1e-3  # s


class Extracted:
    """An FMU in a folder: its library, the URI of its resources, its value references."""

    def __init__(self, path, folder):
        self.folder = folder
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder)
        description = read_model_description(path)
        self.description = description
        self.library = folder / "binaries" / "linux64" / f"{description.modelName}.so"
        self.uri = (folder / "resources").as_uri()
        self.vr = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.outputs = [v.name for v in description.modelVariables if v.causality == "output" and v.type == "Real"]


def born(fmu, i=0, letter="A", parameters=(), uri=None):
    """Commands from loading to the end of initialization."""
    sets = [("real", i, fmu.vr[name], value) for name, value in dict(parameters).items()]
    return [
        ("load", letter, fmu.library),
        ("new", i, letter, f"it{i}", uri or fmu.uri, fmu.description.guid),
        ("setup", i),
        *sets,
        ("enter", i),
        ("exit", i),
    ]


def steps(fmu, inputs, first, last, i=0):
    """Commands of steps, each followed by a get of all outputs."""
    commands = []
    for n in range(first, last):
        commands += [("real", i, fmu.vr[name], float(value).hex()) for name, value in inputs(n).items()]
        commands += [("step", i, (n * H).hex(), H.hex()), ("get", i, *(fmu.vr[name] for name in fmu.outputs))]
    return commands


def numbers(commands, answers):
    """The values behind every get, each call having answered fmi2OK."""
    assert len(commands) == len(answers), answers[-3:]
    assert all(answer.split()[0] == "0" for answer in answers), [
        pair for pair in zip(commands, answers) if pair[1].split()[0] != "0"
    ][:3]
    return [
        [float.fromhex(word) for word in answer.split()[1:]] for command, answer in zip(commands, answers) if command[0] == "get"
    ]


def by_fmpy(fmu, parameters, inputs, count):
    slave = FMU2Slave(
        guid=fmu.description.guid,
        unzipDirectory=str(fmu.folder),
        modelIdentifier=fmu.description.coSimulation.modelIdentifier,
        instanceName="it",
    )
    slave.instantiate()
    slave.setupExperiment()
    slave.setReal([fmu.vr[name] for name in parameters], list(parameters.values()))
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    seen = []
    for n in range(count):
        for name, value in inputs(n).items():
            slave.setReal([fmu.vr[name]], [value])
        slave.doStep(n * H, H)
        seen.append(slave.getReal([fmu.vr[name] for name in fmu.outputs]))
    slave.terminate()
    slave.freeInstance()
    return seen
