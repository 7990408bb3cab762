"""FMI 3.0: types, arrays, sizes, events and clocks, in all three interfaces."""

import math
import zipfile
from pathlib import Path

import numpy as np
import pytest

from selflock import master
from selflock.master import ssp
from selflock.master.reading import read_description
from selflock.master.single import driven, single

FOREIGN = Path(__file__).parents[2].parent / "shared" / "foreign"
foreign = pytest.mark.skipif(not FOREIGN.exists(), reason="the models of others are not in ../shared/foreign")
WAYS = ("cs", "me", "se")
WHOLE = {"i8": (-128, 127), "u8": (0, 255), "i16": (-(2**15), 2**15 - 1), "u16": (0, 2**16 - 1), "i32": (-(2**31), 2**31 - 1),
         "u32": (0, 2**32 - 1), "i64": (-(2**63), 2**63 - 1), "u64": (0, 2**64 - 1)}  # fmt: skip


@pytest.fixture
def sampler(native):
    def run(interface="cs", settings=(), **more):
        return master.run(native("sampler"), settings=dict(settings), interface=interface, **more)

    return run


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_values_of_every_type_go_in_and_come_out(sampler, way):
    given = {"i8_in": -100, "u8_in": 200, "i16_in": -30000, "u16_in": 60000, "i32_in": 7, "u32_in": 4_000_000_000}
    given |= {"i64_in": -(2**53) + 1, "u64_in": 2**53 - 1, "f32_in": 0.1, "flag_in": True, "kind_in": 2}
    given |= {"word_in": "häßlich", "bytes_in": "00ff10"}
    row = sampler(way, given).table.iloc[-1]
    for name, value in given.items():
        expected = float(np.float32(0.1)) if name == "f32_in" else value
        assert row[f"sampler.{name.removesuffix('_in')}"] == expected, name


@pytest.mark.parametrize("name", WHOLE)
def test_whole_numbers_beyond_their_type_are_refused(sampler, refused, name):
    for beyond in (WHOLE[name][0] - 1, WHOLE[name][1] + 1, str(WHOLE[name][1] + 1)):
        refused(lambda: sampler(settings={f"{name}_in": beyond}), f"{name}_in", "beyond", str(WHOLE[name][1]))


def test_the_largest_whole_numbers_arrive_exactly(system, native):
    taken = {}
    described = system({"s": native("sampler")}, {}, stop=0.1, step=0.1, open_inputs=True, record=["s.x"])
    for name, (least, most) in WHOLE.items():
        for value in (least, most):
            settings = {f"s.{name}_in": value}
            master.run(described, settings=settings, observe=lambda t, parts: taken.update({name: parts["s"].get(name)}))
            assert taken[name] == value


def test_a_whole_number_that_no_float_holds_is_no_row(sampler):
    with pytest.raises(master.PartFailed, match=r"2\^53"):
        sampler(settings={"i64_in": 2**53 + 1})


def test_a_number_too_large_for_a_small_input_ends_the_run(system, native):
    described = system(
        {"a": (native("sampler"), {"i16_in": 300}), "b": native("sampler")},
        {"b.i8_in": "a.i16"},
        open_inputs=True,
        record=["b.i8"],
    )
    with pytest.raises(master.PartFailed, match=r"(?s)b answered .* 8 bits .*i8_in = 300"):
        master.run(described)


def test_arrays_are_their_elements(sampler):
    given = {"K[1,2]": 2.0, "K[2,1]": -1.0, "u[1]": 3.0, "u[2]": 5.0}
    table = sampler(settings=given).table
    assert (table["sampler.y[1]"] == 13.0).all() and (table["sampler.y[2]"] == 2.0).all()  # [1 2; -1 1] · [3 5]


def test_an_element_of_an_array_is_connected_alone(system, native):
    described = system(
        {"a": (native("sampler"), {"u[1]": 4.0}), "b": (native("sampler"), {"u[1]": 7.0, "K[2,1]": 1.0})},
        {"b.u[2]": "a.y[1]"},
        stop=0.3,
        step=0.1,
        open_inputs=True,
    )
    row = master.run(described).table.iloc[-1]
    assert (row["b.y[1]"], row["b.y[2]"]) == (7.0, 11.0)


@pytest.mark.parametrize("way", ["cs", "me"])
def test_the_size_of_arrays_is_chosen(sampler, way):
    given = {"n": 3} | {f"K[{i},{j}]": 10.0 * i + j for i in (1, 2, 3) for j in (1, 2, 3)} | {f"u[{j}]": j for j in (1, 2, 3)}
    row = sampler(way, given).table.iloc[-1]
    assert [row[f"sampler.y[{i}]"] for i in (1, 2, 3)] == [sum((10.0 * i + j) * j for j in (1, 2, 3)) for i in (1, 2, 3)]


@pytest.mark.parametrize("process", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_kept_part_of_another_size_is_made_anew(system, native, process):
    described = system({"s": (native("sampler"), {}, {"process": process})}, {}, stop=0.2, step=0.1, open_inputs=True)
    parts, counts = {}, []
    try:
        for settings in ({"s.n": 3, "s.u[3]": 1.0}, {}, {"s.n": 3}, {"s.n": 3}):
            counts.append(sum("y[" in column for column in master.run(described, settings=settings, keep=parts).table))
    finally:
        for part in parts.values():
            part.close()
    assert counts == [3, 2, 3, 3]


def test_a_size_that_is_none_is_refused(sampler, refused):
    refused(lambda: sampler(settings={"n": -1}), "n = -1", "UInt64", "size of an array")
    refused(lambda: sampler(settings={"u[3]": 1.0}), "no variable u[3]")


def beats(time):
    """Ticks until `time` of a clock of 0.3 s from 0.1 s on, and when they were."""
    return [0.1 + 0.3 * k for k in range(100) if 0.1 + 0.3 * k <= time + 1e-9]


@pytest.mark.parametrize("way, step", [("cs", 0.1), ("cs", 0.25), ("cs", 1.0), ("me", 0.1), ("me", 1.0), ("se", 0.25)])
def test_clocks_tick_at_their_time(sampler, way, step):
    """x falls with rate 1, and each beat adds 1: a sum of exponentials. Partitions hold it in between."""
    table = sampler(way, step=step, stop=2.0).table
    for _, row in table.iterrows():
        ticked = beats(row["time"])
        assert row["sampler.beats"] == len(ticked)
        assert row["sampler.laters"] == sum(t + 0.05 <= row["time"] + 1e-9 for t in ticked[2::3])  # the countdown
        now = (
            row["time"]
            if way != "se"
            else max([*ticked, *(t + 0.05 for t in ticked[2::3] if t + 0.05 <= row["time"] + 1e-9)], default=0)
        )
        assert row["sampler.x"] == pytest.approx(sum(math.exp(t - now) for t in ticked), abs=1e-4 if way == "me" else 1e-12)


@pytest.mark.parametrize("way", WAYS)
def test_clocks_that_others_tick_are_booleans(sampler, way, tmp_path):
    (tmp_path / "u.csv").write_text("time,hit\n0,0\n0.2,1\n0.3,0\n0.7,1\n0.9,0\n")
    table = sampler(way, inputs=tmp_path / "u.csv", step=0.1, stop=1.0).table
    assert table["sampler.hits"].tolist() == [0, 0, 0, 1, 1, 1, 1, 1, 2, 3, 3]
    assert table["time"][table["sampler.out"]].tolist() == pytest.approx([0.4, 1.0])  # with every other beat


def test_a_clock_of_time_is_not_set(sampler, refused):
    refused(lambda: sampler(settings={"beat": True}), "beat", "ticks by time")


def test_no_event_without_need(system, native):
    """Event mode is entered for what changes, not at every step."""
    described = system({"s": native("sampler")}, {}, stop=1.0, step=0.001, open_inputs=True, record=["s.events"])
    assert master.run(described).table["s.events"].iloc[-1] == 1 + len(beats(1.0)) + 1  # the start, the beats, a countdown


@pytest.mark.parametrize("way", ["cs", "me"])
def test_it_may_end_the_run_in_a_step(sampler, way):
    result = sampler(way, {"ends_at": 0.55}, step=0.1)
    assert result.ended == {"sampler": 0.55} and result.table["time"].iloc[-1] == 0.55
    assert result.table["sampler.x"].iloc[-1] == pytest.approx(math.exp(-0.45) + math.exp(-0.15), abs=1e-5)


def test_it_goes_back(system, native):
    parts = {"s": native("sampler")}
    described = system(parts, {}, stop=1.0, step=0.1, step_control="doubling", step_min=0.05, open_inputs=True)
    table = master.run(described).table
    assert table["s.beats"].tolist() == [len(beats(time)) for time in table["time"]]


def test_a_binary_goes_from_one_to_another_and_nowhere_else(system, native, refused):
    parts = {"a": (native("sampler"), {"bytes_in": "c0ffee", "word_in": "tea"}), "b": native("sampler")}
    links = {"b.bytes_in": "a.bytes", "b.word_in": "a.word"}
    row = master.run(system(parts, links, stop=0.3, step=0.1, open_inputs=True)).table.iloc[-1]
    assert row["b.bytes"] == "c0ffee" and row["b.word"] == "tea"
    refused(lambda: master.run(system(parts, {"b.word_in": "a.bytes"}, open_inputs=True)), "Binary does not fit into String")
    refused(
        lambda: master.run(system({"a": (native("sampler"), {"bytes_in": "coffee"})}, {}, open_inputs=True)),
        "bytes_in",
        "hexadecimal",
    )


def test_through_a_system_structure(system, native, tmp_path):
    parts = {"a": (native("sampler"), {"u[1]": 4.0, "K[1,2]": 0.5, "n": 2}), "b": (native("sampler"), {}, {"interface": "me"})}
    described = system(parts, {"b.u[2]": "a.y[1]", "b.i8_in": "a.beats"}, stop=1.0, step=0.1, open_inputs=True)
    ssp.export(described, tmp_path / "s.ssp")
    one, other = master.run(described).table, master.run(tmp_path / "s.ssp").table
    assert list(one.columns) == list(other.columns) and (one == other).all().all()
    assert one["b.i8"].iloc[-1] == 4 and one["b.y[2]"].iloc[-1] == 4.0


def described_as(path, out, *changes):
    """A copy of an FMU with words of its description changed."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            text = old.read(name)
            for before, after in changes if name == "modelDescription.xml" else ():
                assert before.encode() in text
                text = text.replace(before.encode(), after.encode())
            new.writestr(name, text)
    return out


@pytest.mark.parametrize(
    "before, after, word",
    [
        (
            'name="u" valueReference="3" causality="input"',
            'name="u" valueReference="3" causality="input" declaredType="No"',
            "'No'",
        ),
        ('<BaseUnit m="1"/>', '<BaseUnit m="0.5"/>', "m"),
        ('<Output valueReference="5" dependencies=""/>', '<Output valueReference="555"/>', "555"),
        ('variability="fixed" start="1e9"', 'variability="constant" start="1e9"', "ends_at"),
        ('<EnumerationType name="Kind">', '<EnumerationType name="Kind" colour="red">', ""),
        ('valueReference="4" dependencies="3"', 'valueReference="4" dependencies=" 3  3 "', ""),
    ],
)
def test_slips_of_a_description_are_mended_and_told(native, tmp_path, caplog, before, after, word):
    path = described_as(native("sampler"), tmp_path / "s.fmu", (before, after))
    assert master.run(path, settings={"u[1]": 2.0}).table["sampler.y[1]"].iloc[-1] == 2.0
    assert word in caplog.text and bool(caplog.text) == bool(word)


def test_what_is_no_co_simulation_of_fmi_3_is_told(native, tmp_path, refused):
    path = described_as(native("sampler"), tmp_path / "a.fmu", ('fmiVersion="3.0"', 'fmiVersion="3.0-beta.2"'))
    refused(lambda: master.run(path), "is FMI 3.0-beta.2")
    path = described_as(native("sampler"), tmp_path / "b.fmu", ('intervalDecimal="0.3"', ""))
    refused(lambda: master.run(path), "clock beat says no interval")


def test_info_tells_of_it(native):
    from selflock.info import info

    text = info(native("sampler"))
    assert "FMI 3.0 co-simulation, model exchange, scheduled execution" in text and "1 continuous state" in text
    assert "u[2]" in text and "UInt64" in text and "Clock" in text


# --- of others -------------------------------------------------------------------------------------------------------


@foreign
@pytest.mark.parametrize("name", ["BouncingBall", "Dahlquist", "Stair", "VanDerPol"])
def test_the_reference_fmus_are_as_in_fmpys_loop(name):
    """Bit by bit: their own solvers step, and events are handled where they are, with event mode here, without it there."""
    fmpy = pytest.importorskip("fmpy")
    path = str(FOREIGN / "fmus" / f"ecos__{name}.fmu")
    table = master.run(path).table
    other = fmpy.simulate_fmu(path, fmi_type="CoSimulation", output_interval=table["time"].iloc[1])
    for column in other.dtype.names[1:]:
        assert np.array_equal(table[f"{name}.{column}"], other[column])


def ramp(path, rows=((0, 0), (1, 1), (2, 3))):
    path.write_text("time,u\n" + "".join(f"{time},{value}\n" for time, value in rows))
    return path


def test_an_intermediate_update_is_accepted_and_says_that_nobody_returns(native, tmp_path):
    """Held inputs: the left sum of a ramp, 0.45 at 1 s in steps of 0.1 s; asked ten times a step."""
    table = master.run(native("integral3"), inputs=ramp(tmp_path / "u.csv"), step=0.1, stop=1.0).table
    assert table["integral3.x"].iloc[-1] == pytest.approx(0.45, rel=1e-12)
    assert table["integral3.asked"].iloc[-1] == 100


@pytest.mark.parametrize("step", [0.1, 0.5, 1.0])
def test_inputs_are_on_a_line_inside_a_step_where_an_fmu_asks(native, tmp_path, step):
    """u = t, then 2 t - 1: x = t^2 / 2 and 1/2 + (t^2 - t) there, exact by its own midpoints at any step that meets the corner."""
    system = single(Path(native("integral3")), step=step, stop=2.0)
    system.run.input_derivatives = True
    table = master.run(driven(system, ramp(tmp_path / "u.csv"))).table
    t = table["time"].to_numpy()
    assert table["integral3.x"].to_numpy() == pytest.approx(np.where(t <= 1, t**2 / 2, 0.5 + t**2 - t), abs=1e-12)


def test_its_directional_derivatives_are_known_by_the_third_version_s_name(native, tmp_path):
    described, _ = read_description(Path(native("integral3")))
    assert not described.coSimulation.providesDirectionalDerivative
    folder = tmp_path / "d"
    with zipfile.ZipFile(native("integral3")) as archive:
        archive.extractall(folder)
    file = folder / "modelDescription.xml"
    file.write_text(file.read_text().replace("providesInter", 'providesDirectionalDerivatives="true" providesInter'))
    assert read_description(folder)[0].coSimulation.providesDirectionalDerivative
