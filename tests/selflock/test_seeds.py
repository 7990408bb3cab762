"""Random numbers of tests can be drawn again."""

import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]


def test_every_generator_has_a_seed():
    unseeded = re.compile(
        r"default_rng\(\s*\)|\bRandom\(\s*\)|\brandom\.(random|uniform|gauss|choice|seed)\(|np\.random\.(rand|randn|normal)\("
    )
    found = [
        f"{path.relative_to(TESTS)}: {hit[0]}" for path in TESTS.rglob("*.py") for hit in unseeded.finditer(path.read_text())
    ]
    assert [line for line in found if not line.startswith("selflock/test_seeds")] == []


@pytest.mark.slow
def test_a_failure_prints_the_seed(pytester, monkeypatch):
    monkeypatch.delenv("SELFLOCK_SEED", raising=False)
    pytester.makeconftest((TESTS / "conftest.py").read_text())
    pytester.makepyfile("def test_it(rng):\n    print(rng.integers(1000))\n    assert False")
    first = pytester.runpytest_subprocess()
    (seed,) = {line for line in first.outlines if line.startswith("SELFLOCK_SEED=")}
    monkeypatch.setenv("SELFLOCK_SEED", re.search(r"\d+", seed)[0])
    drawn = [line for line in first.outlines if line.isdigit()]
    assert [line for line in pytester.runpytest_subprocess().outlines if line.isdigit()] == drawn and len(drawn) == 1
