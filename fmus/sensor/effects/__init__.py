"""What a sensor does to a value. Every file here is found by itself; each is off by default.

Hooks are functions hook(p, x) of the Parameters and of the value x (fmus.sensor.sensor):

    scale        factor on the value                     multiplied
    bias         added to the value                      summed
    lag          s, time constant of a first-order lag   summed
    resolution   step between two readings               the largest counts
"""

from ...effect import discover, largest, product, total

EFFECTS = discover(__name__, __path__)
HOOKS = {"scale": product, "bias": total, "lag": total, "resolution": largest}
