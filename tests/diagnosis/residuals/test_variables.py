"""Variables that an error may depend on are made one at a time."""

import numpy as np

from .test_experiment import inverse


def test_a_variable_is_made_when_it_is_asked_for_and_kept_by_nobody(tmp_path, rng):
    bench = inverse(tmp_path, rng)
    known = bench.variables(bench.residuals[0], {})
    assert [*known] == ["time", "speed", "direction", "load", "acceleration", "position", "output position"] and len(known) == 7
    assert "load" in known and "current" not in known
    (time,), (again,) = known["time"], known["time"]
    assert time is not again and np.array_equal(time, again)
    (direction,), (speed,) = known["direction"], known["speed"]
    assert np.array_equal(direction, np.sign(speed))
    assert all(0.0 <= x.min() and x.max() < 2.0 * np.pi for x in known["position"])  # it goes round more than once


def test_all_who_look_at_a_run_have_its_steps_in_one_array(tmp_path, rng):
    bench = inverse(tmp_path, rng)
    other = bench.but_with(bench.setting)
    (first,), (second,) = bench.channels.values(), other.channels.values()
    assert first is not second and first.dt is second.dt
    np.testing.assert_array_equal(
        first.dt, np.diff(bench.runs[0].time, prepend=2.0 * bench.runs[0].time[0] - bench.runs[0].time[1])
    )
