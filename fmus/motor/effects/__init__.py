"""What a real motor does beyond eq 15-20. Every file here is found by itself; each is off by default.

Hooks are functions hook(p, x) of the Parameters and of the Condition at the start of the step (fmus.motor.dc):

    active       above 0 when the effect is switched on; without it no other hook is asked
    resistance   Ohm added to the winding                                    summed
    weakening    w >= 0: both constants K_e and K_m are divided by 1 + w     summed
    unfelt       of w, what the voltage constant K_e has not                 summed
    drop         V lost between terminals and winding, against the current   summed
    knee         A from which on all of that is lost, in proportion below    summed
    lost         V that the terminals have less, of the voltage's sign        summed
    torque       N.m on the shaft beside K_m I                               summed
"""

from ...effect import discover, largest, total

EFFECTS = discover(__name__, __path__)
HOOKS = {"active": largest} | dict.fromkeys(("resistance", "weakening", "unfelt", "drop", "knee", "lost", "torque"), total)
