"""Sets of forms that a search combines: which may stand together, and the first of each set of effects."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

from rotorsim.discrepancy.search.candidates import Form
from rotorsim.discrepancy.search.indistinguishable import of_one_force, same_class


def apart(forms: Sequence[Form]) -> bool:
    """Whether all forms are of different effects, classes and kinds of force."""
    return not any(
        a.effect == b.effect or same_class(a.key, b.key) or of_one_force(a.key, b.key)
        for a, b in combinations(forms, 2)
    )


def distinct(sets: Iterable[tuple[Form, ...]], most: int) -> list[tuple[Form, ...]]:
    """The first sets with different keys."""
    out: dict[tuple[str, ...], tuple[Form, ...]] = {}
    for forms in sets:
        out.setdefault(tuple(sorted(f.key for f in forms)), forms)
        if len(out) >= most:
            break
    return list(out.values())
