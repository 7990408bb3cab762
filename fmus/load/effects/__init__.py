"""What may differ from the drawing in a load. Every file here is found by itself; each is off by default.

Hooks are functions hook(p, x) of the Parameters and of the state x (fmus.load.load), all summed:

    mass      kg added to the mass on the arm
    arm       m added to the distance of the mass from the axis
    inertia   kg.m2 added to the inertia about the axis
    tilt      rad by which the whole is turned against gravity
"""

from ...effect import discover, total

EFFECTS = discover(__name__, __path__)
HOOKS = {"mass": total, "arm": total, "inertia": total, "tilt": total}
