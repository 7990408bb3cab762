"""Our FMUs in a host that is not Python: they load, live, say what is wrong, and give the numbers that FMPy gets."""

import math

import pytest
from lives import H, born, by_fmpy, numbers, steps

# name -> (parameters, inputs at step i)
LIVELY = {
    "Motor": (
        {"brush_voltage": 0.5, "cogging_torque": 0.01, "winding_thermal_resistance": 3.0},
        lambda i: {"voltage": 10.0 * math.sin(0.3 * i), "speed": 50.0 * math.cos(0.1 * i)},
    ),
    "Controller": ({"command_delay": 0.003}, lambda i: {"angle_setpoint": 0.03 * math.sin(0.2 * i), "speed": 0.1 * math.cos(i)}),
    "Reducer": ({}, lambda i: {"motor_torque": 0.3 * math.sin(0.2 * i), "output_angle": 1e-4 * math.sin(0.3 * i)}),
    "Load": ({"mass": 1.0}, lambda i: {"torque": math.sin(0.5 * i)}),
    "Sensor": ({"lag_time": 0.01}, lambda i: {"value": math.sin(0.5 * i)}),
}


@pytest.mark.slow
@pytest.mark.alike
@pytest.mark.parametrize("name", LIVELY)
def test_a_whole_life_with_the_numbers_of_fmpy(host, extracted, name):
    fmu, (parameters, inputs) = extracted(name), LIVELY[name]
    life = [
        *born(fmu, parameters=parameters),
        *steps(fmu, inputs, 0, 40),
        ("save", 0, 1),
        *steps(fmu, inputs, 40, 60),
        ("restore", 0, 1),
        *steps(fmu, inputs, 40, 60),
        ("pack", 0, 1),
        ("restore", 0, 1),
        *steps(fmu, inputs, 40, 60),
        ("drop", 0, 1),
        ("terminate", 0),
        ("reset", 0),
        *born(fmu, parameters=parameters)[2:],
        *steps(fmu, inputs, 0, 40),
        ("terminate", 0),
        ("free", 0),
    ]
    answers, said = host(life)
    seen = numbers(life, answers)
    assert said == []
    expected = by_fmpy(fmu, parameters, inputs, 60)
    assert seen[:60] == expected  # to the last bit
    assert seen[60:80] == seen[80:100] == expected[40:]
    assert seen[100:] == expected[:40]


@pytest.mark.slow
def test_two_fmus_and_two_instances_at_once(host, extracted):
    motor, load = extracted("Motor"), extracted("Load")
    turns = {0: (motor, LIVELY["Motor"]), 1: (load, LIVELY["Load"]), 2: (motor, ({"resistance": 2.0}, LIVELY["Motor"][1]))}
    commands = [command for i, (fmu, (p, _)) in turns.items() for command in born(fmu, i, "ABA"[i], p)]
    for n in range(30):
        commands += [command for i, (fmu, (_, inputs)) in turns.items() for command in steps(fmu, inputs, n, n + 1, i)]
    commands += [("free", i) for i in turns]
    answers, said = host(commands)
    seen = numbers(commands, answers)
    assert said == []
    for i, (fmu, (parameters, inputs)) in turns.items():
        assert seen[i::3] == by_fmpy(fmu, parameters, inputs, 30)


@pytest.mark.slow
def test_two_threads_at_once(host, extracted):
    motor, load = extracted("Motor"), extracted("Load")
    answers, said = host(
        [
            ("load", "A", motor.library),
            ("load", "B", load.library),
            ("together", "A", motor.uri, "B", load.uri, 2000, motor.description.guid, load.description.guid),
        ]
    )
    assert answers == ["0", "0", "0 0"] and said == []


@pytest.mark.alike
@pytest.mark.parametrize("name", ["Motor", "Controller", "Reducer"])
def test_instances_come_and_go_without_growth(host, extracted, name):
    fmu = extracted(name)
    answers, _ = host([("load", "A", fmu.library), ("cycles", "A", "it", fmu.uri, 1000, fmu.description.guid)])
    made, growth = map(int, answers[1].split())
    assert made == 1000
    assert growth <= 200  # kB


def test_many_steps_without_growth(host, extracted):
    """States saved and restored at every step, as a master that rolls back does."""
    fmu = extracted("Motor")
    rolling = [("save", 0, 1), ("real", 0, fmu.vr["voltage"], 3.0), ("step", 0, 0.0, H), ("restore", 0, 1)] * 500
    answers, said = host([*born(fmu), *rolling, ("free", 0)])
    assert said == [] and set(answers) == {"0"}


@pytest.mark.alike
@pytest.mark.parametrize(
    ("command", "words"),
    [
        (lambda fmu: ("real", 0, fmu.vr["voltage"], "nan"), "voltage = nan is not a finite number"),
        (lambda fmu: ("real", 0, fmu.vr["resistance"], 1.0), "fixed parameter"),
        (lambda fmu: ("real", 0, 999, 1.0), "no variable has the value reference 999"),
        (lambda fmu: ("bool", 0, fmu.vr["voltage"], 1), "is of type Real, not Boolean"),
        (lambda fmu: ("get", 0, 999), "no variable has the value reference 999"),
        (lambda fmu: ("geti", 0, 999), "no variable has the value reference 999"),
        (lambda fmu: ("geti", 0, fmu.vr["voltage"]), "voltage is of type Real, not Integer"),
        (lambda fmu: ("getb", 0, fmu.vr["voltage"]), "voltage is of type Real, not Boolean"),
        (lambda fmu: ("gets", 0, fmu.vr["voltage"]), "voltage is of type Real, not String"),
        (lambda fmu: ("setup", 0), "set up before initialization mode"),
        (lambda fmu: ("enter", 0), "initialization mode is entered once"),
        (lambda fmu: ("exit", 0), "was not entered"),
        (lambda fmu: ("step", 0, 0.0, -1.0), "step size -1.0 s"),
        (lambda fmu: ("step", 0, "nan", 0.1), "communication point nan"),
        (lambda fmu: ("restore", 0, 7), "state was not given out"),
    ],
)
def test_an_error_is_the_status_of_the_call_and_the_host_lives_on(host, extracted, command, words):
    fmu = extracted("Motor")
    answers, said = host([*born(fmu), command(fmu), ("reset", 0), *born(fmu)[2:], ("step", 0, 0.0, H), ("free", 0)])
    assert answers[5].split()[0] == "3"  # fmi2Error
    assert words in said[0] and said[0].startswith("log it0 3 logStatusError")
    assert answers[6:] == ["0"] * 6


@pytest.mark.parametrize(
    ("commands", "words"),
    [
        ([("step", 0, 0.0, H)], "between initialization and termination"),
        ([("exit", 0)], "was not entered"),
        ([("terminate", 0)], "nothing runs"),
        ([("enter", 0), ("setup", 0)], "set up before"),
        ([("enter", 0), ("terminate", 0)], "nothing runs"),
        ([("enter", 0), ("exit", 0), ("terminate", 0), ("terminate", 0)], "nothing runs"),
        ([("enter", 0), ("exit", 0), ("terminate", 0), ("step", 0, 0.0, H)], "between initialization and termination"),
        ([("enter", 0), ("exit", 0), ("terminate", 0), ("real", 0, 0, 1.0)], "terminated"),
    ],
)
def test_calls_out_of_order_are_errors(host, extracted, commands, words):
    """The states of a slave, FMI 2.0, 4.2.4. A reset brings it back to the first."""
    fmu = extracted("Motor")
    born_ = born(fmu)
    answers, said = host([*born_[:2], *commands, ("reset", 0), *born_[2:], ("step", 0, 0.0, H), ("free", 0)])
    place = 2 + len(commands) - 1
    assert set(answers[:place]) == {"0"} and answers[place] == "3" and set(answers[place + 1 :]) == {"0"}
    assert words in said[0]


def test_another_guid_makes_no_instance(host, extracted):
    fmu = extracted("Motor")
    load = ("load", "A", fmu.library)
    answers, said = host([load, ("new", 0, "A", "it", fmu.uri, "another"), ("new", 1, "A", "it", fmu.uri, fmu.description.guid)])
    assert answers == ["0", "null", "0"] and "the GUID another is not that of this FMU" in said[0] and len(said) == 1


@pytest.mark.slow
def test_a_damaged_state_is_refused_and_a_sound_one_goes_on(host, extracted):
    fmu = extracted("Motor")
    for place in (1, 65, 200):  # in the checksum, at the end of the content, in its midst
        life = [
            *born(fmu),
            ("real", 0, fmu.vr["voltage"], 5.0),
            ("step", 0, 0.0, H),
            ("save", 0, 1),
            ("save", 0, 2),
            ("spoil", 0, 2, place),
            ("restore", 0, 2),
            ("step", 0, H, H),
            ("restore", 0, 1),
            ("step", 0, H, H),
            ("get", 0, fmu.vr["current"]),
        ]
        answers, said = host(life)
        assert answers[5:10] == ["0", "0", "0", "0", "0"] and answers[10:12] == ["3", "3"] and answers[12:14] == ["0", "0"]
        assert "the state to restore is damaged" in said[0]
        undisturbed = host([*life[:7], ("step", 0, H, H), life[-1]])[0]
        assert answers[-1] == undisturbed[-1]


@pytest.mark.slow
def test_tunable_parameters_change_while_it_runs(host, extracted):
    """Both limits change between two steps, one after the other; the voltage is theirs from the next step on."""
    fmu = extracted("Controller")
    limits = [("real", 0, fmu.vr["voltage_min"], 30.0), ("real", 0, fmu.vr["voltage_max"], 40.0)]
    step, get = ("step", 0, 0.0, H), ("get", 0, fmu.vr["voltage"])
    moving = [("real", 0, fmu.vr["angle_setpoint"], 1.0), ("real", 0, fmu.vr["speed_setpoint"], 1.0)]  # it does not rest
    answers, said = host([*born(fmu), *moving, step, get, *limits, step, get])
    assert said == [] and [float.fromhex(answers[place].split()[1]) for place in (8, 12)] == [24.0, 40.0]
    answers, said = host([*born(fmu), limits[0], step, ("reset", 0), *born(fmu)[2:], step])
    assert answers[5:7] == ["0", "3"] and "voltage_min = 30 V is above" in said[0] and answers[-1] == "0"


def test_bad_parameters_fail_the_end_of_initialization(host, extracted):
    fmu = extracted("Motor")
    answers, said = host(born(fmu, parameters={"resistance": 0.0, "inductance": 0.0}))
    assert answers[-1] == "3" and "nothing limits the current" in said[0]


@pytest.mark.alike
@pytest.mark.parametrize(
    "folder", ["with space", "accént ü", "hash#tag", "per%cent%20", "bra(ck)[et]s {x}", "plus+and&;,='quote", "日本"]
)
def test_paths_of_any_kind(host, extracted, folder):
    fmu = extracted("Motor", folder)
    raw = f"file://{fmu.folder}/resources"
    uris = (fmu.uri, fmu.uri.replace("file://", "file:"), raw, str(fmu.folder / "resources"), "file:///nowhere")
    commands = [word for i, uri in enumerate(uris) for word in (*born(fmu, i, uri=uri), ("step", i, 0.0, H))]
    answers, said = host(commands + [("free", i) for i in range(len(uris))])
    assert set(answers) == {"0"} and said == []


@pytest.mark.slow
@pytest.mark.alike
@pytest.mark.parametrize("locale", ["C", "C.UTF-8", "POSIX"])
def test_accents_in_any_locale(host, extracted, locale):
    fmu = extracted("Motor", "é")
    assert host([*born(fmu), ("step", 0, 0.0, H)], LC_ALL=locale)[0] == ["0"] * 6


def test_no_python_is_told(host, extracted, tmp_path):
    fmu = extracted("Motor")
    for named in ("/nowhere/python3", "/bin/false", str(tmp_path / "libpython3.so")):
        answers, said = host(born(fmu)[:2], SELFLOCK_PYTHON=named)
        assert answers == ["0", "null"]
        assert len(said) == 1 and named in said[0] and said[0].startswith("log it0 3")


def test_a_python_can_be_named(host, extracted):
    import sys
    import sysconfig
    from pathlib import Path

    library = Path(sysconfig.get_config_var("LIBDIR")) / sysconfig.get_config_var("INSTSONAME")
    fmu = extracted("Motor")
    for named in (sys.executable, str(library)):
        answers, said = host([*born(fmu), ("step", 0, 0.0, H)], SELFLOCK_PYTHON=named, PATH="/nowhere")
        assert answers == ["0"] * 6, said


def test_without_a_compiler_pythonfmu_s_library_is_packed(monkeypatch):
    from selflock.fmus import loader

    monkeypatch.setenv("CC", "/nowhere/cc")
    with pytest.warns(UserWarning, match="Python hosts only"):
        files = loader.binaries("Motor", "package")
    assert sorted(files) == ["binaries/linux64/Motor.so", "binaries/win64/Motor.dll", "resources/package/__init__.py"]
    assert files["binaries/linux64/Motor.so"] == (loader.PYTHONFMU / "linux64" / "libpythonfmu-export.so").read_bytes()
