from benchmarks.plants import ask
from tests.diagnosis.plant import impulses

if __name__ == "__main__":
    ask(impulses, faults=8, seconds=15.0)
