from benchmarks.plants import ask
from tests.diagnosis.plant import fieldbus


def about(case: fieldbus.Case) -> str:
    """What is moved, how it is asked, and what kind of table it is recorded in."""
    return f"; {case.make.load} by {case.make.way}, {case.recorder.table}, {case.recorder.stamps}"


if __name__ == "__main__":
    ask(fieldbus, faults=4, seconds=8.0, about=about)
