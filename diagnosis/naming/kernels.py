"""The step of a correction for the compiled loop: its inputs, its output, p and m of its law in one block of doubles."""

from selflock.fmus.correction import law

SIGNAL, X, W, OUT, P = range(5)  # from P on the law's p, from M on its m
M = P + law.SIZE
SIZE = M + law.MEMORY


def advance(block, dt):
    """A step of dt over the block."""
    block[OUT] = law.step(block[P:M], block[M:SIZE], block[SIGNAL], block[X], block[W], dt)


def alone(p, m, signal, x, w, dt, y):
    """What the correction passes on, y, of what it is given in each step; none of the system is asked."""
    for j in range(len(signal)):
        y[j] = law.step(p, m, signal[j], x[j], w[j], dt)
