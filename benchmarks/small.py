from benchmarks.plants import ask
from tests.diagnosis.plant import small


def about(case: small.Case) -> str:
    """How it is driven and recorded."""
    of = case.make
    by = {"pd": "a loop", "pid": "a loop that nobody describes", "none": "a table of duties"}[of.loop]
    acts = " of 1 ms" if of.fast and of.loop != "none" else ""
    supply = "a battery" if of.battery else "a supply"
    return (
        f"; {of.load}, {by}{acts}, {supply}, {case.sheet['bits']:.0f} bits, {of.row * 1e3:g} ms rows, encoder at the {of.encoder}"
    )


if __name__ == "__main__":
    ask(small, faults=4, seconds=20.0, about=about)
