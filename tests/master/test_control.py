"""Step control: error within tolerance, rollback exact, times on the grid."""

import numpy as np
import pytest
from test_algorithms import error, two_masses

from selflock import master


@pytest.mark.parametrize("control", ["power", "doubling"])
@pytest.mark.slow
def test_a_smaller_tolerance_gives_a_smaller_error_in_more_steps(system, control):
    runs = [master.run(two_masses(system, step=0.1, step_control=control, tolerance=t)) for t in (1e-2, 1e-3)]
    assert error(runs[1].table) < error(runs[0].table) / 2
    assert runs[1].steps > runs[0].steps
    for result in runs:
        times = result.table["time"].to_numpy()
        assert times[0] == 0.0 and times[-1] == 2.0 and (np.diff(times) > 0).all()
        ticks = times / (0.1 / 1024)
        assert np.abs(ticks - np.round(ticks)).max() < 1e-6


def test_rejected_steps_leave_no_trace(system):
    """Doubling takes every step back once; held to one size it must repeat the fixed run with half the step to the bit."""
    fixed = master.run(two_masses(system, step=0.01)).table
    doubled = master.run(two_masses(system, step=0.02, step_min=0.02, step_control="doubling", tolerance=1e9)).table
    assert np.array_equal(doubled.to_numpy(), fixed.iloc[::2].to_numpy())


def test_energy_is_rolled_back_too(system):
    doubled = master.run(two_masses(system, step=0.02, step_min=0.02, step_control="doubling", tolerance=1e9))
    fixed = master.run(two_masses(system, step=0.01))
    assert doubled.energy.equals(fixed.energy)


def test_what_cannot_be_controlled_is_refused(system, refused, monkeypatch):
    import small_parts

    alone = system({"i": ("Integrator", {"u": 1.0})}, step_control="power")
    refused(lambda: master.run(alone), "no bonds")
    monkeypatch.setattr(small_parts.Mass, "can_roll_back", False)
    refused(lambda: master.run(two_masses(system, step=0.1, step_control="doubling")), "a, b cannot roll back")
    monkeypatch.setattr(small_parts.Mass, "variable_step", False, raising=False)
    refused(lambda: master.run(two_masses(system, step=0.1, step_control="power")), "one size")
    own = two_masses(system, step=0.1, step_control="power")
    own.components["a"].step = 0.05
    refused(lambda: master.run(own), "step of its own")


def test_a_discarded_step_is_made_again_smaller(system):
    description = system({"c": ("Careful", {"u": 1.0, "longest": 0.03})}, stop=1.0, step=0.1, step_control="doubling")
    result = master.run(description)
    assert result.table["c.y"].to_numpy() == pytest.approx(result.table["time"].to_numpy())
    assert result.rejected > 0 and np.diff(result.table["time"]).max() == pytest.approx(0.025)
    with pytest.raises(master.PartFailed, match="Discard"):
        master.run(description, settings={"c.longest": 1e-6})
