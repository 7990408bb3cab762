"""The page of a naming: its curve beside the law, and what its reader must know of both."""

import numpy as np

from selflock.diagnosis.naming.outcome import FreeCurve, Naming
from selflock.diagnosis.naming.page import own_shape
from selflock.view import page


def test_a_point_that_little_tells_does_not_turn_the_curve(rng):
    """The straight line that is taken off goes by the points that are known."""
    knots = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    errors = np.array([0.01, 0.01, 0.01, 0.01, 10.0])
    line = rng.normal() + rng.normal() * knots
    astray = line + np.array([0.0, 0.0, 0.0, 0.0, 8.0])
    assert np.allclose(own_shape(knots, astray, knots, astray, errors)[:4], 0.0, atol=1e-3)
    assert np.allclose(own_shape(knots, line, knots, line, np.zeros(5)), 0.0, atol=1e-12)


def test_what_is_to_be_told_of_an_answer_stands_beside_what_to_do(tmp_path, hostile):
    curve = FreeCurve("curve of a.x on a.u", "a.x", "a.u", False, [0.0, 1.0], [0.0, 1.0], [0.1, 0.1], 0.1, 1.0, True)
    note = f"a.x lies beyond what taught in 54 % of what judges {hostile}"
    told = Naming(
        verdict="unknown", why="Something is missing", system="a.fmu", rig="rig", logs=["a.csv"], held_out="b.csv", causes=[], errors=[],
        curve=curve, remainder={}, rivals=[], numbers=[], effort={"simulations": 1, "steps_per_second": 1.0, "elapsed": 1.0}, notes=[note],
    )  # fmt: skip
    environment = page.environment("selflock.diagnosis.naming", strict=False)
    written = page.write(tmp_path / "report.html", environment, "naming.html.j2", {"numbers": [], "figures": {}}, result=told)
    text = written.read_text().replace("<wbr>", "")
    assert text.index("What to do next") < text.index("lies beyond what taught") < text.index("The errors")
