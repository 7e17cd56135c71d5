"""Benchmarks of structures and of closed loops: rows that can fail, and what they state."""

from importlib import import_module

import numpy as np
import pytest

import identification as idn
from studies.benchmarks import structures

pytestmark = pytest.mark.numerical
closed_loops = import_module("studies.benchmarks.closed_loops")


def test_rates_of_the_pins_take_the_error_of_the_structure_away(monkeypatch):
    monkeypatch.setattr(structures, "POINTS", ((3000, 0.5e6),))
    off = {figure.name: figure.value for figure in structures.structures()}
    plain, rated = (next(v for k, v in off.items() if k.startswith(n) and "damping" in k) for n in names())
    assert 3.0 < plain < 6.0 and rated < 0.6
    assert all(value < 0.1 for name, value in off.items() if name.endswith("of a frequency"))


def names():
    """Beginnings of the rows without and with rates."""
    return (f"{structures.NAMES[kind]}, lin" for kind in ("rotor", "rotor-rate"))


@pytest.mark.slow
def test_a_closed_loop_is_judged_by_the_plant_and_a_refused_record_counts_as_missed(monkeypatch):
    monkeypatch.setattr(closed_loops, "POINTS", ((3.0, 0.5e6),))
    monkeypatch.setattr(closed_loops, "SECONDS", 6.0)
    monkeypatch.setattr(closed_loops, "SEEDS", (1,))
    monkeypatch.setattr(closed_loops, "LAWS", {"lqr": closed_loops.LAWS["lqr"]})
    off = {figure.name: figure for figure in closed_loops.closed_loops()}
    assert len(off) == 9
    one = off["Model 2 with rates under lqr at 3 krpm, 0.5 MPa: largest error of a frequency"].value
    assert 0 < one < 1
    assert off["Model 2 with rates under lqr: records of 1 beyond 1 % or 15 %"].met
    monkeypatch.setattr(closed_loops.idn, "identify", refused)
    assert closed_loops._off(None, "2", np.ones(2), np.ones(2)) == (np.inf, np.inf)


def refused(*_):
    """As `identify` of a record that is unfit."""
    raise idn.UnfitError("record: unfit")
