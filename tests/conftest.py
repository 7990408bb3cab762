"""Tests run side by side: threads inside them would only stand in each other's way."""

import os

for threads in ("OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(threads, "1")
