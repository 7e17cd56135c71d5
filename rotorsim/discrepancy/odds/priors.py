"""Prior sizes of the candidates, as text with units."""

from __future__ import annotations

from collections.abc import Iterable

from rotorsim.base.quantity import quantities
from rotorsim.base.units import show
from rotorsim.discrepancy.search.candidates import Form
from rotorsim.effects import REGISTRY


def prior_sizes(forms: Iterable[Form]) -> dict[str, str]:
    """Standard deviation of every candidate's size before any record, by key of its form without its place."""
    found = {}
    for form in forms:
        first = form.parameters[0]
        unit = quantities(REGISTRY[form.effect])[first.key.split(".")[2].partition("~")[0]].unit
        found[form.key.partition(" of ")[0]] = show(float(f"{first.prior_size:.3g}"), unit)
    return found
