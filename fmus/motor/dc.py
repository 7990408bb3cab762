"""DC motor, eq 15-20 of the study, in closed form over a step with held voltage and speed.

    U = K_e w + L I' + R I        (15, 17)      M = K_m I            (16)
    P_E = U I                     (18)          P_M = M w            (20)
    held and stalled: P_E = R / K_m^2 M^2       (19)

The current of a held step is an exponential, so that a step is exact however small L/R is; L = 0 (current without
delay) and R = 0 are its limits. With a voltage U_b lost at the brushes the equation is linear on each side of I = 0, and
between -I_b and I_b where U_b is lost in full from a current I_b on: the instants at which the current passes these are
known too.

Plain functions on floats, as numba compiles them too. Torque is positive in the direction of positive speed.
"""

from math import copysign, exp, expm1, inf, log, nan
from typing import NamedTuple

from ..effect import Parameter, join, parameters_type
from .effects import EFFECTS, HOOKS

BASE = (
    Parameter("resistance", "Ohm", 0.6, 0.0, inf, "resistance R of the armature winding"),
    Parameter("inductance", "H", 0.0002, 0.0, inf, "inductance L of the armature winding; 0: current without delay"),
    Parameter("voltage_constant", "V.s/rad", 0.03, 0.0, inf, "K_e: back-emf per speed"),
    Parameter("torque_constant", "N.m/A", 0.03, 0.0, inf, "K_m: torque per current"),
    Parameter("thermal_time", "s", 300.0, 0.0, inf, "time constant of warming; matters to effects of heat alone"),
)
Parameters = parameters_type(BASE, EFFECTS)


class State(NamedTuple):
    current: float  # A
    angle: float  # rad, turned since the start
    heat: float  # W, copper loss filtered with the thermal time constant
    effects: float  # above 0: some effect acts; angle and heat are followed then only


class Output(NamedTuple):
    current: float  # A
    torque: float  # N.m on the rotor
    electric_power: float  # W, eq 18
    mechanical_power: float  # W, eq 20


class Pace(NamedTuple):
    """What a step makes of the current in a winding without effects, x = R t / L: the same for all steps as long."""

    dt: float  # s
    left: float  # e^-x; no number where resistance or inductance is 0
    gone: float  # e^-x - 1
    share: float  # of what a current falls by in the step, in its mean


class Condition(NamedTuple):
    """What an effect's hook sees: the start of the step."""

    voltage: float  # V
    speed: float  # rad/s
    current: float  # A
    angle: float  # rad
    heat: float  # W


active = join(EFFECTS, HOOKS, "active")
added_resistance = join(EFFECTS, HOOKS, "resistance")
weakening = join(EFFECTS, HOOKS, "weakening")
unfelt = join(EFFECTS, HOOKS, "unfelt")
voltage_drop = join(EFFECTS, HOOKS, "drop")
knee = join(EFFECTS, HOOKS, "knee")
lost_voltage = join(EFFECTS, HOOKS, "lost")
added_torque = join(EFFECTS, HOOKS, "torque")


def free_current(current, voltage, resistance, inductance, dt):
    """Current after dt of L I' = U - R I with held U (eq 17; the back-emf is in U), A."""
    if inductance == 0.0:
        return voltage / resistance
    if resistance == 0.0:
        return current + voltage * dt / inductance
    x = resistance * dt / inductance
    return current * exp(-x) - voltage / resistance * expm1(-x)


def next_current(current, voltage, drop, resistance, inductance, dt):
    """As free_current, with a voltage `drop` >= 0 lost against the current's direction; at most it stops the current."""
    if drop == 0.0:
        return free_current(current, voltage, resistance, inductance, dt)
    if inductance == 0.0:
        return (max(voltage - drop, 0.0) + min(voltage + drop, 0.0)) / resistance
    left = dt
    if current != 0.0:
        net = voltage - drop if current > 0.0 else voltage + drop
        end = free_current(current, net, resistance, inductance, dt)
        if end == 0.0 or (end > 0.0) == (current > 0.0):
            return end
        # the current dies inside the step: R I / U_net = -expm1(-x) at the instant x = R t / L
        if resistance > 0.0:
            left -= inductance / resistance * log(1.0 - resistance * current / net)
        else:
            left += inductance * current / net
    net = max(voltage - drop, 0.0) + min(voltage + drop, 0.0)
    return free_current(0.0, net, resistance, inductance, max(left, 0.0))


def bent_current(current, voltage, drop, knee, resistance, inductance, dt):
    """As next_current, with drop I / knee lost up to the current `knee` > 0, A, and all of `drop` beyond.

    At a held voltage the current goes one way, so that it passes each of -knee and knee once at most.
    """
    inside = resistance + drop / knee
    if inductance == 0.0:
        small = voltage / inside
        return small if abs(small) <= knee else (voltage - copysign(drop, voltage)) / resistance
    left = dt
    for _ in range(3):
        slope = voltage - resistance * current - drop * min(max(current / knee, -1.0), 1.0)
        way = copysign(1.0, slope)
        if way * current >= knee:  # on its way out
            return free_current(current, voltage - way * drop, resistance, inductance, left)
        if way * current >= -knee:
            net, steep, border = voltage, inside, way * knee
        else:
            net, steep, border = voltage + way * drop, resistance, -way * knee
        end = free_current(current, net, steep, inductance, left)
        if way * end <= way * border:
            return end
        if steep > 0.0:
            left -= inductance / steep * log((net - steep * current) / (net - steep * border))
        else:
            left -= inductance * (border - current) / net
        left, current = max(left, 0.0), border
    return current


def warmed(p, heat, resistance, before, after, dt):
    """The copper loss, filtered, W, after dt in which the current, A, went straight from `before` to `after`."""
    loss = resistance * (before * before + before * after + after * after) / 3.0
    return loss - (loss - heat) * exp(-dt / p.thermal_time) if p.thermal_time > 0.0 else loss


def torque_of_current(p, x):
    """M = K_m I (16) with its effects, N.m."""
    return p.torque_constant * x.current / (1.0 + weakening(p, x)) + added_torque(p, x)


def torque_law(p, x):
    """The same as M = K I + M_c: the constant K that its effects leave, N.m/A, and the torque M_c beside it, N.m."""
    return p.torque_constant / (1.0 + weakening(p, x)), added_torque(p, x)


def pace(p, dt):
    """What `paced` and `mean_torque` know of steps of dt.

    A current that goes exponentially from I_0 to I_1 in x = R t / L time constants has the mean I_1 + (I_0 - I_1)
    (1/x - 1/(e^x - 1)).
    """
    x = p.resistance * dt / p.inductance if p.inductance > 0.0 else inf
    share = 0.5 - x / 12.0 if x < 1e-4 else 1.0 / x - 1.0 / expm1(x) if x < 700.0 else 1.0 / x
    if p.resistance == 0.0 or p.inductance == 0.0:
        return Pace(dt, nan, nan, share)
    return Pace(dt, exp(-x), expm1(-x), share)


def mean_torque(p, before, after, voltage, speed, known):
    """Torque on the rotor, N.m, as a mean over a step of this pace, from the states before and after it.

    What effects make of the mean current is the mean of both ends.
    """
    current = after.current + known.share * (before.current - after.current)
    if before.effects == 0.0:
        return p.torque_constant * current
    first, beside = torque_law(p, Condition(voltage, speed, before.current, before.angle, before.heat))
    last, besides = torque_law(p, Condition(voltage, speed, after.current, after.angle, after.heat))
    return 0.5 * ((first + last) * current + beside + besides)


def follow(p, s, current, speed, angle, dt):
    """The inverse of the winding: current (A), speed and angle of the rotor are measured after dt. State, torque in N.m.

    No voltage is asked for, so that what depends on it is as at 0 V.
    """
    resistance = p.resistance + added_resistance(p, Condition(0.0, speed, s.current, s.angle, s.heat))
    heat = warmed(p, s.heat, resistance, s.current, current, dt)
    return State(current, angle, heat, s.effects), torque_of_current(p, Condition(0.0, speed, current, angle, heat))


def start(p):
    """At rest, cold and without current."""
    return State(0.0, 0.0, 0.0, active(p, Condition(0.0, 0.0, 0.0, 0.0, 0.0)))


def advance(p, s, voltage, speed, dt):
    """A step of dt >= 0 with held voltage (V) and rotor speed (rad/s)."""
    resistance, strength, drop, lost, angle, heat = p.resistance, 1.0, 0.0, 0.0, s.angle, s.heat
    if s.effects > 0.0:
        x = Condition(voltage, speed, s.current, angle, heat)
        resistance += added_resistance(p, x)
        strength = 1.0 / (1.0 + weakening(p, x) - unfelt(p, x))
        drop = voltage_drop(p, x)
        lost = lost_voltage(p, x)
    current = s.current
    if dt > 0.0 or p.inductance == 0.0:
        net = voltage - lost - p.voltage_constant * strength * speed
        if drop == 0.0:  # as next_current, which is a call more at every step of most motors
            current = free_current(current, net, resistance, p.inductance, dt)
        else:
            bend = knee(p, x)
            if bend > 0.0:
                current = bent_current(current, net, drop, bend, resistance, p.inductance, dt)
            else:
                current = next_current(current, net, drop, resistance, p.inductance, dt)
    torque = p.torque_constant * current
    if s.effects > 0.0:
        heat = warmed(p, heat, resistance, s.current, current, dt)
        angle += speed * dt
        torque = torque_of_current(p, Condition(voltage, speed, current, angle, heat))
    return State(current, angle, heat, s.effects), Output(current, torque, voltage * current, torque * speed)


def paced(p, s, voltage, speed, known):
    """As `advance`, to the bit, over a step of this pace, for loops: where no effect acts, exponentials are those of the step before."""
    if s.effects > 0.0 or known.left != known.left:
        return advance(p, s, voltage, speed, known.dt)
    current = s.current * known.left - (voltage - p.voltage_constant * speed) / p.resistance * known.gone
    torque = p.torque_constant * current
    return State(current, s.angle, s.heat, s.effects), Output(current, torque, voltage * current, torque * speed)
