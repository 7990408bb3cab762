"""How many threads BLAS has, which multiplies matrices for NumPy and SciPy: as it is loaded it asks the environment."""

from __future__ import annotations

import os

THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def one_thread() -> None:
    """One for each BLAS that is loaded from here on, unless the user says how many.

    Our matrices are narrow. More threads wait for work that never comes, busily: 0.15 s of a replay's processor.
    """
    for name in THREADS:
        os.environ.setdefault(name, "1")
