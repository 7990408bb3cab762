"""What a system lacks at one place: a signal is passed on corrected, by a law of a known variable or by what a path does.

    y = s + f(x)  or  y = s (1 + f(x))        s  the signal,  x  what the law goes with

x may be taken as it is, as its rate, as its integral since the start, or as the time since it last turned round; or
together with a second known variable w: x - w, x w, or x sgn(w) sqrt|w|, as of a valve. Of the steps of a master that holds its inputs, `ahead` = 0.5 takes x at the middle of the step, on the straight line through
its last two values: the held law is then right to second order. From `since` to `until`, in s after the start; of a
step that lies in that time in part as much of the correction is made as there is of the step. Before and after it, y = s.

Laws f(x), with the sign of x in sgn x:

    constant       a
    proportional   a x
    quadratic      a x^2
    drag           a x |x|
    cubic          a x^3
    power          a sgn(x) |x|^n
    square root    a sgn(x) sqrt |x|
    Coulomb        a tanh(x / w)
    Stribeck       (a + b exp(-(x / v)^2)) tanh(x / w)
    sine           a sin(n x + phase)
    dead band      a (x - w) above w, a (x + w) below -w, between them 0
    limit          a (x - l) above l, below it 0
    limit below    a (x - l) below l, above it 0
    Dahl           a z with z' = x' (1 - sgn(x') z) / w
    LuGre          Dahl's with w (1 + b exp(-(x' / v)^2)) in the place of w
    Bouc-Wen       a z with z' = x' (1 - |z|^n (b + (1 - b) sgn(x' z))) / w
    first order    a z with T z' = x - z, from z = x + d on
    table          straight between points (x1, y1), (x2, y2) ..., beyond them as at the last

Paths, which make y of the signal itself:

    scale          a s
    sign           -s
    delay          s of the time T ago
    lag            y with T y' = s - y, from y = s on
    dead zone      s - w above w, s + w below -w, between them 0
    saturation     s, not below low and not above high
    rate limit     y that follows s by no more than r a second
    quantisation   q floor(s / q + 1/2)

Sources: H. Olsson, K. J. Astrom, C. Canudas de Wit, M. Gafvert, P. Lischinsky, Friction Models and Friction
Compensation, Eur. J. Control 4 (1998) 176; Y. K. Wen, Method for Random Vibration of Hysteretic Systems, J. Eng. Mech.
Div. ASCE 102 (1976) 249. Plain functions on floats; p is read and m changed in place, as lists or as arrays.
"""

from math import copysign, exp, floor, isfinite, nan, sin, sqrt, tanh
from typing import NamedTuple

NUMBERS = 8  # of a law, at most
POINTS = 20  # of a table, at most
HISTORY = 400  # steps that a delay reaches back, at most

LAW, MULTIPLIES, OVER, OWN, AHEAD, AHEAD_W, SINCE, UNTIL, COUNT, FIRST = range(10)
"""Places in p. OWN: x is the signal itself; AHEAD_W: `ahead` of w; from FIRST on the numbers of the law, a table's points x1, y1, x2, y2 ..."""
SIZE = FIRST + 2 * POINTS

TIME, BEGUN, LAST, LAST_W, SUM, TURNED, WAY, STATE, NEXT, FILLED, OLD = range(11)
"""Places in m: time since the start, whether a step was made, x and w before, the integral of x, when it last turned, which way it
went, the law's own state, and the signal's past from OLD on."""
MEMORY = OLD + HISTORY

VALUE, RATE, INTEGRAL, SINCE_TURN, DIFFERENCE, PRODUCT, ROOTED = range(7)
"""What of x is taken; from DIFFERENCE on what of x and w."""

(CONSTANT, PROPORTIONAL, QUADRATIC, DRAG, CUBIC, POWER, ROOT, COULOMB, STRIBECK, SINE, DEAD_BAND, LIMIT, LIMIT_BELOW, DAHL,
 LUGRE, BOUC_WEN, FIRST_ORDER, TABLE, SCALE, SIGN, DELAY, LAG, DEAD_ZONE, SATURATION, RATE_LIMIT, QUANTISATION) = range(26)  # fmt: skip


class KnownLaw(NamedTuple):
    """One law or path as people know it."""

    code: int
    name: str
    numbers: tuple  # their names, in their order
    formula: str

    @property
    def is_path(self):
        """Whether it makes y of the signal alone."""
        return self.code >= SCALE

    @property
    def remembers(self):
        """Whether it has a state of its own, so that x alone does not say f."""
        return self.code in (DAHL, LUGRE, BOUC_WEN, FIRST_ORDER)


LAWS = tuple(
    KnownLaw(code, name, tuple(numbers.split()), formula)
    for code, name, numbers, formula in (
        (CONSTANT, "constant", "a", "a"),
        (PROPORTIONAL, "proportional", "a", "a x"),
        (QUADRATIC, "quadratic", "a", "a x^2"),
        (DRAG, "drag", "a", "a x |x|"),
        (CUBIC, "cubic", "a", "a x^3"),
        (POWER, "power", "a n", "a sgn(x) |x|^n"),
        (ROOT, "square root", "a", "a sgn(x) sqrt|x|"),
        (COULOMB, "Coulomb", "a w", "a tanh(x / w)"),
        (STRIBECK, "Stribeck", "a b v w", "(a + b exp(-(x / v)^2)) tanh(x / w)"),
        (SINE, "sine", "a n phase", "a sin(n x + phase)"),
        (DEAD_BAND, "dead band", "a w", "a (x - w) above w, a (x + w) below -w"),
        (LIMIT, "limit", "a l", "a (x - l) above l"),
        (LIMIT_BELOW, "limit below", "a l", "a (x - l) below l"),
        (DAHL, "Dahl", "a w", "a z, z' = x' (1 - sgn(x') z) / w"),
        (LUGRE, "LuGre", "a w b v", "a z, z' = x' (1 - sgn(x') z / g) / w, g = 1 + b exp(-(x' / v)^2)"),
        (BOUC_WEN, "Bouc-Wen", "a w b n", "a z, z' = x' (1 - |z|^n (b + (1 - b) sgn(x' z))) / w"),
        (FIRST_ORDER, "first order", "a T d", "a z, T z' = x - z, from z = x + d on"),
        (TABLE, "table", "", "straight between points"),
        (SCALE, "scale", "a", "a s"),
        (SIGN, "sign", "", "-s"),
        (DELAY, "delay", "T", "s of the time T ago"),
        (LAG, "lag", "T", "T y' = s - y"),
        (DEAD_ZONE, "dead zone", "w", "s - w above w, s + w below -w"),
        (SATURATION, "saturation", "low high", "s between low and high"),
        (RATE_LIMIT, "rate limit", "r", "|y'| <= r"),
        (QUANTISATION, "quantisation", "q", "q floor(s / q + 1/2)"),
    )
)
BY_NAME = {law.name: law for law in LAWS}


def table(p, x):
    """Straight between the points of p; beyond them it stays as at the last."""
    last = int(p[COUNT]) - 1
    x = min(max(x, p[FIRST]), p[FIRST + 2 * last])
    k = 0
    while k < last - 1 and x > p[FIRST + 2 * (k + 1)]:
        k += 1
    x0, y0, x1, y1 = p[FIRST + 2 * k], p[FIRST + 2 * k + 1], p[FIRST + 2 * k + 2], p[FIRST + 2 * k + 3]
    return y0 + (y1 - y0) * (x - x0) / (x1 - x0)


def still(p, x):
    """f(x) of a law without a state."""
    law, a = int(p[LAW]), p[FIRST]
    size = abs(x)
    if law == TABLE:
        return table(p, x)
    if law == CONSTANT:
        return a
    if law == PROPORTIONAL:
        return a * x
    if law == QUADRATIC:
        return a * x * x
    if law == DRAG:
        return a * x * size
    if law == CUBIC:
        return a * x * x * x
    if law == POWER:
        return a * copysign(size ** p[FIRST + 1], x) if size > 0.0 else 0.0
    if law == ROOT:
        return a * copysign(sqrt(size), x)
    if law == COULOMB:
        return a * tanh(x / p[FIRST + 1])
    if law == STRIBECK:
        ratio = x / p[FIRST + 2]
        return (a + p[FIRST + 1] * exp(-ratio * ratio)) * tanh(x / p[FIRST + 3])
    if law == SINE:
        return a * sin(p[FIRST + 1] * x + p[FIRST + 2])
    if law == DEAD_BAND:
        return a * copysign(max(0.0, size - p[FIRST + 1]), x)
    if law == LIMIT:
        return a * max(0.0, x - p[FIRST + 1])
    if law == LIMIT_BELOW:
        return a * min(0.0, x - p[FIRST + 1])
    return 0.0


def bristle(p, z, moved, dt):
    """z of a hysteresis after x has moved by `moved` in dt: exact for Dahl and LuGre, in small parts for Bouc-Wen."""
    law, w = int(p[LAW]), p[FIRST + 1]
    if moved == 0.0:
        return z
    if law == BOUC_WEN:
        parts = min(64, 1 + int(8.0 * abs(moved) / w))
        b, n = p[FIRST + 2], p[FIRST + 3]
        for _ in range(parts):
            part = moved / (parts * w)
            middle = z + 0.5 * part * (1.0 - abs(z) ** n * (b + (1.0 - b) * copysign(1.0, part * z)))
            z += part * (1.0 - abs(middle) ** n * (b + (1.0 - b) * copysign(1.0, part * middle)))
        return z
    end = copysign(1.0, moved)
    if law == LUGRE and dt > 0.0:
        ratio = moved / (dt * p[FIRST + 3])
        end *= 1.0 + p[FIRST + 2] * exp(-ratio * ratio)
    return end + (z - end) * exp(-abs(moved) / (w * abs(end)))


def past(p, m, signal, dt):
    """The signal of the time T ago, straight between the steps that were made; NaN where that is too long ago to know."""
    back = p[FIRST] / dt
    known = int(m[FILLED])
    if not 0.0 <= back < HISTORY - 1:
        return nan
    whole = int(floor(back))
    share = back - whole
    later, earlier = min(whole, known), min(whole + 1, known)
    head = int(m[NEXT])
    newer = signal if later == 0 else m[OLD + (head - later) % HISTORY]
    older = signal if earlier == 0 else m[OLD + (head - earlier) % HISTORY]
    return newer + (older - newer) * share


def path(p, m, signal, dt):
    """What a path makes of the signal; its state is the second answer."""
    law, a = int(p[LAW]), p[FIRST]
    if law == SCALE:
        return a * signal, 0.0
    if law == SIGN:
        return -signal, 0.0
    if law == DELAY:
        return past(p, m, signal, dt), 0.0
    if law == LAG:
        before = m[STATE] if m[BEGUN] > 0.0 else signal
        # the signal is held from this step on; half of it lies before what is shown
        y = signal + (before - signal) * exp(-dt / a) if a > 0.0 else signal
        return y, y
    if law == DEAD_ZONE:
        return copysign(max(0.0, abs(signal) - a), signal), 0.0
    if law == SATURATION:
        return min(max(signal, a), p[FIRST + 1]), 0.0
    if law == RATE_LIMIT:
        before = m[STATE] if m[BEGUN] > 0.0 else signal
        y = before + min(max(signal - before, -a * dt), a * dt)
        return y, y
    if law == QUANTISATION:
        return (a * floor(signal / a + 0.5) if a > 0.0 else signal), 0.0
    return signal, 0.0


def taken(p, m, x, w, dt):
    """What of x, and of w, the law goes with."""
    over = int(p[OVER])
    begun = m[BEGUN] > 0.0
    if over == RATE:
        return (x - m[LAST]) / dt if begun and dt > 0.0 else 0.0
    if over == SINCE_TURN:
        return m[TIME] - m[TURNED]
    if over == INTEGRAL:
        return m[SUM] + p[AHEAD] * dt * x
    x = x + p[AHEAD] * (x - m[LAST]) if begun else x
    w = w + p[AHEAD_W] * (w - m[LAST_W]) if begun else w
    if over == DIFFERENCE:
        return x - w
    if over == PRODUCT:
        return x * w
    if over == ROOTED:
        return x * copysign(sqrt(abs(w)), w)
    return x


def share(p, m, dt):
    """How much of a step from now on lies between `since` and `until`."""
    begin, end = max(p[SINCE], m[TIME]), min(p[UNTIL], m[TIME] + dt)
    if dt <= 0.0:
        return 1.0 if p[SINCE] <= m[TIME] < p[UNTIL] else 0.0
    return min(1.0, max(0.0, end - begin) / dt)


def corrected(p, m, signal, x, w, dt):
    """y for a step of dt from now on, and the law's state after it; m is left as it is."""
    law = int(p[LAW])
    state = m[STATE]
    if law >= SCALE:
        y, state = path(p, m, signal, dt if dt > 0.0 else 1.0)
    else:
        u = taken(p, m, x, w, dt)
        if law == DAHL or law == LUGRE or law == BOUC_WEN:
            state = bristle(p, state, x - m[LAST] if m[BEGUN] > 0.0 else 0.0, dt)
            f = p[FIRST] * state
        elif law == FIRST_ORDER:
            before = state if m[BEGUN] > 0.0 else u + p[FIRST + 2]
            state = u + (before - u) * exp(-dt / p[FIRST + 1])
            f = p[FIRST] * 0.5 * (before + state)
        else:
            f = still(p, u)
        y = signal * (1.0 + f) if p[MULTIPLIES] > 0.0 else signal + f
    part = share(p, m, dt)
    if part < 1.0:
        y = signal + part * (y - signal)
    return y, state


def step(p, m, signal, x, w, dt):
    """y over a step of dt >= 0 with held signal, x and w; m goes on to the step's end."""
    if p[OWN] > 0.0:
        x = signal
    y, state = corrected(p, m, signal, x, w, dt)
    if dt > 0.0:
        law = int(p[LAW])
        m[STATE] = state
        if law == DELAY:
            head = int(m[NEXT])
            m[OLD + head] = signal
            m[NEXT] = (head + 1) % HISTORY
            m[FILLED] = min(HISTORY - 1, m[FILLED] + 1.0)
        if m[BEGUN] > 0.0 and x != m[LAST]:
            way = copysign(1.0, x - m[LAST])
            if m[WAY] != 0.0 and way != m[WAY]:
                m[TURNED] = m[TIME]
            m[WAY] = way
        m[SUM] += x * dt
        m[LAST], m[LAST_W], m[BEGUN] = x, w, 1.0
        m[TIME] += dt
    return y


def start(p):
    """The memory before the first step; only a delay needs the signal's past."""
    return [0.0] * (MEMORY if int(p[LAW]) == DELAY else OLD)


def whole(p):
    """Whether the points of a table rise, as it needs them to."""
    if int(p[LAW]) != TABLE:
        return True
    places = [p[FIRST + 2 * k] for k in range(int(p[COUNT]))]
    return len(places) >= 2 and all(isfinite(x) for x in places) and all(a < b for a, b in zip(places, places[1:]))
