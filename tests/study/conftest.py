"""The whole study, run once for all tests (and once for all of pytest-xdist's workers)."""

import os
import pickle
import time

import pytest

from selflock.study import study


@pytest.fixture(scope="session")
def result(tmp_path_factory):
    """StudyResult of a run of everything."""
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" not in os.environ:
        return study(base / "study")
    shared = base.parent / "study"
    told = shared / "result.pickle"
    try:
        shared.mkdir()
    except FileExistsError:  # another worker is at it
        while not told.exists():
            if (shared / "failed").exists():
                pytest.fail("the study failed in another worker")
            time.sleep(0.2)
        return pickle.loads(told.read_bytes())
    try:
        made = study(shared)
    except BaseException:
        (shared / "failed").touch()
        raise
    (shared / "part").write_bytes(pickle.dumps(made))
    (shared / "part").rename(told)
    return made
