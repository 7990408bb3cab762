"""The input shaft from event to event: stick, forward and backward slip under coefficients that stand still.

With theta = angle / r - output angle (the wind-up of the output shaft) and v its rate, sliding in direction s obeys

    J r v' = M - F(P, s),   P = k (theta - edge) + c v,   output angle moving on with its speed

F being one of three lines in P (law.py). Each piece is solved by flow.py; it ends at the first of: stop of the shaft,
change of the line, touch or parting of the flanks (backlash). At rest P moves linearly, so breakaway is a division.
"""

import math

from .flow import NONE, ULP, first_fall, reach, response, whole
from .law import contact, friction_at

PIECES = 1000  # of one step, at most, with all its inner steps; a step that needs more has no result (NaN)
ROUNDS = 16  # of looking for an event's instant that count as a piece more
STALLED = 50  # events without progress of time: the shaft is held for a hundredth of the step, twice that the next time


def glide(
    driving,
    backdriving,
    level,
    drag,
    viscous,
    stiffness,
    damping,
    half_play,
    ratio,
    inertia,
    windup,
    speed,
    push,
    output_speed,
    dt,
    known=NONE,
):
    """A step of plain sliding, without an event: 1.0, the change of the wind-up, rad, speed, rad/s, and output torque, N.m, after it.

    0.0 in the place of 1.0, and nothing told, where there may be an event: `travel` then looks for it. known: the response of a step
    before, which comes last of what is returned, for the next: under the same law steps as long have the same.
    """
    s = 1.0 if speed > 0.0 else -1.0
    v = speed / ratio - output_speed
    output_torque, edge, touching = contact(stiffness, damping, half_play, windup, v)
    k, c = stiffness * touching, damping * touching
    x = output_torque * s
    line, slope = 0.0, 1.0 / ratio
    force = x * slope + level
    spare = min(force - x * driving, force - x * backdriving)  # to the next line
    if x * driving > force or (level == 0.0 and x > 0.0):
        line, slope, spare = 1.0, driving, max(x * driving - force, 0.0)
        force = x * driving
    elif x * backdriving > force or (level == 0.0 and x < 0.0):
        line, slope, spare = -1.0, backdriving, max(x * backdriving - force, 0.0)
        force = x * backdriving
    elif level == 0.0 and touching > 0.0:
        return 0.0, 0.0, 0.0, 0.0, known
    per_inertia = 1.0 / (inertia * ratio)
    a = (push - s * (force + drag + viscous * abs(speed))) * per_inertia
    delta = 0.5 * (slope * c * per_inertia + viscous / inertia)
    w = slope * k * per_inertia
    z = (delta * delta - w) * dt * dt
    if not -9.0 < z < 900.0:
        return 0.0, 0.0, 0.0, 0.0, known
    before, beside, long, shape, slant, area = known
    if delta != before or w != beside or dt != long:
        shape, slant, area = response(delta, w, dt)
        known = (delta, w, dt, shape, slant, area)
    wound = v * (shape + 2.0 * delta * area) + a * area
    v1 = v * (slant + 2.0 * delta * shape) + a * shape
    a1 = a * slant - w * v * shape
    speed1 = (v1 + output_speed) * ratio
    # Speed and torque may have an extremum in between: it matters where it may lie beyond an event. In a step
    # short against the time constants, a rate stays within twice the sum of its values at both ends.
    short = 2.0 * dt if -2.0 < z < 1.0 and abs(delta) * dt < 0.5 else math.inf
    if not (s * speed1 > 0.0 and (s * a >= 0.0 or s * a1 < 0.0 or short * (abs(a) + abs(a1)) * ratio < s * speed)):
        return 0.0, 0.0, 0.0, 0.0, known
    if touching == 0.0:  # the flanks apart, and so at the end
        near = v * v1 > 0.0 and abs(windup) < half_play and abs(windup + wound) < half_play
        return 1.0 if near else 0.0, wound, speed1, 0.0, known
    torque1 = k * (windup - edge + wound) + c * v1
    x1 = torque1 * s
    level_force = x1 / ratio + level
    if line > 0.0:  # without a preload a line ends at P = 0; of a gear without friction all are one, but for their last bits
        same = x1 > 0.0 and (level == 0.0 or x1 * driving >= level_force)
    elif line < 0.0:
        same = x1 < 0.0 and (level == 0.0 or x1 * backdriving >= level_force)
    else:
        same = level_force >= x1 * driving and level_force >= x1 * backdriving
    rate, rate1 = k * v + c * a, k * v1 + c * a1
    swing = short * (abs(rate) + abs(rate1))
    steady = rate * rate1 > 0.0 or swing * (driving - backdriving) <= spare
    if half_play > 0.0:  # nor do the flanks part, by their torque or by their place
        calm = v * v1 > 0.0 or short * (abs(v) + abs(v1)) <= abs(windup) - half_play
        same = same and calm and torque1 * output_torque > 0.0 and (windup + wound) * edge > edge * edge
        steady = steady and (rate * rate1 > 0.0 or swing <= abs(output_torque))
    return 1.0 if same and steady else 0.0, wound, speed1, torque1, known


def travel(law, ratio, inertia, angle, speed, motor_torque, output_angle, output_speed, dt, pieces=PIECES):
    """The input shaft after dt, s: its angle, rad, its speed, rad/s, the distance it travelled, rad, and the pieces left.

    Of `pieces`, which are those that may be made; where they do not last, and wherever the speed is no number, none are left.

    motor_torque, N.m, is held; output_angle, rad, is at the start of the step and moves on with output_speed, rad/s.
    """
    windup = angle / ratio - output_angle
    push = motor_torque - law.torque
    turned = distance = time = 0.0
    hold = 0.01 * dt
    least = 1e-9 * dt  # what an event takes at least; more where the motion in it is lost in rounding
    stalled = 0
    while pieces > 0:
        left = dt - time
        if left <= ULP * dt:
            break
        pieces -= 1
        if speed == 0.0:
            rest, s = _rest(law, ratio, windup, -output_speed, push, left)
            if stalled > STALLED:
                rest, s, stalled = min(left, hold), 0.0, 0
                hold *= 2.0
            windup -= output_speed * rest
            time += rest
            if s == 0.0:
                continue
            left = dt - time
        else:
            s = 1.0 if speed > 0.0 else -1.0
        before = speed
        taken, wound, speed, rounds = _slide(law, ratio, inertia, s, windup, speed, push, output_speed, left, least)
        pieces -= rounds // ROUNDS
        moved = ratio * (wound + output_speed * taken)
        same = taken < left and speed == before != 0.0  # a torque that is rounding alone goes from one line to the next and back
        lost = taken < 1e-9 * dt or windup + wound == windup or same
        windup += wound
        turned += moved
        distance += abs(moved)
        time += taken
        stalled = stalled + 1 if lost else 0
        least = 2.0 * least if lost else 1e-9 * dt
    if dt - time > ULP * dt or speed != speed:
        return angle + turned, math.nan, distance, 0
    return angle + turned, speed, distance, pieces


def held(law, ratio, output_torque):
    """Least and greatest torque, N.m, under which the shaft rests at this output torque, N.m: its cone."""
    low = friction_at(law.hold_backward, output_torque, -1.0, 0.0, ratio)
    return low, friction_at(law.hold_forward, output_torque, 1.0, 0.0, ratio)


def _rest(law, ratio, windup, rate, push, left):
    """How long the shaft rests, s, and where it goes then: +1.0, -1.0; 0.0 where it rests to the end or looks again."""
    output_torque, edge, touching = contact(law.stiffness, law.damping, law.half_play, windup, rate)
    low, high = held(law, ratio, output_torque)
    if push > high:
        return 0.0, 1.0
    if push < low:
        return 0.0, -1.0
    if rate == 0.0:
        return left, 0.0
    change = law.stiffness * rate * touching  # of the output torque, N.m/s
    forward = _breakaway(law.hold_forward, ratio, push, output_torque, change)
    backward = _breakaway(law.hold_backward, ratio, -push, -output_torque, -change)
    look = left  # the flanks part or touch
    if law.half_play > 0.0:
        if touching > 0.0:
            look = -output_torque / change
        else:
            look = ((law.half_play if rate > 0.0 else -law.half_play) - windup) / rate
        if not 0.0 <= look:
            look = left
        bits = 4.0 * ULP * abs(windup) / abs(rate)  # in less the wind-up does not move
        look = look * (1.0 + 1e-12) + 1e-15 + bits
    rest = min(look, left, forward, backward)
    if rest == forward:
        return rest, 1.0
    return rest, -1.0 if rest == backward else 0.0


def _breakaway(friction, ratio, push, x, change):
    """Time until push > drag + max(x driving, x backdriving, x / r + level), x moving by change, N.m/s.

    All three lines must be overcome at once; each is on one side of one instant.
    """
    begin, end = 0.0, math.inf
    for line in range(3):
        if line == 0:
            slope, level = friction.driving, 0.0
        elif line == 1:
            slope, level = friction.backdriving, 0.0
        else:
            slope, level = 1.0 / ratio, friction.level
        surplus = push - friction.drag - level - slope * x
        rise = -slope * change
        if surplus > 0.0:
            if rise < 0.0:
                end = min(end, -surplus / rise)
        elif rise > 0.0:
            begin = max(begin, -surplus / rise)
        else:
            return math.inf
    return begin if begin < end else math.inf


def _slide(law, ratio, inertia, s, windup, speed, push, output_speed, left, least):
    """One piece of sliding in direction s: the time it takes, s, the change of the wind-up, rad, the speed after it, rad/s.

    And how many rounds were made to find what ends it.
    """
    friction = law.forward if s > 0.0 else law.backward
    v = speed / ratio - output_speed
    output_torque, edge, touching = contact(law.stiffness, law.damping, law.half_play, windup, v)
    k, c = law.stiffness * touching, law.damping * touching
    per_inertia = 1.0 / (inertia * ratio)
    a = (push - friction_at(friction, output_torque, s, speed, ratio)) * per_inertia
    if speed == 0.0:
        a = s * max(s * a, 0.0)

    # The line of F that is valid here, and the bounds of x = P s between which it is.
    x = output_torque * s
    gap_high = friction.driving - 1.0 / ratio
    gap_low = 1.0 / ratio - friction.backdriving
    x_high = friction.level / gap_high if gap_high > 0.0 else math.inf
    x_low = -friction.level / gap_low if gap_low > 0.0 else -math.inf
    trend = s * (k * v + c * a)
    if trend == 0.0:
        trend = s * a
    if x > x_high or (x == x_high and trend >= 0.0):
        slope, lower, upper = friction.driving, x_high, math.inf
    elif x < x_low or (x == x_low and trend < 0.0):
        slope, lower, upper = friction.backdriving, -math.inf, x_low
    else:
        slope, lower, upper = 1.0 / ratio, x_low, x_high

    delta = 0.5 * (slope * c * per_inertia + friction.viscous / inertia)
    w = slope * k * per_inertia
    tau = whole(delta, w, left)
    quiet = False
    if tau < left and touching > 0.0:  # a stiff shaft in a long step: it may never come near an event
        offset = (a + 2.0 * delta * v) / w if w > 0.0 else math.inf  # of the wind-up from where it settles
        swing = k * reach(delta, w, -offset, v) + c * reach(delta, w, v, a)
        centre = x + s * (k * offset - c * v)
        flank = 0.0 if law.half_play > 0.0 and s * edge > 0.0 else -math.inf
        ceiling = 0.0 if law.half_play > 0.0 and s * edge < 0.0 else math.inf
        inside = max(lower, flank) < centre - swing and centre + swing < min(upper, ceiling)
        quiet = inside and reach(delta, w, v, a) < s * output_speed
        if quiet:
            tau = left
    shape, slant, area = response(delta, w, tau)
    wound = v * (shape + 2.0 * delta * area) + a * area
    v1 = v * (slant + 2.0 * delta * shape) + a * shape
    a1 = a * slant - w * v * shape

    if quiet:
        return tau, wound, (v1 + output_speed) * ratio, 0

    # Events, in terms of the change of the wind-up: which is first?
    stop, rounds = first_fall(s * output_speed, 0.0, s, 0.0, v, a, wound, v1, a1, delta, w, tau)
    other, first, second = math.inf, 0, 0
    if touching > 0.0:
        if lower > -math.inf:
            other, first = first_fall(x - s * c * v - lower, s * k, s * c, 0.0, v, a, wound, v1, a1, delta, w, tau)
        if upper < math.inf:
            fall, second = first_fall(upper - x + s * c * v, -s * k, -s * c, 0.0, v, a, wound, v1, a1, delta, w, tau)
            other = min(other, fall)
        if law.half_play > 0.0:
            side = 1.0 if edge > 0.0 else -1.0
            strain = side * (output_torque - c * v)
            part, more = first_fall(strain, side * k, side * c, 0.0, v, a, wound, v1, a1, delta, w, tau)
            other, rounds = min(other, part), rounds + more
    else:
        side = 1.0 if edge > 0.0 else -1.0
        depth = side * windup - law.half_play  # into the flank on this side, which may yet be separated from it
        if depth > 0.0:
            fall, first = first_fall(depth, side, 0.0, 0.0, v, a, wound, v1, a1, delta, w, tau)
            spring, damper = side * law.stiffness, side * law.damping
            touch, second = first_fall(-law.stiffness * depth, -spring, -damper, 0.0, v, a, wound, v1, a1, delta, w, tau)
            other = min(fall, touch)
        else:
            near, first = first_fall(-depth, -side, 0.0, 0.0, v, a, wound, v1, a1, delta, w, tau)
            far, second = first_fall(law.half_play + side * windup, side, 0.0, 0.0, v, a, wound, v1, a1, delta, w, tau)
            other = min(near, far)
    if other < stop:
        other = min(max(other, least), tau)

    taken = min(stop, other, tau)
    if taken < tau:
        shape, slant, area = response(delta, w, taken)
        wound = v * (shape + 2.0 * delta * area) + a * area
        v1 = v * (slant + 2.0 * delta * shape) + a * shape
    speed = (v1 + output_speed) * ratio
    if stop <= taken or s * speed < 0.0:
        speed = 0.0
    return taken, wound, speed, rounds + first + second
