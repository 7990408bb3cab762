"""Fleets that are drawn: as series, and as folders."""

import numpy as np
import pytest

from selflock.diagnosis.tracking.series import Series

from .drawn import write


@pytest.fixture
def fleet(rng):
    """fleet(units, months, worn={unit: f(months)}, …): a number of each unit over time, as series."""

    def draw(units=12, months=12, worn=(), scatter=0.02, error=0.01, season=0.0, tail=None):
        found = []
        for unit in range(units):
            when = np.arange(months) + rng.uniform(-0.1, 0.1, months)
            noise = rng.standard_normal(months) if tail is None else rng.standard_t(tail, months)
            value = 1.0 + season * np.sin(0.5 * when) + np.hypot(scatter, error) * noise
            value += worn[unit](when) if unit in worn else 0.0
            own = 2.0 * rng.uniform(0.9, 1.1)
            found.append(
                Series(f"{unit}", "gear.friction", "", 20_000.0 + 30.0 * when, own * value, np.full(months, own * error))
            )
        return found

    return draw


@pytest.fixture
def drawn(tmp_path, rng):
    """drawn(units, months, worn, name, told_by): a folder of such diagnoses."""
    return lambda **kind: write(tmp_path / "found", rng, **kind)
