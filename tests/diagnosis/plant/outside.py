"""More kinds outside the vocabulary, for the study of recordings; the old study's list (causes.OUTSIDE) stays as it is."""

from __future__ import annotations

import numpy as np

from .causes import OUTSIDE, Cause


def _unknown(what, depends_on, change, extent=(0.02, 4.0)):
    return Cause("-", "unknown", change, what=what, depends_on=depends_on, extent=extent)


def _dent(rng, d):
    """A guide that is worn in one place: friction on the load there."""
    place, width = rng.uniform(-1.0, 1.0), rng.uniform(0.1, 0.3)
    return _unknown("dent", ("position", "angle"), lambda s: dict(dent=2.0 * s, dent_angle=place, dent_width=width))


def _loosened(rng, d):
    """A screw that comes loose: friction is another from one moment on."""
    sign, when = rng.choice((-1.0, 1.0)), rng.uniform(4.0, 8.0)
    return _unknown("loosened", ("time",), lambda s: dict(loosened=0.3 * sign * s, loosened_time=when), (0.02, 3.0))


def _current_curve(rng, d):
    """A current sensor whose core saturates."""
    return _unknown("current_curve", ("current",), lambda s: dict(current_curve=0.03 * s), (0.02, 3.0))


def _eccentricity(rng, d):
    """An encoder's disc off its centre."""
    phase = rng.uniform(0.0, 2.0 * np.pi)
    return _unknown(
        "eccentricity", ("position", "angle"), lambda s: dict(eccentricity=0.01 * s, eccentricity_phase=phase), (0.02, 8.0)
    )


def _tooth(rng, d):
    """A damaged tooth: a torque where it meshes, one sign both ways. No effect of the product is told so: a user's may be."""
    place, length, sign = rng.uniform(-0.5, 0.1), rng.uniform(0.25, 0.5), rng.choice((-1.0, 1.0))
    return Cause("reducer", "tooth", lambda s: dict(tooth=0.05 * sign * s, tooth_place=place, tooth_length=length))


OF_A_USER = {"reducer.tooth": _tooth}
"""What an effect file of a user's names (tests/diagnosis/test_effects_of_a_user.py)."""

MORE = {
    "unknown.dent": _dent,
    "unknown.loosened": _loosened,
    "unknown.current_curve": _current_curve,
    "unknown.eccentricity": _eccentricity,
}
BEYOND = (*OUTSIDE, *MORE)
"""All kinds outside the vocabulary."""
