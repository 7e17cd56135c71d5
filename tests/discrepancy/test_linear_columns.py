"""Sensitivities to forces by the linear film: near those of the plant, and not counted where they may decide."""

from types import SimpleNamespace

import numpy as np
import pytest

from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.candidates import Form, candidates
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.experiments import campaign
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.hidden_machine import record_of
from rotorsim.discrepancy.hypotheses import FINALISTS
from rotorsim.discrepancy.linear_columns import ERROR, LinearColumns, not_sure
from rotorsim.discrepancy.records import make_trials
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import load_machine

EFFECTS = ("coupling", "labyrinth_seal", "rub", "sensor_gain")


@pytest.mark.slow
def test_columns_of_forces_are_those_of_the_plant_and_others_are_left_to_it():
    rig = load_machine("dtu_gas_bearing")
    twin = Twin(rig, (16, 8), only=EFFECTS)
    plan = [p for p in campaign(rig) if p.name in ("fit_1", "fit_4")]
    records = [(p.name, record_of(twin, p, ParameterPoint(), 3, tiled=True)) for p in plan]
    comparison = TwinComparison(twin, make_trials(rig, records, "fit"))
    linear, seen = LinearColumns.of(comparison), set[str]()
    for form in candidates(twin):
        found = linear.columns(form)
        if found is None:
            continue
        seen.add(form.key.partition(" of ")[0])
        begin = ParameterPoint(fixed=form.fixed)
        plant = np.column_stack([comparison.column(begin, k, linear.here) for k in form.parameters])
        assert np.linalg.norm(found - plant) < 1.2 * ERROR * np.linalg.norm(plant)
    assert {"coupling.force_2x", "labyrinth_seal.cross_stiffness"} <= seen
    assert not any(key.startswith(("sensor_gain", "rub")) for key in seen)


def test_linear_films_are_not_for_machines_without_one_nor_for_records_that_do_not_repeat():
    def comparison(film, **trial):
        trials = [SimpleNamespace(**{"orders": (), "clock": 0.0, "lead": 2000} | trial)]
        twin = SimpleNamespace(machine=SimpleNamespace(film=film))
        return SimpleNamespace(twin=twin, trials=trials, predict=lambda point: np.zeros(4))

    assert LinearColumns.of(comparison("film")) is not None
    for other in (comparison(None), comparison("film", lead=0), comparison("film", orders=(1,))):
        assert LinearColumns.of(other) is None


@pytest.mark.parametrize(("size", "imitated", "doubtful"), [(10.0, 0.0, False), (19.0, 0.0, True), (1.0, 0.99, True)])
def test_a_form_is_not_sure_near_the_cut_nor_where_the_calibration_imitates_it(size, imitated, doubtful):
    """Responses of unit length, of which the residual has these sizes: ten forms of 20, and one that is in question."""
    count = FINALISTS + 1
    forms = [Form("a", f"a.{i}", (FitParameter(f"a.0.{i}", 1.0),)) for i in range(count)]
    e = np.eye(count + 1)
    own = imitated * e[:, count] + np.sqrt(1 - imitated**2) * e[:, 0]
    columns = {f.label: (own if i == 0 else e[:, i])[:, None] for i, f in enumerate(forms)}
    residual = np.array([size, *[20.0] * FINALISTS, 0.0])
    base = ParameterFit((FitParameter("c", 1.0),), ParameterPoint(), residual, e[:, [count]], 0.0)
    assert not_sure(base, forms, columns, {"a.0"}) == ([forms[0]] if doubtful else [])
    assert not_sure(base, forms, columns, set()) == []


@pytest.mark.parametrize(("size", "doubtful"), [(4.0, False), (8.0, True)])
def test_a_form_that_cannot_be_named_is_sure_wherever_it_ranks(size, doubtful):
    form, e = Form("a", "a.0", (FitParameter("a.0.x", 1.0),)), np.eye(2)
    base = ParameterFit((FitParameter("c", 1.0),), ParameterPoint(), size * e[0], e[:, 1:], 0.0)
    assert not_sure(base, [form], {"a.0": e[:, :1]}, {"a.0"}) == ([form] if doubtful else [])
