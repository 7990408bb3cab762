"""The vehicle's forces, compiled: ground, guide, teeth, belt, drives; and the loop that steps the space.

pymunk moves the bodies and keeps the joints; every force is a penalty evaluated here. Chipmunk moves a
body by its velocity first and changes the velocity afterwards, so forces are evaluated at the positions
that the step arrives at, x + v dt; evaluated at x they would lag a step behind and feed energy in.

All compiled code stands in this file, because numba keeps what it compiled as long as the file with the
outermost function is unchanged.

Planar values: one body stands for both sides of the robot. SI units; angles counter-clockwise positive in
the x-forward y-up plane. Bodies: 0 chassis, 1 front holder, 2 rear holder, then the front and rear segments.
"""

from __future__ import annotations

import math

import numpy as np
from numba import from_dtype, types

from ..master.addresses import arrays_of, load, load_int, place_at, store
from .munk import call_step, compiled, inlined

NAMES = """
    dt gravity sides driven belt hold_stiffness hold_damping
    ground_stiffness ground_exponent ground_damping ground_depth ground_friction
    bristle_stiffness bristle_damping ground_top level shoe foot_pitch foot_back
    guide_stiffness guide_damping guide_radius holder_length rail_height rail_ramp
    tooth_stiffness tooth_damping tooth_angle belt_radius sprocket_inertia segment_weight
    front_hinge_x rear_hinge_x hinge_y holder_center holder_weight
""".split()
CONSTANTS = np.dtype([(name, float) for name in NAMES])

_NUMBERS, _PLANE, _PLACES = (types.Array(kind, n, "C") for kind, n in ((types.float64, 1), (types.float64, 2), (types.int64, 1)))
ARRAYS = (
    *(types.Array(from_dtype(CONSTANTS), 1, "C"), _NUMBERS, _NUMBERS, _PLANE, _NUMBERS, _NUMBERS, _PLACES, _PLACES, _PLANE),
    *(_NUMBERS, _PLANE, _NUMBERS, _NUMBERS),
)
"""Types of what `advance` works on: constants, gx, gy, belly, u, state, body, at, bristle, scrape, told, zero, out."""
STEP, SPACE, INNER, MOST, LIMIT, SIZE, HEAD = range(0, 56, 8)
"""Bytes from what C is given: addresses of cpSpaceStep and the space; s of the inner step, of the longest step; m/s; s that dt is made for."""
_arrays = arrays_of(ARRAYS)
ERROR = 3  # fmi2Status

FEET = 3  # points of a segment's rounded shoe that can touch the ground, a third of the pitch apart

# what is told, one row each for front track, rear track and the chassis' underside
NORMAL, TANGENT, MOMENT, GRAVITY = range(4)
# inputs
FRONT_TORQUE, REAR_TORQUE, FRONT_SPROCKET, REAR_SPROCKET, SPROCKET_SPEED, FRONT_HOLD, REAR_HOLD = range(7)


@inlined
def damping(c_max, h, x):
    """Damping coefficient in N.s/m at penetration x, eq 24."""
    if x <= 0.0:
        return 0.0
    if x >= h:
        return c_max
    return c_max * x * x * (3.0 * h - 2.0 * x) / (h * h * h)


@inlined
def normal_force(k, e, c_max, h, x, rate):
    """Normal force in N at penetration x that grows with `rate`, eq 23: max(0, k x^e + c(x) rate).

    The rate in eq 23 is that of the distance of the surfaces, as in the multibody package the study used:
    minus the rate of the penetration, so that damping resists the motion in both directions.
    """
    if x <= 0.0:
        return 0.0
    return max(0.0, k * x**e + damping(c_max, h, x) * rate)


@compiled
def clearance(gx, gy, x, y, reach):
    """Signed distance of a point from the ground's polyline (negative inside) and the outward unit normal.

    Edges farther than `reach` along x are not looked at; without any the distance is infinite.
    """
    low, high = 0, len(gx) - 1
    while high - low > 1:  # last point left of what is reached
        middle = (low + high) // 2
        if gx[middle] < x - reach:
            low = middle
        else:
            high = middle
    best, where, vertex = math.inf, -1, False
    bx = by = 0.0
    i = low
    while i < len(gx) - 1 and gx[i] <= x + reach:
        ex, ey = gx[i + 1] - gx[i], gy[i + 1] - gy[i]
        s = ((x - gx[i]) * ex + (y - gy[i]) * ey) / (ex * ex + ey * ey)
        end = s <= 0.0 or s >= 1.0
        s = min(1.0, max(0.0, s))
        dx, dy = x - gx[i] - s * ex, y - gy[i] - s * ey
        square = dx * dx + dy * dy
        if square < best:
            best, bx, by, where, vertex = square, dx, dy, i + (1 if s >= 1.0 else 0), end
        i += 1
    if where < 0:
        return math.inf, 0.0, 1.0
    nx = ny = 0.0
    for i in range(max(0, where - 1) if vertex else where, min(where + 1, len(gx) - 1)):
        ex, ey = gx[i + 1] - gx[i], gy[i + 1] - gy[i]
        length = math.sqrt(ex * ex + ey * ey)
        nx -= ey / length
        ny += ex / length
    length = math.sqrt(nx * nx + ny * ny)
    nx, ny = nx / length, ny / length
    if not vertex:
        return bx * nx + by * ny, nx, ny
    distance = math.sqrt(best)
    if distance < 1e-12:
        return 0.0, nx, ny
    side = 1.0 if bx * nx + by * ny >= 0.0 else -1.0
    return side * distance, side * bx / distance, side * by / distance


@inlined
def friction(p, normal, slip, bristle):
    """Tangential force in N and the bristle's new deflection in m: a spring and damper with a slip limit (Coulomb)."""
    bristle += slip * p.dt
    force = -p.bristle_stiffness * bristle - p.bristle_damping * slip
    limit = p.ground_friction * normal
    if abs(force) > limit:
        force = math.copysign(limit, force)
        bristle = -force / p.bristle_stiffness
    return force, bristle


@inlined
def touch(p, gx, gy, x, y, vx, vy, bristle):
    """Ground force on a shoe at (x, y) moving with (vx, vy): fx, fy, normal, tangent, tangent's direction, new bristle."""
    if p.level > 0.0:
        distance, nx, ny = y - p.ground_top, 0.0, 1.0
    else:
        distance, nx, ny = clearance(gx, gy, x, y, p.shoe + 0.03)
    depth = p.shoe - distance
    if depth <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0
    normal = normal_force(p.ground_stiffness, p.ground_exponent, p.ground_damping, p.ground_depth, depth, -(vx * nx + vy * ny))
    tangent, bristle = friction(p, normal, vx * ny - vy * nx, bristle)
    return normal * nx + tangent * ny, normal * ny - tangent * nx, normal, tangent, ny, -nx, bristle


@compiled
def sprocket(p, state, track, u, chassis_angle, chassis_rate):
    """Angle and rate of a sprocket in the plane where the step arrives."""
    if p.driven > 0.0:
        return state[track] + state[2 + track] * p.dt, state[2 + track]
    rate = u[SPROCKET_SPEED] + chassis_rate
    return state[track] + u[SPROCKET_SPEED] * p.dt + chassis_angle, rate


@compiled
def turn_sprocket(p, state, track, u, torque):
    """Moves a sprocket on and returns the torque that its drive puts on the chassis; `torque`: from the track, N.m."""
    if p.driven > 0.0:
        drive = p.sides * u[FRONT_SPROCKET + track]
        state[track] += state[2 + track] * p.dt
        state[2 + track] += (torque + drive) / p.sprocket_inertia * p.dt
        return -drive
    state[track] += u[SPROCKET_SPEED] * p.dt
    state[2 + track] = u[SPROCKET_SPEED]
    return torque


@inlined
def rail(p, along):
    """How far the rail between hinge and idler stands out beyond the arcs, and its slope: a crown with smooth ends."""
    end = min(along, p.holder_length - along)
    if end <= 0.0:
        return 0.0, 0.0
    if end >= p.rail_ramp:
        return p.rail_height, 0.0
    s = end / p.rail_ramp
    slope = p.rail_height * 6.0 * s * (1.0 - s) / p.rail_ramp
    return p.rail_height * s * s * (3.0 - 2.0 * s), slope if end == along else -slope


@compiled
def track_forces(p, gx, gy, track, hx, hy, hvx, hvy, c, s, w, angle, rate, body, at, bristle, told):
    """Forces of a segmented track. Written to the segments; what the holder gets is returned.

    (hx, hy) hinge, (hvx, hvy) its velocity, (c, s) the holder's direction, w its rate; angle and rate of the
    sprocket. Returns force and moment about the hinge on the holder, torque on the sprocket.
    """
    position, velocity, force = at[0], at[1], at[2]
    radius, length, guide_k, guide_c = p.guide_radius, p.holder_length, p.guide_stiffness, p.guide_damping
    n = bristle.shape[1] // FEET
    fx = fy = moment = turning = 0.0
    normal_sum = tangent_sum = pressure = gravity = 0.0
    top = p.ground_top + p.shoe
    for i in range(n):
        place = body[3 + track * n + i]
        vx, vy = load(place + velocity), load(place + velocity + 8)
        x, y = load(place + position) + vx * p.dt, load(place + position + 8) + vy * p.dt
        rx, ry = x - hx, y - hy
        along, across = rx * c + ry * s, ry * c - rx * s
        gravity += rx
        sx = sy = 0.0

        # the guide: a stadium about the line from hinge to idler with crowned rails, pushing outwards only
        if 0.0 < along < length:
            out, slope = rail(p, along)
            tilt = 1.0 / math.sqrt(1.0 + slope * slope) if slope != 0.0 else 1.0
            distance = abs(across)
            qx, qy = -slope * tilt, math.copysign(tilt, across)
            depth = (radius + out - distance) * tilt
        else:
            qx, qy = along - (length if along > 0.0 else 0.0), across
            distance = math.sqrt(qx * qx + qy * qy)
            qx /= distance
            qy /= distance
            depth = radius - distance
        ox, oy = qx * c - qy * s, qx * s + qy * c
        wx, wy = vx - hvx + w * ry, vy - hvy - w * rx  # velocity relative to the holder
        if depth > 0.0:
            push = guide_k * depth - guide_c * (wx * ox + wy * oy)
            if push > 0.0:
                sx += push * ox
                sy += push * oy
                moment -= push * (rx * oy - ry * ox)

        # the teeth: the nearest one holds the segment by a spring along the pitch circle
        if along < 0.0:
            grip = min(1.0, -2.0 * along / radius)
            grip = grip * grip * (3.0 - 2.0 * grip)
            gap = math.atan2(ry, rx) - angle
            gap -= p.tooth_angle * math.floor(gap / p.tooth_angle + 0.5)
            slip = (vy - hvy) * ox - (vx - hvx) * oy - rate * distance
            pull = -grip * (p.tooth_stiffness * distance * gap + p.tooth_damping * slip)
            sx -= pull * oy
            sy += pull * ox
            turning -= pull * distance
        fx -= sx
        fy -= sy

        if y < top + p.foot_pitch:  # the feet of a shoe stand on a circle about the sprocket's axis, so that it rolls
            spin = load(place + at[4])
            turn = load(place + at[3]) + spin * p.dt
            ux, uy = math.cos(turn), math.sin(turn)
            twist = 0.0
            for k in range(FEET):
                step = (k - 1) * p.foot_pitch
                back = (k - 1) * (k - 1) * p.foot_back
                dx, dy = step * ux - back * uy, step * uy + back * ux
                if y + dy >= top:
                    bristle[track, FEET * i + k] = 0.0
                    continue
                gfx, gfy, normal, tangent, tx, ty, b = touch(
                    p, gx, gy, x + dx, y + dy, vx - spin * dy, vy + spin * dx, bristle[track, FEET * i + k]
                )
                bristle[track, FEET * i + k] = b
                sx += gfx
                sy += gfy
                twist += dx * gfy - dy * gfx
                normal_sum += normal
                tangent_sum += tangent
                pressure += normal * ((rx + dx) * tx + (ry + dy) * ty)
            store(place + at[5], twist)
        else:
            for k in range(FEET):
                bristle[track, FEET * i + k] = 0.0
        store(place + force, sx)
        store(place + force + 8, sy)
    told[track, NORMAL], told[track, TANGENT], told[track, MOMENT] = normal_sum, tangent_sum, pressure
    told[track, GRAVITY] = gravity * p.segment_weight
    return fx, fy, moment, turning


@compiled
def outline(p, place):
    """Point of the belt's outline at arc length `place` from under the hinge, counter-clockwise, and the direction there."""
    length, radius = p.holder_length, p.guide_radius
    half = math.pi * radius
    if place < length:
        out, slope = rail(p, place)
        tilt = 1.0 / math.sqrt(1.0 + slope * slope)
        return place, -radius - out, tilt, -slope * tilt
    if place < length + half:
        a = (place - length) / radius
        return length + radius * math.sin(a), -radius * math.cos(a), math.cos(a), math.sin(a)
    if place < 2.0 * length + half:
        along = 2.0 * length + half - place
        out, slope = rail(p, along)
        tilt = 1.0 / math.sqrt(1.0 + slope * slope)
        return along, radius + out, -tilt, -slope * tilt
    a = (place - 2.0 * length - half) / radius
    return -radius * math.sin(a), radius * math.cos(a), -math.cos(a), -math.sin(a)


@compiled
def belt_forces(p, gx, gy, track, hx, hy, hvx, hvy, c, s, w, angle, rate, holder_angle, bristle, told):
    """Forces of a belt without inertia of its own shape: points that slide along the outline carry the contact.

    A point's velocity is that of the holder there plus the belt's along its direction, so by virtual power a
    ground force acts on the holder where it stands, its part along the belt turns the sprocket, and the
    holder is relieved of that torque. Returns as `track_forces`.
    """
    radius, length = p.guide_radius, p.holder_length
    n = bristle.shape[1]
    perimeter = 2.0 * (length + math.pi * radius)
    travel = p.belt_radius * (angle - holder_angle)
    speed = p.belt_radius * (rate - w)
    fx = fy = moment = turning = 0.0
    normal_sum = tangent_sum = pressure = 0.0
    half = math.pi * radius
    # pieces of the outline that cannot reach the ground are passed over: run below, tip, run above, hinge
    reach = p.ground_top + p.shoe - hy
    below = min(0.0, s * length) - p.rail_height
    low0, low1 = below - radius * c < reach, s * length - radius < reach
    low2, low3 = below + radius * c < reach, -radius < reach
    place = travel - perimeter * math.floor(travel / perimeter)
    for i in range(n):
        if i > 0:
            place += perimeter / n
        if place >= perimeter:
            place -= perimeter
        if place < length + half:
            near = low0 if place < length else low1
        else:
            near = low2 if place < 2.0 * length + half else low3
        if not near:
            bristle[track, i] = 0.0
            continue
        along, across, ux, uy = outline(p, place)
        rx, ry = along * c - across * s, along * s + across * c
        if ry >= reach:
            bristle[track, i] = 0.0
            continue
        dx, dy = ux * c - uy * s, ux * s + uy * c
        vx, vy = hvx - w * ry + speed * dx, hvy + w * rx + speed * dy
        gfx, gfy, normal, tangent, tx, ty, b = touch(p, gx, gy, hx + rx, hy + ry, vx, vy, bristle[track, i])
        bristle[track, i] = b
        pull = p.belt_radius * (gfx * dx + gfy * dy)
        fx += gfx
        fy += gfy
        moment += rx * gfy - ry * gfx - pull
        turning += pull
        normal_sum += normal
        tangent_sum += tangent
        pressure += normal * (rx * tx + ry * ty)
    told[track, NORMAL], told[track, TANGENT], told[track, MOMENT] = normal_sum, tangent_sum, pressure
    told[track, GRAVITY] = 0.0
    return fx, fy, moment, turning


@compiled
def forces(p, gx, gy, belly, u, state, body, at, bristle, scrape, told):
    """All forces on all bodies at the positions where the next step of the space arrives."""
    position, velocity, force, turn, spin, torque = at[0], at[1], at[2], at[3], at[4], at[5]
    dt = p.dt
    place = body[0]
    cvx, cvy, cw = load(place + velocity), load(place + velocity + 8), load(place + spin)
    cx, cy = load(place + position) + cvx * dt, load(place + position + 8) + cvy * dt
    ca = load(place + turn) + cw * dt
    chassis_torque = chassis_fx = chassis_fy = 0.0

    for track in range(2):
        place = body[1 + track]
        w = load(place + spin)
        angle = load(place + turn) + w * dt
        c, s = math.cos(angle), math.sin(angle)
        ox, oy = p.holder_center * c, p.holder_center * s  # from the hinge to the centre of mass
        hx, hy = load(place + position) - ox, load(place + position + 8) - oy
        hvx, hvy = load(place + velocity) + w * oy, load(place + velocity + 8) - w * ox
        hx += load(place + velocity) * dt
        hy += load(place + velocity + 8) * dt
        wheel, rate = sprocket(p, state, track, u, ca, cw)
        if p.belt > 0.0:
            fx, fy, moment, turning = belt_forces(p, gx, gy, track, hx, hy, hvx, hvy, c, s, w, wheel, rate, angle, bristle, told)
        else:
            fx, fy, moment, turning = track_forces(
                p, gx, gy, track, hx, hy, hvx, hvy, c, s, w, wheel, rate, body, at, bristle, told
            )
        told[track, GRAVITY] += p.holder_weight * ox
        chassis_torque += turn_sprocket(p, state, track, u, turning)
        drive = p.sides * u[FRONT_TORQUE + track]
        if p.hold_stiffness > 0.0:
            drive += p.hold_stiffness * (u[FRONT_HOLD + track] - angle + ca) - p.hold_damping * (w - cw)
        chassis_torque -= drive
        store(place + force, fx)
        store(place + force + 8, fy)
        store(place + torque, moment + drive - ox * fy + oy * fx)

    normal_sum = tangent_sum = 0.0
    c, s = math.cos(ca), math.sin(ca)
    for i in range(len(scrape)):
        rx, ry = belly[i, 0] * c - belly[i, 1] * s, belly[i, 0] * s + belly[i, 1] * c
        if cy + ry >= p.ground_top + p.shoe:
            scrape[i] = 0.0
            continue
        vx, vy = cvx - cw * ry, cvy + cw * rx
        gfx, gfy, normal, tangent, tx, ty, b = touch(p, gx, gy, cx + rx, cy + ry, vx, vy, scrape[i])
        scrape[i] = b
        chassis_fx += gfx
        chassis_fy += gfy
        chassis_torque += rx * gfy - ry * gfx
        normal_sum += normal
        tangent_sum += tangent
    told[2, NORMAL], told[2, TANGENT] = normal_sum, tangent_sum
    store(body[0] + force, chassis_fx)
    store(body[0] + force + 8, chassis_fy)
    store(body[0] + torque, chassis_torque)


@compiled
def sound(body, at, limit):
    """Whether every body's position and speed are finite and the speeds below the limit in m/s."""
    for place in body:
        for k in range(2):
            if not abs(load(place + at[1] + 8 * k)) < limit or not abs(load(place + at[0] + 8 * k)) < 1e6:
                return False
    return True


@compiled
def outputs(constants, state, zero, body, at, told, out):
    """The outputs, in the order of tables.OUTPUTS; `zero`: the sprockets' angles at the start."""
    p = constants[0]
    position, velocity, turn, spin = at[0], at[1], at[3], at[4]
    place = body[0]
    angle, rate = load(place + turn), load(place + spin)
    for track in range(2):
        holder = body[1 + track]
        out[2 * track] = load(holder + turn) - angle
        out[2 * track + 1] = load(holder + spin) - rate
        relative = p.driven > 0.0
        out[4 + 2 * track] = state[track] - zero[track] - (angle if relative else 0.0)
        out[5 + 2 * track] = state[2 + track] - (rate if relative else 0.0)
        normal = told[track, NORMAL]
        out[14 + track] = told[track, MOMENT] / normal if normal > 0.0 else 0.0
        out[16 + track] = normal
        out[18 + track] = told[track, TANGENT]
        out[20 + track] = told[track, GRAVITY] / p.sides
    c, s = math.cos(angle), math.sin(angle)
    mx, my = 0.5 * (p.front_hinge_x + p.rear_hinge_x), p.hinge_y
    rx, ry = mx * c - my * s, mx * s + my * c
    out[8], out[9], out[10] = load(place + position) + rx, load(place + position + 8) + ry, angle
    out[11], out[12], out[13] = load(place + velocity) - rate * ry, load(place + velocity + 8) + rate * rx, rate
    out[22] = told[2, NORMAL]


@compiled
def advance(steps, step, space, limit, constants, gx, gy, belly, u, state, body, at, bristle, scrape, told, zero, out):
    """`steps` inner steps, forces into the bodies and then cpSpaceStep at address `step` on `space`; then the outputs.

    Returns whether all went well: finite inputs, and every body's position and speed sound at the end.
    """
    for value in u:
        if not math.isfinite(value):
            return False
    p = constants[0]
    for _ in range(steps):
        forces(p, gx, gy, belly, u, state, body, at, bristle, scrape, told)
        call_step(step, space, p.dt)
    outputs(constants, state, zero, body, at, told, out)
    return sound(body, at, limit)


@compiled
def only_forces(constants, gx, gy, belly, u, state, body, at, bristle, scrape, told, zero, out):
    """The forces of one inner step, for whoever steps the space himself."""
    forces(constants[0], gx, gy, belly, u, state, body, at, bristle, scrape, told)


# As C calls it, for the master's compiled loop (master/native.py); `it`: the address of a head, and behind it where the arrays are.


@compiled
def set_inputs(it, references, count, values):
    """As fmi2SetReal, by places in `u`."""
    u = _arrays(it + HEAD)[4]
    for k in range(count):
        u[load_int(references + 4 * k)] = load(values + 8 * k)
    return 0


@compiled
def get_outputs(it, references, count, values):
    """As fmi2GetReal, by places in `out`."""
    out = _arrays(it + HEAD)[12]
    for k in range(count):
        store(values + 8 * k, out[load_int(references + 4 * k)])
    return 0


@compiled
def do_step(it, time, size, free):
    """As fmi2DoStep, and as model.Model.advance."""
    if not size <= load(it + MOST):
        return ERROR
    arrays = _arrays(it + HEAD)
    steps = max(1, math.ceil(size / load(it + INNER) - 1e-9))
    if size != load(it + SIZE):
        arrays[0][0].dt = size / steps
        store(it + SIZE, size)
    return 0 if advance(steps, place_at(it + STEP), place_at(it + SPACE), load(it + LIMIT), *arrays) else ERROR
