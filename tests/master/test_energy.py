"""The energy balance of the coupling, against what theory says it must be."""

import pytest

from selflock import master


@pytest.mark.parametrize("h", [0.1, 0.01])
def test_held_speed_loses_what_theory_says(system, h):
    """A constant force F on a free mass: the giver sees v at the step's start, so it gives F²hT/2m too little."""
    description = system(
        {"p": ("Push", {"strength": 3.0}), "m": ("Mass", {"mass": 2.0})}, {"m.force": "p.force", "p.v": "m.v"}, stop=1.0, step=h
    )
    bond = master.run(description).energy.loc["p.force"]
    assert bond.taken == pytest.approx(0.5 * 3.0**2 / 2.0, rel=1e-9)  # F²T²/2m, all of it kinetic energy
    assert bond.lost == pytest.approx(-(3.0**2) * h / (2 * 2.0), rel=1e-9)


def test_units_and_factors_do_not_count_as_loss(system):
    """Twice the force and half the speed carry the same power; a force given in kN is compared in J."""
    description = system({"p": ("Push", {"strength": 3.0}), "m": "Mass"}, stop=1.0, step=0.001)
    description.connections = {"m.force": master.Connection("p.force", factor=2.0), "p.v": master.Connection("m.v", factor=2.0)}
    bond = master.run(description).energy.loc["p.force"]
    assert bond.given == pytest.approx(bond.taken, rel=0.003)
    description.connections["p.v"].factor = 0.5
    bond = master.run(description).energy.loc["p.force"]
    assert bond.given == pytest.approx(bond.taken, rel=0.003)


def test_bonds_can_be_declared_and_are_checked(system, refused):
    description = system({"p": "Push", "m": "Mass"}, {"m.force": "p.force", "p.v": "m.v"}, stop=0.1, step=0.01)
    description.bonds = [master.Bond("p.force", "m.v", "shove")]
    assert list(master.run(description).energy.index) == ["shove"]
    description.bonds = [master.Bond("p.force", "m.x")]
    refused(lambda: master.run(description), "m.x -> p.(input)")


def test_a_result_without_bonds_has_an_empty_balance(system):
    assert master.run(system({"i": ("Integrator", {"u": 1.0})}, stop=0.1, step=0.1)).energy.empty
