"""The reducer in time: input shaft, wedge with Coulomb friction, and the output shaft's spring and damper.

Dynamic mode, `advance`: the motor's torque M is given, the input shaft of inertia J moves,

    J w' = M - F   while sliding,      w = 0 while F = M lies inside the friction cone,
    P = k (angle / r - output angle) + c (speed / r - output speed).

The step is solved in closed form from event to event (travel.py), so it is exact for held M and an output angle that
moves on with its speed, whatever the step. A step without events, the usual one, is taken here directly.

Kinematic mode, `impose`: the motion of the input shaft is given, and F is what it needs. At rest the F of smallest
magnitude in the cone is taken. The acceleration is that of successive imposed speeds.

With effects on, their coefficients are held over inner steps of at most INNER_STEP, each solved like a plain step,
with the coefficients of its middle (second order). With all effects off the plain step is taken, to the last bit.

A step that needs more than PIECES (travel.py) from event to event, with all its inner steps, has no result (NaN).

Signs: torques and angles positive in the direction of positive input angle; P on what is driven, the reaction on the
casing. A step from t to t + dt is given the inputs at t and returns state and outputs at t + dt.
"""

import math
from typing import NamedTuple

from .flow import NONE
from .law import (
    BASE,
    EFFECTS,
    Condition,
    Parameters,
    Slip,
    active,
    contact,
    extended,
    flank,
    friction_at,
    plain,
    sliding,
    static_coefficient,
    wound_up,
)
from .travel import PIECES, glide, held, travel
from .wedge import (
    backdriving_slope,
    cone,
    cone_of,
    driving_slope,
    least_torque,
    normal_force,
    preload_torque,
    sliding_torque,
    wedge_tangent,
)

__all__ = ["BASE", "EFFECTS", "Output", "Parameters", "State", "advance", "advance_on", "impose", "relaxed", "start"]

INNER_STEP = 2.5e-4  # s


class State(NamedTuple):
    """Everything the reducer remembers."""

    angle: float  # of the input shaft, rad
    speed: float  # of the input shaft, rad/s; exactly 0 at rest
    effects: float  # 0.0 none is on, 1.0 some whose coefficients stand still in a step, 2.0 some whose vary
    time: float  # since the start, s; this and what follows is kept up only while effects are on
    heat: float  # what the losses have left in the reducer, J
    distance: float  # travelled by the input shaft, rad


class Output(NamedTuple):
    """At the end of a step."""

    input_torque: float  # F, N.m
    output_torque: float  # P, N.m
    friction_torque: float  # F - P/r, what friction adds at the input shaft, N.m
    input_angle: float  # rad
    input_speed: float  # rad/s
    motor_torque_required: float  # F + J w', N.m
    normal_force: float  # N in the wedge (4), as torque at the input shaft, N.m
    stuck: float  # 1.0 while static friction holds
    input_power: float  # F w, W
    output_power: float  # P times output speed, W
    loss_power: float  # of friction and of the output shaft's damper, W; what is left of the balance is in the spring


def start(p, angle, speed, output_angle, output_speed):
    """The state at the start: angle and speed of the input shaft, rad and rad/s."""
    x = Condition(1.0, speed, angle, output_angle, 0.0, 0.0, 0.0, 0.0)
    return State(angle, speed, active(p, x), 0.0, 0.0, 0.0)


def relaxed(p, output_torque, speed, output_angle, output_speed):
    """The state at the start in which the output shaft is wound up by this torque, N.m, and no more."""
    x = Condition(1.0, speed, 0.0, output_angle, output_torque, 0.0, 0.0, 0.0)
    return start(p, p.gear_ratio * (output_angle + wound_up(p, x, flank(output_torque, 0.0))), speed, output_angle, output_speed)


def advance(p, s, motor_torque, output_angle, output_speed, dt):
    """Dynamic mode: state and outputs after dt, s, under a held motor torque, N.m; dt = 0 gives the outputs as they are."""
    state, out, _ = advance_on(
        p, s, wedge_tangent(p.gear_ratio, p.wedge_angle), motor_torque, output_angle, output_speed, dt, NONE
    )
    return state, out


def advance_on(p, s, t, motor_torque, output_angle, output_speed, dt, known):
    """As `advance`, to the bit, for loops: `known` is the response of a step before (flow.py), which comes back as that of this one.

    To compute it is a third of a step, and under the same law steps as long have the same. t: tangent of the wedge (wedge.py).
    """
    ratio = p.gear_ratio
    if s.effects > 0.0:
        return _advance_extended(p, s, t, motor_torque, output_angle, output_speed, dt, known)

    # The usual step: it rests, or slides on one line of F, from beginning to end.
    speed = s.speed
    windup = s.angle / ratio - output_angle
    v = speed / ratio - output_speed
    k = p.shaft_stiffness
    c = p.shaft_damping
    torque = k * windup + c * v
    if speed == 0.0:
        torque1 = torque - k * output_speed * dt
        mu = static_coefficient(p)
        drive = driving_slope(mu, t, ratio)
        back = backdriving_slope(mu, t, ratio)
        level = preload_torque(mu, p.preload, t)
        # Where F is one line of P over the whole step, or monotone in P, both ends inside the cone are enough.
        if torque * torque1 > 0.0 and level == 0.0 or torque == torque1 or back >= 0.0:
            low, high = cone_of(torque, drive, back, level, ratio)
            if low <= motor_torque <= high:
                low, high = cone_of(torque1, drive, back, level, ratio)
                if low <= motor_torque <= high:
                    out = Output(
                        motor_torque,
                        torque1,
                        motor_torque - torque1 / ratio,
                        s.angle,
                        0.0,
                        motor_torque,
                        normal_force(motor_torque, torque1 / (ratio * t), t),
                        1.0,
                        0.0,
                        torque1 * output_speed,
                        c * v * v,
                    )
                    return s, out, known
    else:
        mu = p.friction_kinetic
        level = preload_torque(mu, p.preload, t)
        drive = driving_slope(mu, t, ratio)
        back = backdriving_slope(mu, t, ratio)
        fine, wound, speed1, torque1, known = glide(
            drive, back, level, 0.0, 0.0, k, c, 0.0, ratio, p.shaft_inertia, windup, speed, motor_torque, output_speed, dt, known
        )
        if fine > 0.0:
            way = 1.0 if speed > 0.0 else -1.0
            x = torque1 * way
            force = way * max(x * (drive if x > 0.0 else back), x / ratio + level)
            angle = s.angle + ratio * (wound + output_speed * dt)
            friction = force - torque1 / ratio
            v1 = speed1 / ratio - output_speed
            out = Output(
                force,
                torque1,
                friction,
                angle,
                speed1,
                motor_torque,
                normal_force(force, torque1 / (ratio * t), t),
                0.0,
                force * speed1,
                torque1 * output_speed,
                friction * speed1 + c * v1 * v1,
            )
            return State(angle, speed1, 0.0, s.time, s.heat, s.distance), out, known

    law = plain(p, t)
    angle, speed, _, _ = travel(law, ratio, p.shaft_inertia, s.angle, speed, motor_torque, output_angle, output_speed, dt)
    state = State(angle, speed, 0.0, s.time, s.heat, s.distance)
    return state, _outputs(law, t, ratio, state, motor_torque, output_angle + output_speed * dt, output_speed), known


def impose(p, s, imposed_angle, imposed_speed, output_angle, output_speed, dt):
    """Kinematic mode: state and outputs after dt, s; the imposed angle, rad, moves on with the imposed speed, rad/s."""
    ratio = p.gear_ratio
    t = wedge_tangent(ratio, p.wedge_angle)
    angle = imposed_angle + imposed_speed * dt
    output_angle += output_speed * dt
    inertial = p.shaft_inertia * (imposed_speed - s.speed) / dt if dt > 0.0 else 0.0
    if s.effects > 0.0:
        return _impose_extended(p, s, t, angle, imposed_speed, output_angle, output_speed, inertial, dt)
    v = imposed_speed / ratio - output_speed
    torque = p.shaft_stiffness * (angle / ratio - output_angle) + p.shaft_damping * v
    stuck = 0.0
    if imposed_speed == 0.0:
        low, high = cone(torque, static_coefficient(p), p.preload, t, ratio)
        force = least_torque(low, high)
        stuck = 1.0
    else:
        way = 1.0 if imposed_speed > 0.0 else -1.0
        force = sliding_torque(torque, way, p.friction_kinetic, p.preload, t, ratio)
    friction = force - torque / ratio
    return State(angle, imposed_speed, 0.0, s.time, s.heat, s.distance), Output(
        force,
        torque,
        friction,
        angle,
        imposed_speed,
        force + inertial,
        normal_force(force, torque / (ratio * t), t),
        stuck,
        force * imposed_speed,
        torque * output_speed,
        friction * imposed_speed + p.shaft_damping * v * v,
    )


def _impose_extended(p, s, t, angle, speed, output_angle, output_speed, inertial, dt):
    """Kinematic mode with effects on, as of the end of the step."""
    state = State(angle, speed, s.effects, s.time + dt, s.heat, s.distance + abs(speed) * dt)
    out = _affected_outputs(p, t, state, math.nan, output_angle, output_speed)
    return _heated(p, state, out.loss_power, dt), Output(
        out.input_torque,
        out.output_torque,
        out.friction_torque,
        angle,
        speed,
        out.input_torque + inertial,
        out.normal_force,
        out.stuck,
        out.input_power,
        out.output_power,
        out.loss_power,
    )


def _advance_extended(p, s, t, motor_torque, output_angle, output_speed, dt, known):
    """Dynamic mode with effects on: inner steps, each with the coefficients of its middle where they vary."""
    end = output_angle + output_speed * dt
    count = 1
    pieces = PIECES  # of all inner steps together
    if s.effects > 1.0 and dt > INNER_STEP:
        if not 2.0 * dt <= INNER_STEP * PIECES:  # each takes two at least
            bad = State(s.angle, math.nan, s.effects, s.time + dt, s.heat, s.distance)
            return bad, _affected_outputs(p, t, bad, motor_torque, end, output_speed), known
        count = math.ceil(dt / INNER_STEP - 1e-9)
    step = dt / count
    state = s
    for i in range(count if dt > 0.0 else 0):
        now = output_angle + output_speed * (step * i)
        fine, after = 0.0, state
        if state.speed != 0.0:
            fine, after, known = _glided(p, t, state, motor_torque, now, output_speed, step, known)
        if fine > 0.0:
            pieces -= 2
        else:
            after, pieces = _travelled(p, t, state, motor_torque, now, output_speed, step, pieces)
        state = after
        if state.speed != state.speed:
            break
    return state, _affected_outputs(p, t, state, motor_torque, end, output_speed), known


def _glided(p, t, s, motor_torque, output_angle, output_speed, dt, known):
    """An inner step of plain sliding, the usual one: 1.0 and the state after it; 0.0 where there may be an event."""
    ratio = p.gear_ratio
    windup = s.angle / ratio - output_angle
    law = _sliding_law(p, t, s, output_angle, output_speed)
    loss = 0.0
    if s.effects > 1.0:
        half = 0.5 * dt
        fine, wound, speed, _, _ = _glide(p, law, windup, s.speed, motor_torque, output_speed, half, NONE)
        if fine == 0.0:
            return 0.0, s, known
        moved = ratio * (wound + output_speed * half)
        then = output_angle + output_speed * half
        middle = State(s.angle + moved, speed, s.effects, s.time + half, s.heat, s.distance + abs(moved))
        if p.heat_coefficient != 0.0:
            loss = _lost(p, law, t, s, motor_torque, output_angle, output_speed)
            middle = _heated(p, middle, loss, half)
        law = _sliding_law(p, t, middle, then, output_speed)
        if p.heat_coefficient != 0.0:
            loss = _lost(p, law, t, middle, motor_torque, then, output_speed)
    fine, wound, speed, _, known = _glide(p, law, windup, s.speed, motor_torque, output_speed, dt, known)
    moved = ratio * (wound + output_speed * dt)
    after = State(s.angle + moved, speed, s.effects, s.time + dt, s.heat, s.distance + abs(moved))
    return fine, _heated(p, after, loss, dt), known


def _lost(p, law, t, s, motor_torque, output_angle, output_speed):
    """What a sliding shaft loses, W."""
    return _sliding_outputs(law, p.shaft_damping, t, p.gear_ratio, s, motor_torque, output_angle, output_speed).loss_power


def _glide(p, law, windup, speed, motor_torque, output_speed, dt, known):
    f, push = law.friction, motor_torque - law.torque
    return glide(
        f.driving, f.backdriving, f.level, f.drag, f.viscous, law.stiffness, p.shaft_damping, law.half_play,
        p.gear_ratio, p.shaft_inertia, windup, speed, push, output_speed, dt, known,
    )  # fmt: skip


def _travelled(p, t, s, motor_torque, output_angle, output_speed, dt, pieces):
    """An inner step with whatever happens in it: the state after it, and the pieces left."""
    ratio, inertia = p.gear_ratio, p.shaft_inertia
    law = _affected_law(p, t, s, output_angle, output_speed)
    half = 0.5 * dt
    loss = 0.0
    if s.effects > 1.0:
        angle, speed, went, pieces = travel(
            law, ratio, inertia, s.angle, s.speed, motor_torque, output_angle, output_speed, half, pieces
        )
        middle = State(angle, speed, s.effects, s.time + half, s.heat, s.distance + went)
        if p.heat_coefficient != 0.0:
            loss = _outputs(law, t, ratio, s, motor_torque, output_angle, output_speed).loss_power
            middle = _heated(p, middle, loss, half)
        if speed != 0.0 or s.speed != 0.0:
            then = output_angle + output_speed * half
            law = _affected_law(p, t, middle, then, output_speed)
            if p.heat_coefficient != 0.0:
                loss = _outputs(law, t, ratio, middle, motor_torque, then, output_speed).loss_power
    angle, speed, went, pieces = travel(
        law, ratio, inertia, s.angle, s.speed, motor_torque, output_angle, output_speed, dt, pieces
    )
    return _heated(p, State(angle, speed, s.effects, s.time + dt, s.heat, s.distance + went), loss, dt), pieces


def _affected_law(p, t, state, output_angle, output_speed):
    """The law with its effects in this state."""
    x = Condition(1.0, state.speed, state.angle, output_angle, 0.0, state.time, state.heat, state.distance)
    return extended(p, t, x, state.speed / p.gear_ratio - output_speed)


def _sliding_law(p, t, state, output_angle, output_speed):
    """What of it counts in a state of sliding."""
    way = 1.0 if state.speed > 0.0 else -1.0
    x = Condition(way, state.speed, state.angle, output_angle, 0.0, state.time, state.heat, state.distance)
    return sliding(p, t, x, state.speed / p.gear_ratio - output_speed)


def _heated(p, state, loss, dt):
    """The state with the heat H, J, of dH/dt = loss - H / T solved over dt, s; kept up only where something asks for it."""
    if p.heat_coefficient == 0.0:
        return state
    left = math.exp(-dt / p.cooling_time)
    heat = state.heat * left + loss * p.cooling_time * (1.0 - left)
    return State(state.angle, state.speed, state.effects, state.time, heat, state.distance)


def _affected_outputs(p, t, state, motor_torque, output_angle, output_speed):
    """Outputs of a state with the effects as they are in it; motor torque as in `_outputs`."""
    if state.speed == 0.0:
        law = _affected_law(p, t, state, output_angle, output_speed)
        return _outputs(law, t, p.gear_ratio, state, motor_torque, output_angle, output_speed)
    law = _sliding_law(p, t, state, output_angle, output_speed)
    return _sliding_outputs(law, p.shaft_damping, t, p.gear_ratio, state, motor_torque, output_angle, output_speed)


def _outputs(law, t, ratio, state, motor_torque, output_angle, output_speed):
    """Outputs of a state; motor torque NaN stands for kinematic mode, where F at rest is the least admissible."""
    if state.speed != 0.0:
        slip = Slip(law.forward if state.speed > 0.0 else law.backward, law.stiffness, law.half_play, law.torque)
        return _sliding_outputs(slip, law.damping, t, ratio, state, motor_torque, output_angle, output_speed)
    windup = state.angle / ratio - output_angle
    output_torque, edge, touching = contact(law.stiffness, law.damping, law.half_play, windup, -output_speed)
    stuck = 0.0
    low, high = held(law, ratio, output_torque)
    if math.isnan(motor_torque):
        force = least_torque(low + law.torque, high + law.torque) - law.torque
        stuck = 1.0
    else:
        force = motor_torque - law.torque
        if low <= force <= high:
            stuck = 1.0
        elif force > high:
            force = friction_at(law.forward, output_torque, 1.0, 0.0, ratio)
        else:
            force = friction_at(law.backward, output_torque, -1.0, 0.0, ratio)
    damped = _damped(law.stiffness, law.damping, touching, edge, windup, -output_speed)
    return _told(t, ratio, state, motor_torque, output_speed, output_torque, force, force, stuck, law.torque, damped)


def _sliding_outputs(slip, damping, t, ratio, state, motor_torque, output_angle, output_speed):
    """Outputs of a state of sliding."""
    speed = state.speed
    way = 1.0 if speed > 0.0 else -1.0
    windup = state.angle / ratio - output_angle
    v = speed / ratio - output_speed
    output_torque, edge, touching = contact(slip.stiffness, damping, slip.half_play, windup, v)
    force = friction_at(slip.friction, output_torque, way, speed, ratio)
    in_wedge = force - way * (slip.friction.drag + slip.friction.viscous * abs(speed))
    damped = _damped(slip.stiffness, damping, touching, edge, windup, v)
    return _told(t, ratio, state, motor_torque, output_speed, output_torque, force, in_wedge, 0.0, slip.torque, damped)


def _damped(stiffness, damping, touching, edge, windup, v):
    """What the output shaft's damper takes, W."""
    if touching > 0.0:
        return damping * v * v
    if edge * windup > edge * edge:  # parted while the shaft's spring still relaxes
        return -stiffness * (windup - edge) * v
    return 0.0


def _told(t, ratio, state, motor_torque, output_speed, output_torque, force, in_wedge, stuck, beside, damped):
    """All outputs; force and in_wedge: of the friction law with what stands beside the wedge and without, N.m; beside it a torque, N.m."""
    friction = force - output_torque / ratio
    return Output(
        force + beside,
        output_torque,
        friction,
        state.angle,
        state.speed,
        motor_torque,
        normal_force(in_wedge, output_torque / (ratio * t), t),
        stuck,
        (force + beside) * state.speed,
        output_torque * output_speed,
        friction * state.speed + max(damped, 0.0),
    )
