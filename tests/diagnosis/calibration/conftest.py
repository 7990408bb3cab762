import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))


@pytest.fixture
def oscillator(native, tmp_path):
    """An oscillator's FMU beside the logs of a test."""
    path = tmp_path / "oscillator.fmu"
    path.write_bytes(native("oscillator").read_bytes())
    return path
