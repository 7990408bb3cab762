from benchmarks.plants import ask
from tests.diagnosis.plant import cascade


def about(case: cascade.Case) -> str:
    """How it is recorded."""
    by = case.recorder
    ways = [name for name, averaged in (("voltage", by.mean_voltage), ("current", by.mean_current)) if averaged]
    means = f", means of {' and '.join(ways)}" if ways else ""
    return f"; {by.act * cascade.STEP * 1e3:g} ms acts, {by.row * cascade.STEP * 1e3:g} ms rows of {' '.join(by.channels)}{means}"


if __name__ == "__main__":
    ask(cascade, faults=4, seconds=12.0, about=about)
