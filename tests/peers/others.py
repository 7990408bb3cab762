"""The same .ssp in other masters: every Real output at every communication point, as arrays."""

import tempfile
import zipfile

import fmpy
import numpy as np


def outputs_of(ssp):
    """component -> names of its Real outputs, in the order of the archive."""
    from selflock.master.ssp import read

    with tempfile.TemporaryDirectory() as folder:
        flat = read(ssp, folder_path(folder))
        return {
            name: [
                v.name
                for v in fmpy.read_model_description(str(fmu), validate=False).modelVariables
                if v.causality == "output" and v.type == "Real"
            ]
            for name, fmu in flat.fmus.items()
        }


def folder_path(folder):
    from pathlib import Path

    return Path(folder)


def libcosim(ssp, step, count):
    """ "component.variable" -> count + 1 values. libcosim steps in whole nanoseconds."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.ERROR)
    names = outputs_of(ssp)
    values = {f"{component}.{name}": [] for component, group in names.items() for name in group}
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(ssp).extractall(folder)
        execution = CosimExecution.from_ssp_file(ssp_path=folder, step_size=round(step * 1e9))
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer)
        places = {}
        for component, group in names.items():
            index = execution.slave_index_from_instance_name(component)
            references = {v.name.decode(): v.reference for v in execution.slave_variables(index)}
            places[component] = index, [references[name] for name in group]
        for point in range(count + 1):
            if point and not execution.step():
                raise RuntimeError(f"libcosim failed at step {point}")
            if not point:
                execution.step(0)
            for component, (index, references) in places.items():
                for name, value in zip(names[component], observer.last_real_values(index, references)):
                    values[f"{component}.{name}"].append(value)
        del execution
    return {name: np.array(column) for name, column in values.items()}


def libcosim_of(structure, names, count):
    """The last values of "simulator.variable" after `count` steps of an OspSystemStructure.xml's folder."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_osp_config_file(osp_path=str(structure))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    execution.step(count)
    found = []
    for name in names:
        simulator, variable = name.split(".", 1)
        index = execution.slave_index_from_instance_name(simulator)
        reference = next(v.reference for v in execution.slave_variables(index) if v.name.decode() == variable)
        found += observer.last_real_values(index, [reference])
    return found


def ecos(ssp, step, count, parameters="parameters"):
    """ "component.variable" -> count + 1 values. parameters: the name of the sets that it takes."""
    from ecospy import EcosSimulation

    names = outputs_of(ssp)
    values = {f"{component}.{name}": [] for component, group in names.items() for name in group}
    with EcosSimulation(step_size=step, ssp_path=str(ssp)) as simulation:
        simulation.init(parameter_set=parameters)
        for point in range(count + 1):
            if point:
                simulation.step()
            for component, group in names.items():
                for name in group:
                    values[f"{component}.{name}"].append(simulation.get_real(f"{component}::{name}"))
    return {name: np.array(column) for name, column in values.items()}
