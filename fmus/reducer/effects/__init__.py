"""What the published reducer leaves out, one effect per file, all off by default.

Hooks of the reducer, each `hook(p, x)` of law.Parameters and law.Condition; where several effects have one, they join:

active       1.0 where the effect is on and its coefficients stand still, 2.0 where they vary in a step      (largest)
dry          factor on all dry friction: mu_k, mu_s, drag                                                    (product)
viscosity    factor on viscous friction                                                                      (product)
kinetic      added to mu_k                                                                                   (sum)
static       added to mu_s                                                                                   (sum)
driving      added to mu while the load resists                                                              (sum)
backdriving  added to mu while the load helps                                                                (sum)
drag         friction torque on the input shaft that knows no load, N.m                                      (sum)
viscous      friction torque on the input shaft per speed, N.m.s/rad                                         (sum)
torque       torque on the input shaft that is no friction, positive against positive motion, N.m            (sum)
compliance   of the output shaft, added to 1/k, rad/(N.m)                                                    (sum)
play         between the flanks, rad at the output shaft                                                     (sum)
"""

from ...effect import discover, largest, product, total

EFFECTS = discover(__name__, __path__)
HOOKS = {
    "active": largest,
    "dry": product,
    "viscosity": product,
    "kinetic": total,
    "static": total,
    "driving": total,
    "backdriving": total,
    "drag": total,
    "viscous": total,
    "torque": total,
    "compliance": total,
    "play": total,
}
