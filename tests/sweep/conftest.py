import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # workers import the functions of jobs.py by name


@pytest.fixture(scope="module")  # idle it takes a tenth of a core from all tests behind
def scheduler(tmp_path_factory):
    """The address of a Dask cluster of two workers, as somebody else would have started it."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        dashboard_address="127.0.0.1:0",
        local_directory=str(tmp_path_factory.mktemp("dask")),
    ) as cluster:
        yield cluster.scheduler_address
