"""What a real controller does beyond eq 21-22. Every file here is found by itself; each is off by default.

Hooks are functions hook(p, x) of the Parameters and of the Condition at the start of the step (fmus.controller.pd):

    active   above 0 when the effect is switched on; without it no other hook is asked
    lost     V that the amplifier does not pass on of the command x.command    summed
    limits   factor on voltage_min and voltage_max                             multiplied
    period   s between two samples of the command, which is held between       the largest counts
    delay    s by which the command acts late                                  summed
"""

from ...effect import discover, largest, product, total

EFFECTS = discover(__name__, __path__)
HOOKS = {"active": largest, "lost": total, "limits": product, "period": largest, "delay": total}
