"""Response cache of an interrupted diagnosis: read bit for bit, damaged files computed again."""

import numpy as np
import pytest

from rotorsim.base.cache import Cache
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.experiments import campaign
from rotorsim.discrepancy.hidden_machine import record_of
from rotorsim.discrepancy.records import make_trial


def test_a_response_is_computed_once_for_every_place(machine, models, tmp_path):
    planned = next(p for p in campaign(machine) if p.name == "fit_3")
    trial = make_trial(record_of(models.twin, planned, ParameterPoint(), 1), "fit", "r")
    cache = Cache(tmp_path / "unfinished")
    first = TwinComparison(models.twin, [trial], cache=cache)
    here, there = ParameterPoint(), ParameterPoint({FitParameter("shaft_damping", 0.1): 0.2})
    kept = first.predict(here), first.predict(there)
    again = TwinComparison(models.twin, [trial], cache=cache)
    np.testing.assert_array_equal(again.predict(here), kept[0])
    np.testing.assert_array_equal(again.predict(there), kept[1])
    assert (first.evaluations, again.evaluations) == (2, 0)
    assert np.abs(kept[0] - kept[1]).max() > 1e-9


def test_a_file_cut_off_is_computed_again(machine, models, tmp_path):
    planned = next(p for p in campaign(machine) if p.name == "fit_3")
    trial = make_trial(record_of(models.twin, planned, ParameterPoint(), 1), "fit", "r")
    comparison = TwinComparison(models.twin, [trial], cache=Cache(tmp_path))
    kept = comparison.predict(ParameterPoint())
    (path,) = tmp_path.glob("*.npy")
    path.write_bytes(path.read_bytes()[:200])
    assert comparison.predict(ParameterPoint()) == pytest.approx(kept, abs=0)
