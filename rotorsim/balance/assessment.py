"""Unbalance of every record by both methods, each tested on the known ones, and the weights against one record."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rotorsim.balance.conditions import Conditions
from rotorsim.balance.correction import Correction, correction
from rotorsim.balance.influence import (
    Estimate,
    Fit,
    Influence,
    LeftOut,
    estimate,
    fit_influence,
    leave_one_out,
    testable,
)
from rotorsim.balance.physical import fit_physical, without_model
from rotorsim.base.errors import DataError
from rotorsim.base.sentences import listing, quote
from rotorsim.machine import Machine, load_machine

METHODS = ("influence coefficients", "physical model")


@dataclass(frozen=True, eq=False)
class Assessment:
    """Unbalance from 1X vectors.

    Attributes
    ----------
    conditions : the records
    tests : by method how well it gives each known unbalance from the others; empty where these are too few to leave
        one out
    method : the method of the smaller error, by which the estimates are; without tests the influence coefficients
    estimates : by record without known unbalance its unbalance [kg m] and standard deviation
    corrected : record that the weights are against; empty without one
    correction : weights, None without such a record
    left_out : why the physical model was not used; empty where it was
    """

    conditions: Conditions
    tests: dict[str, LeftOut]
    method: str
    estimates: dict[str, Estimate]
    corrected: str
    correction: Correction | None
    left_out: str = ""


def assess(machine: Machine | str | Path, conditions: Conditions, correct: str = "") -> Assessment:
    """Estimate unbalance by influence coefficients and by the machine's model, side by side, and correct it.

    Parameters
    ----------
    machine : Machine, name or path
    conditions : Conditions
        1X vectors [m 0-pk] and known unbalances [kg m], see `read_conditions`.
    correct : str
        Record to balance; by default the first without added unbalance.

    Raises
    ------
    DataError
        If no record has a known unbalance, or no record has the name.

    Examples
    --------
    >>> import rotorsim as rs
    >>> conditions = rs.balance.read_conditions(["open.csv"], "balance.toml")
    >>> rs.balance.assess("bently_rk4", conditions).method
    'influence coefficients'
    """
    model = machine if isinstance(machine, Machine) else load_machine(machine)
    known = conditions.known
    if not known.any():
        raise DataError("no condition has a known unbalance; add a trial weight in each plane and label it")
    labelled = conditions.flat[known], conditions.unbalance[known]
    free: Fit = fit_influence
    left_out = without_model(model, conditions)
    methods = {METHODS[0]: free} if left_out else {METHODS[0]: free, METHODS[1]: fit_physical(model, conditions)}
    fits = {name: fit(*labelled) for name, fit in methods.items()}
    enough = testable(conditions.unbalance[known])
    tests = {name: leave_one_out(conditions, fit) for name, fit in methods.items()} if enough else {}
    best = min(tests, key=lambda name: tests[name].vector_rms, default=METHODS[0])
    label, weights = _correction(conditions, fits[best], correct)
    found = {c: estimate(fits[best], conditions.flat[k]) for k, c in enumerate(conditions.labels) if not known[k]}
    return Assessment(conditions, tests, best, found, label, weights, left_out)


def _correction(conditions: Conditions, found: Influence, wanted: str) -> tuple[str, Correction | None]:
    """Condition to balance and its weights; empty and None if there is no condition without added unbalance."""
    if wanted and wanted not in conditions.labels:
        raise DataError(f"correct: no condition {quote(wanted)}; there are {listing(conditions.labels)}")
    bare = [c for c, u in zip(conditions.labels, conditions.unbalance, strict=True) if (u == 0).all()]
    label = wanted or (bare[0] if bare else "")
    if not label:
        return "", None
    vectors = conditions.flat[conditions.labels.index(label)]
    return label, correction(found, vectors, conditions.planes)
