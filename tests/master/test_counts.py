"""What a communication step costs, in counts that are the same on every machine: a bound is between what is and its double."""

import ctypes
import gc
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from selflock import master
from selflock.master import simulation
from selflock.master.fmu import FmuPart
from selflock.master.native import Native
from selflock.master.wiring import wire

STATUS, PLACE, NUMBER = ctypes.c_int, ctypes.c_void_p, ctypes.c_double
EXCHANGE = ctypes.CFUNCTYPE(STATUS, PLACE, PLACE, ctypes.c_size_t, PLACE)
DO_STEP = ctypes.CFUNCTYPE(STATUS, PLACE, NUMBER, NUMBER, ctypes.c_int)
ROOM = str(Path(simulation.__file__).parent)


def calls(system, steps):
    """Calls of Python and of C functions that the master's own code makes or is, in a run of so many steps."""
    system.run.stop, made = steps * system.run.step, 0

    def count(frame, event, argument):
        nonlocal made
        made += event in ("call", "c_call") and frame.f_code.co_filename.startswith(ROOM)

    before = sys.getprofile()
    gc.collect()  # what other tests left would be counted as it goes
    gc.disable()
    sys.setprofile(count)
    try:
        master.run(system)
    finally:
        sys.setprofile(before)
        gc.enable()
    return made


def ring(native, count, algorithm):
    described = {
        "run": {"step": 0.01, "algorithm": algorithm},
        "components": {f"i{k}": {"fmu": native("relaxation")} for k in range(count)},
        "connections": {f"i{k}.u": f"i{(k + 1) % count}.x" for k in range(count)},
    }
    return master.from_dict(described)


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_a_step_of_an_fmu_in_the_compiled_loop_is_three_c_calls(monkeypatch, native, algorithm):
    """One that writes all inputs, the step, one that reads all outputs: counted on their way into the FMU."""
    made, kept, offered = [], [], FmuPart.native

    def counted(kind, name, address):
        through = kind(address)
        kept.append(kind(lambda *given: (made.append(name), through(*given))[1]))
        return ctypes.cast(kept[-1], PLACE).value

    def watched(part) -> Native:
        native = offered(part)
        exchanges = {
            way: tuple(replace(one, function=counted(EXCHANGE, way, one.function)) for one in getattr(native, way))
            for way in ("writes", "reads")
        }
        return replace(native, do_step=counted(DO_STEP, "step", native.do_step), **exchanges)

    monkeypatch.setattr(simulation, "WORTH", 0)
    monkeypatch.setattr(FmuPart, "native", watched)
    system = ring(native, 3, algorithm)
    system.run.stop = 20 * system.run.step
    master.run(system)
    assert [made.count(name) for name in ("writes", "step", "reads")] == [60, 60, 60]


@pytest.mark.slow
def test_python_does_nothing_at_each_step_of_the_compiled_loop(monkeypatch, native):
    monkeypatch.setattr(simulation, "WORTH", 0)
    for count in (2, 8):  # once in a thousand steps results are looked at: 14 calls
        assert calls(ring(native, count, "jacobi"), 3000) - calls(ring(native, count, "jacobi"), 1000) < 2 * 25


@pytest.mark.slow
def test_a_step_in_python_costs_the_same_for_each_part(system):
    """Parts in process, one on the next: what a part adds does not depend on how many there are."""

    def each_step(count: int) -> float:
        parts = {f"m{k}": "Integrator" for k in range(count)}
        made = system(parts, {f"m{k}.u": f"m{(k + 1) % count}.y" for k in range(count)}, step=0.01)
        return (calls(made, 400) - calls(made, 200)) / 200

    some, many = each_step(4), each_step(16)
    assert many / 16 < 11  # there are 7
    assert many < 4.4 * some


def test_what_wires_a_part_does_not_depend_on_how_many_there_are(system, monkeypatch):
    """Counted in lines of the master's own code: a loop over all links for each part calls nothing."""

    def lines(count: int) -> int:
        parts = {f"m{k}": "Integrator" for k in range(count)}
        made, done = system(parts, {f"m{k}.u": f"m{(k + 1) % count}.y" for k in range(count)}, step=0.01), 0
        made.run.stop = made.run.step

        def count_lines(frame, event, argument):
            nonlocal done
            done += event == "line"
            return count_lines

        before = sys.gettrace()
        sys.settrace(lambda frame, event, argument: count_lines if frame.f_code.co_filename.startswith(ROOM) else None)
        try:
            master.run(made)
        finally:
            sys.settrace(before)
        return done

    some, many = lines(10), lines(60)
    assert many < 6.6 * some, (some, many)


def test_the_collector_waits_while_parts_are_made_and_not_after(system):
    """Also where they cannot be made."""
    made = system({f"m{k}": "Integrator" for k in range(300)}, {f"m{k}.u": f"m{k - 1}.y" for k in range(1, 300)}, step=0.01)
    made.run.open_inputs, kept, found = True, gc.get_threshold(), []
    gc.callbacks.append(looked := lambda phase, info: found.append(phase))
    gc.set_threshold(10, 2, 2)
    try:
        wire(made).close()
        during = len(found)
        with pytest.raises(master.DescriptionError):
            wire(replace(made, run=replace(made.run, record=["nothing"])))
    finally:
        gc.set_threshold(*kept)
        gc.callbacks.remove(looked)
    assert during < 300 and gc.isenabled()  # many times for each part where it does not wait
