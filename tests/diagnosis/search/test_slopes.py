"""What slopes of a fit cost."""

import numpy as np

from selflock.diagnosis.residuals.memory import kept
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.fit import jacobian
from selflock.diagnosis.search.hypotheses import Free


def test_slopes_of_what_a_recorder_did_ask_for_no_simulation_again():
    """Of a drive of which more is fitted than simulations are remembered, and whatever stands first among what is fitted."""
    most = RULES.residuals.wholes_remembered
    drive = [Free(f"load.number_{n}", 1.0, 0.0, 2.0) for n in range(most + 2)]
    recorder = [Free(f"recorder.load.angle.number_{n}", 1.0, 0.0, 2.0) for n in range(3)]
    free, known, made = (recorder[0], *drive, *recorder[1:]), {}, []

    def misfit(values):
        moves = tuple(values[p.name] for p in drive)

        def simulated():
            made.append(moves)
            return np.cumsum(moves)

        return kept(known, moves, simulated, most) + sum(n * values[p.name] for n, p in enumerate(recorder))

    values = {p.name: p.nominal for p in free}
    slopes = jacobian(misfit, {}, free, values, misfit(values))
    assert len(made) == 1 + len(drive)
    expected = np.concatenate(
        [
            np.zeros((len(drive), 1)),
            np.tril(np.ones((len(drive), len(drive)))),
            np.full((len(drive), 1), 1.0),
            np.full((len(drive), 1), 2.0),
        ],
        1,
    )
    np.testing.assert_allclose(slopes, expected, atol=1e-6)
