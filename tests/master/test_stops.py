"""What ends work is heard, wherever it finds the work."""

import ctypes
import signal
import sys
import weakref

import pytest

from selflock.master.stops import Stops


@pytest.fixture
def within_c():
    """Ctrl-C in Python that C called, as a compiler or an FMU's logger is: its exception cannot go on through C."""
    return ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))


def test_ctrl_c_that_c_swallowed_ends_the_work_without_a_traceback(within_c, monkeypatch):
    told = []
    hook = told.append
    monkeypatch.setattr(sys, "unraisablehook", hook)
    with Stops() as stops:
        within_c()
        with pytest.raises(KeyboardInterrupt):
            stops.obey()
        ctypes.CFUNCTYPE(None)(lambda: weakref.proxy(Stops()).asked)()
        ctypes.CFUNCTYPE(None)(lambda: 1 / 0)()
    assert [one.exc_type for one in told] == [ZeroDivisionError] and sys.unraisablehook is hook
