"""SSP 1.0 both ways: `export` writes a system as an .ssp, `load` reads an .ssp, ours or others', as a system."""

from .read import read
from .structure import load
from .write import export

__all__ = ["export", "load", "read"]
