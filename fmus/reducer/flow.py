"""The motion between events: theta'' + 2 delta theta' + w theta = const, solved in closed form.

theta [rad] is the wind-up of the output shaft, v = theta' [rad/s], a = v' [rad/s^2]. Both v and a obey the same
equation without the constant, so nothing is ever divided by w, which passes through zero at the self-locking limit
and is negative beyond it (the jam: one pole in the right half plane). With S(tau) the solution with S = 0, S' = 1 at
tau = 0, and Q its integral,

    theta(tau) = theta + v (S + 2 delta Q) + a Q
    v(tau)     = v (S' + 2 delta S) + a S
    a(tau)     = a S' - w v S
"""

import math

SMALL = 1e-5  # |(delta^2 - w) tau^2| below which both poles are taken as one, with two terms of the rest
ULP = 2.220446049250313e-16


NONE = (math.nan, math.nan, math.nan, 0.0, 0.0, 0.0)  # delta, w, tau and their response where none is known


def response(delta, w, tau):
    """S, S' and Q at tau, each to a few units of the last place: delta [1/s], w [1/s^2], tau [s]."""
    d = delta * tau
    z = d * d - w * tau * tau
    if z < -SMALL:  # oscillating
        b = math.sqrt(-z)
        e = math.exp(-d)
        e1 = e - 1.0 if d > 0.5 else math.expm1(-d)
        half = math.sin(0.5 * b)
        sine = math.sin(b)
        s = e * sine * tau / b
        drop = 2.0 * half * half * e  # e (1 - cos b)
        return s, e - drop - delta * s, (drop - e1 - delta * s) / w
    if z > SMALL:  # two real poles; their product is w
        b = math.sqrt(z)
        if d >= 0.0:
            p2 = -(d + b)
            p1 = w * tau * tau / p2
        else:
            p1 = b - d
            p2 = w * tau * tau / p1
        gap = 2.0 * b
        e = math.exp(p1)
        s = -math.expm1(-gap) / gap * e
        q1 = math.expm1(p1) / p1 if p1 != 0.0 else 1.0
        q2 = math.expm1(p2) / p2 if p2 != 0.0 else 1.0
        return s * tau, e + p2 * s, (q1 - q2) / gap * tau * tau
    if -0.004 < d < 0.004:  # short against every time constant: Taylor's series
        g = d + d
        u = d * d - z
        s = 1.0 - g / 2.0 + (g * g - u) / 6.0 - (g * g - 2.0 * u) * g / 24.0 + (g * g * (g * g - 3.0 * u) + u * u) / 120.0
        q = 0.5 - g / 6.0 + (g * g - u) / 24.0 - (g * g - 2.0 * u) * g / 120.0 + (g * g * (g * g - 3.0 * u) + u * u) / 720.0
        return s * tau, 1.0 - g * s - u * q, q * tau * tau
    e = math.exp(-d)  # near critical damping
    e1 = e - 1.0 if d > 0.5 else math.expm1(-d)
    s = e * tau * (1.0 + z / 6.0 * (1.0 + z / 20.0))
    rise = e * 0.5 * z * (1.0 + z / 12.0)  # e (cosh sqrt(z) - 1)
    return s, e + rise - delta * s, -(e1 + rise + delta * s) / w


def whole(delta, w, tau):
    """The part of tau, s, in which v and a change sign at most once each, and nothing overflows or dies out to zero."""
    b = delta * delta - w
    if b < 0.0:
        return min(tau, 3.0 / math.sqrt(-b))
    b = math.sqrt(b)
    if b > delta:
        return min(tau, 30.0 / (b - delta))
    return min(tau, 500.0 * (delta + b) / w) if w > 0.0 else tau


def reach(delta, w, v, a):
    """Bound of |v| for all time to come, where the motion is stable; with (v, 0) a bound of what v is the rate of."""
    if w <= 0.0 or delta < 0.0:
        return math.inf
    b = delta * delta - w
    if b < 0.0:
        other = (a + delta * v) / math.sqrt(-b)
        return math.sqrt(v * v + other * other)  # hypot's last bit is not the same in Python and compiled
    return abs(v) + abs(a) / (delta + math.sqrt(b))


def root(c0, ct, cv, ca, theta, v, a, delta, w, low, high):
    """Where g = c0 + ct theta + cv v + ca a falls through zero: g(low) >= 0 > g(high), one crossing between.

    Newton's method inside a shrinking bracket; the answer is on the far side, g <= 0, so that events make progress. And
    how many rounds it took.
    """
    near, far = low, high
    tau = 0.5 * (low + high)
    rounds = 0
    while rounds < 80:
        rounds += 1
        s, ds, q = response(delta, w, tau)
        v1 = v * (ds + 2.0 * delta * s) + a * s
        a1 = a * ds - w * v * s
        g = c0 + ct * (theta + v * (s + 2.0 * delta * q) + a * q) + cv * v1 + ca * a1
        if g > 0.0:
            near = tau
        else:
            far = tau
        if far - near <= 4.0 * ULP * high:
            break
        slope = ct * v1 + cv * a1 - ca * (w * v1 + 2.0 * delta * a1)
        guess = tau - g / slope if slope < 0.0 else near
        step = abs(guess - tau)
        if step < 2.0 * ULP * high:  # converged from one side: step over the root
            guess = tau + 4.0 * ULP * high if g > 0.0 else tau - 4.0 * ULP * high
        tau = guess if near < guess < far else 0.5 * (near + far)
    return far, rounds


def first_fall(c0, ct, cv, theta, v, a, theta1, v1, a1, delta, w, tau):
    """When g = c0 + ct theta + cv v first falls below zero in (0, tau], s; infinity where it does not. And the rounds it took.

    (theta, v, a) at the start, (theta1, v1, a1) at the end of a piece no longer than `whole`, so that g has at most
    one extremum inside. g is not below zero at the start, but for rounding.
    """
    d0 = ct * v + cv * a
    d1 = ct * v1 + cv * a1
    g1 = c0 + ct * theta1 + cv * v1
    if g1 >= 0.0 and not (d0 < 0.0 and d1 > 0.0):
        return math.inf, 0
    g0 = c0 + ct * theta + cv * v
    low, high, rounds = 0.0, tau, 0  # where it falls, once
    if d0 < 0.0:
        if g0 <= 0.0:
            return 0.0, 0
        if g1 >= 0.0:  # down and up again: look at the lowest point
            high, rounds = root(0.0, 0.0, -ct, -cv, theta, v, a, delta, w, 0.0, tau)
            s, ds, q = response(delta, w, high)
            v_low = v * (ds + 2.0 * delta * s) + a * s
            if c0 + ct * (theta + v * (s + 2.0 * delta * q) + a * q) + cv * v_low >= 0.0:
                return math.inf, rounds
    elif g0 <= 0.0 and d1 < 0.0 and d0 > 0.0:  # from zero up and down again: start from the highest point
        low, rounds = root(0.0, 0.0, ct, cv, theta, v, a, delta, w, 0.0, tau)
    when, more = root(c0, ct, cv, 0.0, theta, v, a, delta, w, low, high)
    return when, rounds + more
