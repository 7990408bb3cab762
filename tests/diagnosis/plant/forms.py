"""Nature's forms: what friction, contact and the armature of a drive are like, of which no data sheet tells.

Another form of a law is no cause to be found: where the sheet's values are right, a simple law of the right name is
right to within 1.3 times the error that the true one leaves.
"""

from __future__ import annotations

import numpy as np

from .drive import Drive

FORMS = {
    "bristle_form": ("Dahl", "LuGre", "elasto-plastic"),
    "stribeck_form": ("Lorentzian", "hyperbolic secant"),
    "viscous_form": ("thinning", "churning"),
    "contact_form": ("spring and damper", "damped with depth"),
    "armature_form": ("inductance", "quasi-static"),
}
PERIODS = (1.25e-4, 2.5e-4)  # s, of choppers: 8 and 4 kHz


def nature(rng: np.random.Generator, sheet: Drive) -> tuple[Drive, Drive]:
    """The data sheet with the inductance that goes with the armature, and the drive with forms drawn for all its laws."""
    form = {name: int(rng.integers(len(kinds))) for name, kinds in FORMS.items()}
    ripple = float(np.exp(rng.uniform(np.log(1e-3), np.log(1e-2)))) if rng.random() < 0.5 else 0.0
    segments = float(rng.choice((7, 9, 11, 13)))
    pulsed = bool(rng.random() < 0.4)
    period, inductance = float(rng.choice(PERIODS)), rng.uniform(1e-3, 3e-3)
    if form["armature_form"] == 1:  # a disc's or a bell's winding; behind a chopper it has a choke, and is none
        return (s := sheet._replace(inductance=1e-5)), s._replace(commutation=ripple, segments=segments, **form)
    if pulsed:
        sheet = sheet._replace(inductance=float(inductance))
    return sheet, sheet._replace(commutation=ripple, segments=segments, chopper=period if pulsed else 0.0, **form)


def told(drive: Drive) -> dict:
    """The forms of a drive in words."""
    words = {name.removesuffix("_form"): kinds[getattr(drive, name)] for name, kinds in FORMS.items()}
    return words | {"commutation": drive.commutation, "chopper": drive.chopper}
