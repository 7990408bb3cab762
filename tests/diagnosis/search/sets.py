"""Problems of which each set of numbers leaves what a test says: nothing is simulated."""

from __future__ import annotations

BLOCKS = 36


class Sets:
    """What a search asks of a problem beside its fits, which it makes itself: fit(free, start, *_)."""

    base_free = ()

    def with_these(self, causes, fitted):
        free = tuple(p for c in causes for p in c.free)
        return self.fit(free, {p.name: fitted.values[p.name] for p in free})

    def held_out(self, fitted):
        return fitted.misfit

    def block_loss(self, misfit):
        return misfit[:, None]
