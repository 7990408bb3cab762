"""SUNDIALS' CVODE for model exchange: variable step, variable order BDF with roots, by the binding that FMPy ships.

Hindmarsh et al., SUNDIALS: suite of nonlinear and differential/algebraic equation solvers, ACM TOMS 31 (2005).

One internal step at a time and never beyond a given time, so that an FMU is told of every step that is accepted and is not
evaluated past an event.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import byref, c_double, c_int, c_void_p
from typing import Any

import numpy as np
from fmpy import sundials
from fmpy.sundials import cvode, libraries

ONE_STEP, STOPPED, ROOT = 2, 1, 2  # CV_ONE_STEP, CV_TSTOP_RETURN, CV_ROOT_RETURN
Evaluate = Callable[[float, np.ndarray, np.ndarray], int]  # (time, states, what is computed): 0, 1 try smaller, -1 failed


def _named(library: Any, name: str, *types: Any, result: Any = c_int) -> Any:
    function = library[name]  # an object of our own
    function.argtypes, function.restype = list(types), result
    return function


_stop_time = _named(libraries.sundials_cvode, "CVodeSetStopTime", c_void_p, c_double)
_clear = _named(libraries.sundials_core, "SUNContext_ClearErrHandlers", c_void_p)
_free_context = _named(libraries.sundials_core, "SUNContext_Free", c_void_p)
_free_matrix = _named(libraries.sundials_core, "SUNMatDestroy", c_void_p, result=None)
_free_solver = _named(libraries.sundials_core, "SUNLinSolFree", c_void_p)


class Solver:
    """dx/dt = f(t, x), and the roots of g(t, x)."""

    def __init__(self, states: int, roots: int, derivatives: Evaluate, indicators: Evaluate, tolerance: float):
        self.count, self.tolerance, self.said = states, tolerance, ""
        self._views: dict[int, np.ndarray] = {}
        self._context = c_void_p()
        self._good(sundials.SUNContext_Create(0, byref(self._context)))
        self._good(_clear(self._context))
        self._x, self._absolute = (sundials.N_VNew_Serial(states, self._context) for _ in range(2))
        self.x = self._view(self._x)
        self._memory = c_void_p(sundials.CVodeCreate(sundials.CV_BDF, self._context))

        def f(time, x, dx, _):
            return self._guarded(derivatives, time, self._view(x), self._view(dx))

        def g(time, x, found, _):
            return self._guarded(indicators, time, self._view(x), np.ctypeslib.as_array(found, (roots,)))

        def said(line, function, file, message, code, data, context):
            self.said = (message or b"").decode("utf-8", "replace").strip()

        self._calls = cvode.CVRhsFn(f), cvode.CVRootFn(g), sundials.SUNErrHandlerFn(said)
        self._good(sundials.SUNContext_PushErrHandler(self._context, self._calls[2], None))
        self._view(self._absolute)[:] = tolerance
        self.x[:] = 0.0
        self._good(sundials.CVodeInit(self._memory, self._calls[0], 0.0, self._x))
        self._good(sundials.CVodeSVtolerances(self._memory, tolerance, self._absolute))
        if roots:
            self._good(sundials.CVodeRootInit(self._memory, roots, self._calls[1]))
            self._good(sundials.CVodeSetNoInactiveRootWarn(self._memory))
        self._matrix = c_void_p(sundials.SUNDenseMatrix(states, states, self._context))
        self._linear = c_void_p(sundials.SUNLinSol_Dense(self._x, self._matrix, self._context))
        self._good(sundials.CVodeSetLinearSolver(self._memory, self._linear, self._matrix))
        self.error: BaseException | None = None

    def _view(self, vector: Any) -> np.ndarray:
        """The numbers of a vector; CVODE has some ten of them for all its life."""
        where: int = vector.contents.content
        if where not in self._views:
            content = ctypes.cast(where, sundials.N_VectorContent_Serial)
            self._views[where] = np.ctypeslib.as_array(content.contents.data, (self.count,))
        return self._views[where]

    def _good(self, status: int) -> None:
        if status != 0:
            raise RuntimeError(self.said or f"CVODE answers {status}")

    def _guarded(self, call: Evaluate, *arguments: Any) -> int:
        """No exception goes through C: it is kept for `advance`."""
        try:
            return call(*arguments)
        except BaseException as error:
            self.error = error
            return -1

    def begin(self, time: float, states: np.ndarray, nominals: np.ndarray) -> None:
        """Start anew at `time`, for what was before does not go on smoothly."""
        self.x[:] = states
        self._view(self._absolute)[:] = self.tolerance * nominals
        self._good(sundials.CVodeReInit(self._memory, time, self._x))

    def longest(self, step: float) -> None:
        """No internal step is longer than this, s."""
        self._good(sundials.CVodeSetMaxStep(self._memory, step))

    def advance(self, goal: float) -> tuple[float, bool]:
        """One internal step towards `goal`, s: the time reached, with `x` there, and whether a root lies there.

        Raises RuntimeError with what the solver says, or what a function raised.
        """
        self._good(_stop_time(self._memory, goal))
        reached = c_double()
        status = sundials.CVode(self._memory, goal, self._x, byref(reached), ONE_STEP)
        if self.error is not None:
            error, self.error = self.error, None
            raise error
        if status < 0:
            raise RuntimeError(self.said or f"CVODE answers {status}")
        return reached.value, status == ROOT

    def close(self) -> None:
        if self._memory:
            sundials.CVodeFree(byref(self._memory))
            _free_solver(self._linear)
            _free_matrix(self._matrix)
            for vector in (self._x, self._absolute):
                sundials.N_VDestroy_Serial(vector)
            _free_context(byref(self._context))
            self._memory = c_void_p()
