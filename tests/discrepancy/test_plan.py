"""Plan of the next experiment: what a new record should leave of the odds, and the experiments that are allowed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.campaign import load_plan
from rotorsim.discrepancy.data_vector import make_layout
from rotorsim.discrepancy.decision import ALLOWED, check_allowed
from rotorsim.discrepancy.evidence import ModelForm, log_evidence
from rotorsim.discrepancy.experiments import campaign, options
from rotorsim.discrepancy.forecast import (
    CurrentOdds,
    Outlook,
    PredictedResponse,
    PredictiveDensity,
    entropy,
    in_proportion,
    outlook,
    separation,
)
from rotorsim.discrepancy.ranking import ExperimentPlan, ExperimentRanking, Proposal, _of_class, rivals_of
from rotorsim.discrepancy.run_ups import empty_sweep
from rotorsim.discrepancy.trial import Trial
from rotorsim.discrepancy.verdict import Explanation
from rotorsim.experiments import Coastdown, Impact, Multisine, Runup, Steady
from rotorsim.machine import load_machine

N = 200
EVEN = CurrentOdds.of(0.5, 0.5)
STILL = np.zeros((N, 1))


def predicted(mean, spread=STILL, form=STILL):
    """A prediction without an error of the form, unless one is given."""
    return PredictedResponse(mean, spread, form)


def ahead(difference, spread=STILL, odds=EVEN, temperature=1.0):
    """Outlook of two rivals whose responses differ."""
    rivals = [predicted(np.zeros(N), spread), predicted(difference, spread)]
    return outlook(odds, rivals, np.ones(N), temperature)


def test_rivals_that_respond_alike_stay_as_they_are():
    left = ahead(np.zeros(N), odds=CurrentOdds.of(0.8, 0.2))
    assert left.entropy == pytest.approx(float(entropy(np.array([0.8, 0.2]))), abs=1e-9)
    assert left.decided == 0 and left.truths == pytest.approx([0.8, 0.2])


def test_rivals_far_apart_are_decided_and_a_temperature_makes_that_harder():
    far = np.full(N, 1.0)  # chi-square 200
    left = ahead(far)
    assert left.entropy < 1e-6 and left.decided == 1.0
    assert left.entropy < ahead(far, temperature=30.0).entropy < 1.0


def test_a_difference_that_a_rival_can_be_re_fitted_to_is_none():
    """All of the difference lies along a column that the records leave open: the plug-in estimate would be certain."""
    column = np.linspace(0, 1, N)[:, None]
    open_ = ahead(2.0 * column[:, 0], spread=1e3 * column)
    assert open_.entropy > 0.99 and open_.decided == 0
    assert ahead(2.0 * column[:, 0], spread=1e-3 * column).entropy < 0.01


def test_what_is_not_followed_keeps_its_ratio_to_the_rival_at_its_side():
    """Nothing missing, 12 % of faint effects with it, and one effect that the run shows."""
    today = CurrentOdds(np.array([0.8, 0.08]), np.array([0.12, 0.0]), np.array([False, True]))
    left = ahead(np.full(N, 1.0), odds=today)
    assert left.truths == pytest.approx([0.8 / 0.92, 1.0], abs=1e-6)
    assert left.chances == pytest.approx([0.0, 1.0]) and left.of_effects == 1.0
    assert left.decided == pytest.approx(0.08 + 0.12)  # those not followed fare as the effect does
    beyond = ahead(np.full(N, 1.0), odds=replace(today, beyond=0.05))
    assert beyond.decided == pytest.approx(0.08 + 0.12 - 0.05) and beyond.of_effects == 1.0
    alone = ahead(np.full(N, 1.0), odds=CurrentOdds(np.array([0.92, 0.08]), np.zeros(2), np.array([False, True])))
    assert alone.decided == pytest.approx(1.0)


def test_what_the_records_do_not_show_is_followed_on_its_own():
    hidden = Explanation(("runout.roughness",), False, 0.0, 1e-3, False, 0.2, shown=False)
    nothing = Explanation((), False, 0.0, 1e-3, True, 0.9, unseen=(hidden,))
    beyond = Explanation((), True, 0.0, 1e-3, True, 0.1)
    assert nothing.shown_probability == pytest.approx(0.7)
    found = rivals_of((nothing, beyond))
    assert [(e.effects, e.probability) for e in found] == [((), pytest.approx(0.7)), (hidden.effects, 0.2)]


def stub_looks(first, close, rivals=2):
    """Looks whose outlooks are given: entropies of first looks, and of close ones by number."""
    looks = ExperimentRanking.__new__(ExperimentRanking)
    looks.progress, looks.close_looks = lambda: None, []
    rig = options(load_machine("plain_rotor"), trials(load_machine("plain_rotor")), ())
    looks.options, looks.trials, looks.means = rig, [None] * len(rig), [None] * len(rig)
    looks.forecast = SimpleNamespace(columns=lambda *a, **k: [{}])
    made = {i: Proposal(rig[i], Outlook(h, 0.5, 0.5, np.zeros(2), np.zeros(2)), *how) for i, (h, *how) in first.items()}
    looks._first_looks = lambda: made

    def look(i, columns, closely):
        looks.close_looks.append(i)
        return Proposal(rig[i], Outlook(close[i], 0.5, 0.5, np.zeros(2), np.zeros(2)))

    looks._look = look
    return looks


def test_a_run_whose_first_look_is_exact_is_ranked_with_those_seen_closely():
    """Runs without sensitivities promise everything at first; seen closely they do nothing, the usual one decides."""
    first = {0: (0.1, True), **{i: (0.0, False, True) for i in range(1, 9)}}
    looks = stub_looks(first, dict.fromkeys(range(1, 9), 1.0))
    found = looks.ranked()
    assert found[0].option == looks.options[0] and 0 not in looks.close_looks
    assert ExperimentPlan(1.0, ("a", "b"), found, odds=(0.5, 0.5)).settles


def test_the_best_that_helps_is_proposed_before_a_cheaper_one_that_does_not():
    rig = options(load_machine("plain_rotor"), trials(load_machine("plain_rotor")), ())
    cheap, dear = (
        Proposal(o, Outlook(h, 0.5, 0.5, np.zeros(2), np.zeros(2))) for o, h in zip(rig, (0.20, 0.185), strict=False)
    )
    plan = ExperimentPlan(0.20, ("a", "b"), (), odds=(0.97, 0.03)).with_proposals((cheap, dear))
    assert plan.settles and plan.proposals == (dear, cheap) and plan.first(60.0) is dear
    assert plan.sentence.startswith("Settled already, 97 % a; what confirms or refutes it best")
    assert "one explanation gets 80 %" in replace(plan, odds=(0.7, 0.3), sure=0.8).sentence


def test_explanations_that_no_run_separates_are_those_whose_difference_is_small():
    looks = stub_looks({}, {})
    looks.apart = np.array([[0.0, 4.0, 0.0], [4.0, 0.0, 100.0], [0.0, 100.0, 0.0]])
    assert looks.inseparable(("a", "b")) == [
        "no allowed experiment separates a from b: after re-fitting they differ by at most 2.0 standard deviations "
        "in any experiment that was looked at"
    ]  # the third is of the explanations that the records do not show


def test_one_probe_of_records_is_that_of_their_plan_too():
    rig = load_machine("plain_rotor")
    one = [replace(t, probe_angle=0.3) for t in trials(rig)]
    assert {o.probe_angle for o in options(rig, one, ())} == {0.3}
    assert all(o.trial(rig).channels == ("probe at 17.19 deg",) for o in options(rig, one, ("speed",)))


def test_first_looks_scale_by_what_drives_and_the_usual_size_is_first():
    rig = load_machine("dtu_gas_bearing")
    found = [o for o in options(rig, trials(rig), ("amplitude", "bias", "axis"))]
    usual = found[0].trial(rig)
    assert found[0].experiment.amplitude == 1.0
    column = {(-1, "x"): np.ones(len(make_layout([usual]).record))}
    sizes = [in_proportion(column, usual, o.trial(rig))[-1, "x"].max() for o in found]
    assert sizes == pytest.approx([1.0, 1.0, 2.0, 1.0, 1.0, 1.0, 1.0], rel=1e-6)  # 1, .25, 2 V; axes; biased


def test_entropy_left_is_that_of_two_normal_numbers():
    """One number, two rivals d apart: the mean entropy by quadrature."""
    d = 2.0
    y = np.linspace(-12, 14, 20001)
    p = 1 / (1 + np.exp(d * y - d**2 / 2))
    h = -(p * np.log2(p) + (1 - p) * np.log2(1 - p))
    exact = float(np.nansum(h * np.exp(-(y**2) / 2)) * (y[1] - y[0]) / np.sqrt(2 * np.pi))
    found = np.mean([
        outlook(EVEN, [PredictedResponse(np.full(1, x), np.zeros((1, 1)), np.zeros((1, 1))) for x in (0.0, d)],
                np.ones(1), 1.0, seed).entropy
        for seed in range(60)
    ])  # fmt: skip
    assert found == pytest.approx(exact, abs=0.03)


def trials(machine):
    """Two records' places without data."""
    rows = np.zeros((10, 6))
    rows[:, 0], rows[:, 1] = 200.0, 0.4e6 if machine.fed else 0.0
    one = Trial("a", "fit", rows, float(rows[0, 1]), 0.0, 0, 10, 1, np.zeros((1, 2, 2), complex), np.zeros(2, bool))
    return [one, one]


def test_only_what_is_allowed_changes():
    rig = load_machine("dtu_gas_bearing")
    louder = options(rig, trials(rig), ("amplitude",))
    assert {(o.speed, o.pressure) for o in louder} == {(200.0, 0.4e6)}
    assert len({o.experiment.amplitude for o in louder}) == 3
    faster = options(rig, trials(rig), ("speed",))
    assert {o.pressure for o in faster} == {0.4e6} and len({o.speed for o in faster}) == 7
    assert all(isinstance(o.experiment, Multisine) and o.minutes > 2 for o in louder)


def test_everything_allowed_is_two_hundred_experiments_and_each_has_a_trial():
    rig = load_machine("dtu_gas_bearing")
    found = options(rig, trials(rig), ALLOWED)
    assert 190 < len(found) < 230 and len({o.name for o in found}) == len(found)
    assert {type(o.experiment).__name__ for o in found} == {"Multisine", "Staircase", "Steady", "Coastdown"}
    assert {o.experiment.axis for o in found if isinstance(o.experiment, Multisine)} == {"both", "x", "y"}
    weighed = next(o for o in found if o.weight is not None)
    assert weighed.minutes > 12 and "trial weight" in weighed.name
    changed = weighed.trial(rig).changes
    assert set(changed) <= {"unbalance.0.me~phase.c", "unbalance.0.me~phase.s"} and changed
    assert next(o for o in found if isinstance(o.experiment, Coastdown)).trial(rig).orders == (1, 2, 3)


def test_a_machine_without_actuators_is_hit_and_has_no_pressure():
    kit = load_machine("bently_rk4")
    found = options(kit, trials(kit), ())
    assert {type(o.experiment) for o in found} == {Impact, Steady, Coastdown}
    assert all(o.pressure == 0 for o in found)
    highest = kit.drive.highest_speed or np.inf
    assert max(o.speed for o in found) <= highest


def test_what_cannot_change_is_refused_with_the_choice():
    assert check_allowed(()) == tuple(ALLOWED)
    with refused(DataError, "allow", "coast-dwn"):
        check_allowed(("speed", "coast-dwn"))
    rotor = load_machine("plain_rotor")
    with refused(DataError, "allow", "bias"):
        options(rotor, trials(rotor), ("bias",))
    with refused(DataError, "allow", "pressure"):
        options(rotor, trials(rotor), ("speed", "pressure"))


def test_vectors_of_a_run_up_are_followed_by_other_run_ups():
    kit = load_machine("bently_rk4")
    speeds = np.linspace(50.0, 250.0, 20)
    like = replace(empty_sweep(speeds, 0.0, (1,)), probe_angle=np.deg2rad(45.0))
    found = options(kit, [like], ())
    assert {type(o.experiment) for o in found} == {Runup, Coastdown, Steady}
    slow = next(o for o in found if isinstance(o.experiment, Steady))
    assert slow.trial(kit).probe_angle == like.probe_angle and not slow.trial(kit).orders
    assert {round(np.degrees(o.probe_angle)) for o in found} == {0, 45, 90, 135}
    assert any(o.weight for o in found)
    trial = found[0].trial(kit)
    assert trial.spectra.shape == (1, 2, 21) and trial.turns == like.turns
    with refused(DataError, "allow", "amplitude"):
        options(kit, [like], ("amplitude",))


@pytest.mark.parametrize("name", ["dtu_gas_bearing", "plain_rotor"])
def test_every_kind_of_experiment_is_a_plan_that_a_campaign_runs(name, tmp_path):
    machine = load_machine(name)
    kinds = {(type(o.experiment), o.weight is None): o for o in options(machine, trials(machine), ())}
    for number, option in enumerate(kinds.values()):
        best = Proposal(option, Outlook(0.1, 0.9, 0.9, np.array([0.9, 0.9]), np.array([0.9, 0.9])))
        plan = ExperimentPlan(1.0, ("a", "b"), (best,), odds=(0.5, 0.5))
        (tmp_path / f"{number}.toml").write_text(plan.campaign(machine, name))
        loaded = load_plan(tmp_path / f"{number}.toml")
        assert len(list(loaded.cases())) == 1
        assert "90 % chance" in plan.sentence
    assert campaign(machine)


def test_what_no_experiment_separates_is_stated_with_the_reason():
    tie = Explanation(("shaft_bow.bow",), False, 10.0, 0.0, True, 0.9, (("runout.amplitude_1x",),))
    sentence = "no experiment separates shaft_bow.bow from runout.amplitude_1x: vector that turns with the shaft"
    assert _of_class(tie) == sentence
    dull = Proposal(options(load_machine("plain_rotor"), trials(load_machine("plain_rotor")), ())[0],
                    Outlook(0.99, 0.0, 0.0, EVEN.odds, np.zeros(2)))  # fmt: skip
    assert ExperimentPlan(1.0, ("a", "b"), (dull,)).sentence == "No allowed experiment separates a from b."
    assert ExperimentPlan(0.0, ("a",), ()).sentence.startswith("No next experiment")


def test_separation_is_the_distance_that_re_fitting_leaves():
    column = np.linspace(0, 1, N)[:, None]
    far = [predicted(np.zeros(N), 1e4 * column), predicted(3.0 * column[:, 0])]
    assert separation(far, np.ones(N))[0, 1] == pytest.approx(float(np.sum((3.0 * column) ** 2)))
    both = [predicted(np.zeros(N), 1e4 * column), predicted(3.0 * column[:, 0], 1e4 * column)]
    assert separation(both, np.ones(N))[0, 1] < 1e-3


@pytest.mark.parametrize("temperature", [1.0, 4.0])
def test_the_predictive_density_is_what_a_new_record_adds_to_the_evidence(temperature):
    """Evidence of old and new records together less that of the old ones, of a linear model with one form error."""
    rng = np.random.default_rng(3)
    old, new, sd = rng.normal(size=(30, 2)), rng.normal(size=(20, 2)), np.array([1.5, 0.7])
    y = np.concatenate([old, new]) @ [0.8, -0.4] + rng.normal(size=50)
    none = ModelForm(np.zeros((30, 1)), np.zeros(1))
    both = ModelForm(np.zeros((50, 1)), np.zeros(1))
    before = log_evidence(none, y[:30], old, sd, temperature)
    after = log_evidence(both, y, np.concatenate([old, new]), sd, temperature)
    H = old.T @ old / temperature + np.diag(sd**-2.0)
    root = np.linalg.inv(np.linalg.cholesky(H)).T
    density = PredictiveDensity.of(
        PredictedResponse(new @ (sd * before.value), new @ root, np.zeros((20, 1))), temperature
    )
    assert density.log(y[None, 30:])[0] == pytest.approx(after.log - before.log, abs=1e-9)
