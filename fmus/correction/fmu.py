"""Correction.fmu: what a system lacks at one place, behind the face of an FMU. A face for each law, with that law's numbers."""

from collections import namedtuple
from types import SimpleNamespace

from ..slave import Slave, Variable
from . import law

FOREVER = 1e300  # s; a time that no run reaches
ONES = ("w", "v", "T", "n", "q", "r")  # numbers that are no amplitude: a width, a time, a step; they start at 1
HEAD = (
    Variable("multiplies", "", False, "the law is times the signal, not added to it"),
    Variable(
        "taken",
        "",
        0,
        "what the law goes with: 0 x, 1 its rate, 2 its integral, 3 the time since it turned, 4 x - w, 5 x w, 6 x sqrt w",
        0,
        6,
    ),
    Variable("own", "", False, "x is the signal itself"),
    Variable("ahead", "", 0.0, "share of a step by which x is carried on, on the line through its last two values"),
    Variable("ahead_beside", "", 0.0, "the same of w, its second variable"),
    Variable("since", "s", 0.0, "after the start, from then on the signal is corrected"),
    Variable("until", "s", FOREVER, "after the start, from then on it is no more"),
)
POINTS = (Variable("points", "", 2, "of the table: x1, y1, x2, y2 ... with rising x", 2, law.POINTS),)


def _numbers(known):
    if known.code == law.TABLE:
        axes = [(axis, k) for k in range(law.POINTS) for axis in "xy"]
        return tuple(
            Variable(f"{axis}{k + 1}", "", float(k) if axis == "x" else 0.0, f"{axis} of point {k + 1}") for axis, k in axes
        )
    if known.code == law.SATURATION:
        return (Variable("low", "", -FOREVER, "lowest"), Variable("high", "", FOREVER, "highest"))
    return tuple(Variable(n, "", 1.0 if n in ONES else 0.0, f"{n} of {known.formula}") for n in known.numbers)


class Correction(Slave):
    """A signal passed on as a law corrects it: signal, x and w in, corrected out."""

    explained = (law,)
    inputs = (
        Variable("signal", "", 0.0, "what is corrected"),
        Variable("x", "", 0.0, "what the law goes with"),
        Variable("beside", "", 0.0, "w, what it goes with beside x"),
    )
    outputs = (Variable("corrected", "", 0.0, "the signal as it is passed on", depends_on=("signal", "x", "beside")),)
    known = law.BY_NAME["constant"]

    def begin(self, p, *inputs):
        return law.start(self.vector(p))

    def stepper(self):
        p = self.vector(self._parameters)

        def advance(_, m, signal, x, w, dt):
            m = list(m)
            return m, (law.step(p, m, signal, x, w, dt),)

        return advance

    def vector(self, values):
        """The numbers in the order that the law has them."""
        p = [0.0] * law.SIZE
        p[law.LAW] = float(self.known.code)
        p[law.MULTIPLIES], p[law.OVER], p[law.OWN] = float(values.multiplies), float(values.taken), float(values.own)
        p[law.AHEAD], p[law.AHEAD_W] = values.ahead, values.ahead_beside
        p[law.SINCE], p[law.UNTIL] = values.since, values.until
        p[law.COUNT] = float(getattr(values, "points", 0))
        for k, row in enumerate(_numbers(self.known)):
            p[law.FIRST + k] = getattr(values, row.name)
        return p

    def check(self, p):
        if not law.whole(self.vector(p)):
            return "the x of its points must rise"
        for name in ("w", "v", "T"):
            if not getattr(p, name, 1.0) > 0.0 and self.known.code not in (law.DEAD_BAND, law.DEAD_ZONE, law.DELAY, law.LAG):
                return f"{name} must be positive"
        return ""


def name(known):
    """What the face of a law is called, and with it its model."""
    return "".join(word.capitalize() for word in known.name.replace("-", " ").split()) + "Correction"


def _face(known):
    rows = (*HEAD, *(POINTS if known.code == law.TABLE else ()), *_numbers(known))
    names = [row.name for row in rows]
    parameters = namedtuple("Parameters", names)  # type: ignore[misc]  # each law has its own
    return type(
        name(known),
        (Correction,),
        {
            "__doc__": f"A signal passed on corrected, by the law {known.name}: {known.formula}.",
            "__module__": __name__,
            "known": known,
            "law": SimpleNamespace(Parameters=parameters, State=lambda *m: list(m), EFFECTS=(), __doc__=law.__doc__),
            "parameters": rows,
        },
    )


FACES = {known.name: _face(known) for known in law.LAWS}
globals().update({face.__name__: face for face in FACES.values()})
