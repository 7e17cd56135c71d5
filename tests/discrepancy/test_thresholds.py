"""Verdicts as thresholds on the odds: made-up odds of hypotheses that a search has accepted."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identification import make_record
from rotorsim.discrepancy import diagnosis
from rotorsim.discrepancy.calibration import COMPLIANCE_LIMITS, LOSS_LIMITS, LOSS_SD, FitParameter, ParameterPoint
from rotorsim.discrepancy.comparison import UNSTEADY, Misfit
from rotorsim.discrepancy.data_vector import own_scatter, scatter_of_repeats
from rotorsim.discrepancy.diagnosis import OTHER_FORCE, DiagnosisRun
from rotorsim.discrepancy.fit import FAR, NEAR, ParameterFit, covariance, far_off_file
from rotorsim.discrepancy.judge import (
    VERDICTS,
    AllEvidence,
    accuracy_notes,
    by_odds,
    growing,
    judged,
    seen_together,
    text_of,
    with_vibration,
    worse_than,
)
from rotorsim.discrepancy.machine_file import far_off, recalibrated_values
from rotorsim.discrepancy.records import make_trial
from rotorsim.discrepancy.verdict import (
    SURE,
    Explanation,
    SearchVerdict,
    joined_classes,
    one_of_each_class,
    preferred,
    shown_share,
    with_more,
    with_other,
)
from rotorsim.machine import load_machine

KNOWN = ("coupling.force_2x", "runout.amplitude_1x", "runout.amplitude_2x", "shaft_bow.bow")
COUPLING, RUNOUT, BOW = ("coupling.force_2x",), ("runout.amplitude_2x",), ("shaft_bow.bow",)


def fitted(keys, cost=10.0, gone=1.0):
    """A fitted hypothesis as far as a verdict looks at it."""
    return SimpleNamespace(keys=keys, fit=SimpleNamespace(cost=cost), gone=gone, failed=False)


def odds(*given, beyond=0.0, nothing=0.0):
    """Explanations with probabilities."""
    out = [Explanation(keys, False, 1.0, 1e-3, True, p) for keys, p in given]
    out += [Explanation((), True, 1.0, 1e-3, True, beyond), Explanation((), False, 1.0, 1e-3, True, nothing)]
    return tuple(sorted(out, key=lambda e: -e.probability))


def search(status, *hypotheses, rivals=()):
    """Result of a search."""
    best = hypotheses[0] if hypotheses else None
    classes = tuple((k,) for k in best.keys) if best else ()
    return SearchVerdict(status, best, tuple(rivals), classes, tuple(hypotheses))


def test_a_tie_of_the_search_is_a_name_where_one_explanation_has_95_percent():
    a, b = fitted(COUPLING), fitted(RUNOUT)
    found = by_odds(search("tie", a, b, rivals=[b]), odds((RUNOUT, 0.96), (COUPLING, 0.04)), KNOWN)
    assert (found.status, found.best, found.rivals) == ("named", b, ())


@pytest.mark.parametrize("status", ["named", "tie"])
def test_a_name_below_95_percent_is_a_tie_of_its_rivals(status):
    a, b = fitted(COUPLING), fitted(RUNOUT)
    found = by_odds(search(status, a, b, rivals=[b]), odds((COUPLING, 0.7), (RUNOUT, 0.3)), KNOWN)
    assert (found.status, found.best, found.rivals) == ("tie", a, (b,))


def test_a_class_stays_a_tie_however_probable_it_is():
    a = fitted(BOW)
    verdict = SearchVerdict("tie", a, (), (("runout.amplitude_1x", "shaft_bow.bow"),), (a,))
    assert by_odds(verdict, odds((BOW, 0.99)), KNOWN).status == "tie"


def test_no_name_where_something_else_is_more_likely_than_not():
    a = fitted(COUPLING)
    assert by_odds(search("named", a), odds((COUPLING, 0.4), beyond=0.6), KNOWN).status == "partial"


def test_what_is_within_the_error_of_the_models_form_is_no_disagreement():
    assert by_odds(search("unknown"), odds(nothing=0.96), KNOWN).status == "no_disagreement"
    a, b = fitted(COUPLING), fitted(RUNOUT)
    no_name = by_odds(search("tie", a, b, rivals=[b]), odds((RUNOUT, 0.04), nothing=0.96), KNOWN)
    assert (no_name.status, no_name.best, no_name.rivals) == ("no_disagreement", None, ())
    assert by_odds(search("unknown"), odds(nothing=0.9), KNOWN).status == "unknown"
    assert by_odds(search("unknown"), (), KNOWN).status == "unknown"


def test_a_partial_explanation_is_the_most_probable_that_helps():
    pair, one = fitted((*COUPLING, *BOW), 9.0, 0.37), fitted(BOW, 10.0, 0.34)
    found = by_odds(search("partial", pair, one), odds((BOW, 0.8), (pair.keys, 0.1), beyond=0.1), KNOWN)
    assert (found.status, found.best) == ("partial", one)
    weak = fitted(BOW, 10.0, 0.1)
    assert by_odds(search("partial", pair, weak), odds((BOW, 0.8), beyond=0.1), KNOWN).best == pair


def test_members_of_a_class_that_only_the_found_size_shows_are_one():
    a = fitted(COUPLING)
    verdict = SearchVerdict("tie", a, (), (("coupling.force_2x", "crack.loss"),), (a,))
    found = joined_classes(odds((COUPLING, 0.6), (("crack.loss",), 0.3), beyond=0.1), verdict)
    assert found[0].effects == COUPLING and found[0].probability == pytest.approx(0.9)
    assert found[0].alike == (("crack.loss",),) and len(found) == 3


def test_a_member_of_a_class_that_is_no_candidate_shares_the_probability_of_the_one_that_is():
    a = fitted(COUPLING)
    verdict = SearchVerdict("tie", a, (), (("coupling.force_2x", "withheld.size"),), (a,))
    first, *others = joined_classes(odds((COUPLING, 0.6), (BOW, 0.3), beyond=0.1), verdict)
    assert (first.effects, first.alike) == (COUPLING, (("withheld.size",),)) and first.probability == pytest.approx(0.6)
    assert not any(one.alike for one in others)


@pytest.mark.parametrize("best", [BOW, ("runout.amplitude_1x",)])
def test_a_class_has_the_name_of_the_verdicts_member_with_something_beyond_the_catalogue_too(best):
    """The headline and the probabilities name the same member."""
    other = ("runout.amplitude_1x",) if best == BOW else BOW
    a, classes = fitted(best), (("runout.amplitude_1x", "shaft_bow.bow"),)
    given = [Explanation(other, beyond, 1.0, 1e-3, True, p, (best,)) for beyond, p in ((True, 0.9), (False, 0.1))]
    found = joined_classes(given, SearchVerdict("partial", a, (), classes, (a,)))
    assert [(e.effects, e.beyond, e.probability, e.alike) for e in found] == [
        (best, True, 0.9, (other,)), (best, False, 0.1, (other,))
    ]  # fmt: skip


def test_classes_of_a_set_are_found_in_any_order():
    """Members of a class do not sort alike: a crack comes before the injector, an asymmetric shaft after a bow."""
    a, alike = fitted(("coupling.force_2x", "misfit.a")), ("misfit.b", "shaft.force_2x")
    verdict = SearchVerdict("tie", a, (), (("coupling.force_2x", "shaft.force_2x"), ("misfit.a", "misfit.b")), (a,))
    given = [Explanation(keys, False, 1.0, 1e-3, True, p) for keys, p in ((alike, 0.6), (a.keys, 0.3))]
    (found,) = joined_classes(given, verdict)
    assert (found.effects, found.alike) == (a.keys, (alike,)) and found.probability == pytest.approx(0.9)


def member(keys, cost, gain, held=0.0):
    """A fitted hypothesis next to a calibration whose only number stands at so many standard deviations."""
    number = FitParameter("gain", 0.1, 1.0, -6.0, 6.0)
    fit = ParameterFit((number,), ParameterPoint({number: gain}), np.ones(4), np.ones((4, 1)), cost)
    return SimpleNamespace(keys=keys, fit=fit, gone=1.0, failed=False, held_out=held, forms=keys)


@pytest.mark.parametrize(
    ("bow", "runout", "first"),
    [((927.0, 5.0, 0.0), (932.0, 1.0, 9.0), "runout"), ((927.0, 1.0, 9.0), (932.0, 1.0, 4.0), "runout"),
     ((927.0, 1.0, 4.0), (932.0, 5.0, 0.0), "bow"), ((927.0, 5.0, 0.0), (1927.0, 1.0, 0.0), "bow"),
     ((927.0, 1.0, 0.0), (932.0, 1.0, 0.0), "bow")],
)  # fmt: skip
def test_of_a_class_within_a_tie_the_member_is_named_whose_calibration_is_believed(bow, runout, first):
    """Then the one that leaves least at held-out points, then that which fits best; not one that fits clearly worse."""
    a, b = member(BOW, *bow), member(("runout.amplitude_1x",), *runout)
    base = ParameterFit((), ParameterPoint(), np.ones(4), np.ones((4, 0)), 2000.0)
    chosen = {"bow": a, "runout": b}[first]
    assert preferred(a, [a, b, member(COUPLING, 926.0, 0.0)], base, KNOWN) is chosen
    verdict = SearchVerdict("partial", a, (), (), (b, a))
    assert one_of_each_class(verdict, base, KNOWN).tried == (chosen,)


def group(times, record="held_out_1"):
    """A group of lines of a record that was not fitted, so many floors large."""
    return Misfit(record, "1500 rpm", "y", "1X", 2, 2 * times**2, times * 5e-8, 5e-8, 0.0, 0)


@pytest.mark.parametrize(
    ("accuracy", "scatter", "times", "shown"),
    [
        (5e-8, 5e-9, 1.0, ""), (5e-8, 7e-8, 1.0, ""), (1e-8, 5e-8, 1.0, "scatter of the records, 0.05 um"),
        (5e-7, 5e-9, 1.0, "0.5 um is coarser"), (5e-9, 4e-9, 8.0, "at most 0.4 um"), (0.0, 5e-8, 1.0, ""),
    ],
)  # fmt: skip
def test_a_stated_accuracy_that_contradicts_the_records_is_named(accuracy, scatter, times, shown):
    """Groups of lines are left with 0.05 um over that floor, or with eight times it."""
    accuracy = 5e-8 if times > 1 else accuracy
    found = accuracy_notes(accuracy, scatter, [group(times)])
    assert bool(found) == bool(shown) and all(shown in note for note in found)


def test_an_accuracy_below_the_scatter_of_a_record_is_named():
    """White noise of s makes the amplitudes of n samples scatter by s sqrt(2 / n); stated is a fifth of that."""
    t = np.arange(10000) * 2e-4
    angle, noise = 2 * np.pi * 40 * t, 1e-6
    motion = 5e-6 * np.column_stack([np.cos(angle), np.sin(angle)])
    motion += noise * np.random.default_rng(1).standard_normal(motion.shape)
    given = {"disc_measured": motion, "angle_measured": angle, "speed_measured": np.full(t.size, 2 * np.pi * 40)}
    trial = make_trial(make_record(t, given))
    scatter = noise * np.sqrt(2 / (trial.blocks * trial.length))
    found = own_scatter([trial], [trial.spectra])
    assert found == pytest.approx(scatter, rel=0.1)
    (note,) = accuracy_notes(scatter / 5, found, [group(1.0)])
    assert f"{1e6 * found:.2g} um, which counts" in note
    assert not accuracy_notes(scatter, found, [group(1.0)])


def test_an_accuracy_is_too_coarse_by_the_order_that_leaves_most_in_all_records():
    """One line of .1 um among twenty of .01 um: an accuracy of .5 um is ten times what 1X leaves, one of .1 um is not.

    Twenty quiet lines at 2X do not count against what 1X leaves.
    """
    lines = [group(0.2 if i else 2.0) for i in range(20)]
    quiet = [replace(one, group="2X", rms=1e-9) for one in lines]
    assert accuracy_notes(5e-7, 3e-9, [*lines, *quiet]) and not accuracy_notes(1e-7, 3e-9, [*lines, *quiet])


def test_the_scatter_of_repeats_is_that_of_their_loudest_line():
    """Amplitudes with a standard deviation of s in a real part, whatever the blocks scatter by."""
    rng, s, trials = np.random.default_rng(6), 2e-7, []
    own = {"orders": (), "rows": np.zeros((9, 6)), "start": 0, "length": 9, "speed": 100.0, "pressure": 0.0,
           "changes": {}, "probe_angle": None, "channels": ("x", "y")}  # fmt: skip
    for _ in range(12):
        lines = np.zeros((1, 2, 6), complex)
        lines[0, :, 2] = 5e-6 + s * (rng.standard_normal(2) + 1j * rng.standard_normal(2))
        trials.append(SimpleNamespace(**own, spectra=lines))
    assert scatter_of_repeats(trials) == pytest.approx(s, rel=0.3)
    assert scatter_of_repeats(trials[:2]) == 0.0


@pytest.mark.parametrize(
    ("growth", "scatter", "word"),
    [(0.08, 1e-8, "grows within the records by 8"), (-0.08, 1e-8, "falls within the records by 8"), (0.005, 1e-8, ""),
     (0.08, 1e-6, "")],
)  # fmt: skip
def test_a_machine_that_warms_up_is_not_steady(growth, scatter, word):
    """1X of 5 um that grows by one share in each of two parts of four records; scatter of a fifth of it shows none."""
    rng, blocks = np.random.default_rng(3), []
    trials = []
    for speed in 2 * np.pi * np.array([16.0, 22.0, 28.0, 34.0]):
        size = 5e-6 * np.array([1 - growth / 2, 1 + growth / 2])[:, None, None] * np.exp(0.7j)
        lines = np.where(np.arange(60) == round(speed / (2 * np.pi)), size, 0.0)
        lines = np.repeat(lines, 2, axis=1) + scatter * rng.standard_normal((2, 2, 60))
        trials.append(SimpleNamespace(orders=(), clock=0.0, blocks=2, speed=speed, channels=("x", "y"), spectra=lines,
                                      frequencies=np.arange(60.0)))  # fmt: skip
        blocks.append(lines - lines.mean(axis=0))
    found = growing(trials, blocks)
    assert bool(found) == bool(word) and word in found
    assert judged(AllEvidence(QUIET, GOOD, growing=found)).verdict.status == ("unknown" if word else "no_disagreement")


SIZES = {8.0: 0.4, 11.0: 0.8, 14.0: 1.6, 17.0: 3.0, 20.0: 6.0}
"""1X [um] of records by speed [Hz]."""


def vibrating(first, second, noise=3e-9):
    """Records of five speeds [Hz] with 1X and 2X [um] over the speed; what is left of them is 2X and noise."""
    rng, trials, blocks = np.random.default_rng(4), [], []
    for hertz in SIZES:
        left = 1e-6 * second(hertz) * np.exp(0.3j) * (np.arange(60) == 2 * hertz)
        left = left + noise * rng.standard_normal((2, 2, 60))
        own = {"orders": (), "clock": 0.0, "blocks": 2, "speed": 2 * np.pi * hertz, "channels": ("x", "y"), "hum": (),
               "accuracy": 5e-8, "excited": np.zeros(60, bool), "point": f"{60 * hertz:.0f} rpm, 0 V", "changes": {},
               "frequencies": np.arange(60.0)}  # fmt: skip
        trials.append(SimpleNamespace(**own, spectra=left + 1e-6 * first(hertz) * (np.arange(60) == hertz)))
        blocks.append(left)
    return trials, blocks


@pytest.mark.parametrize("noise", [3e-9, 0.0])
@pytest.mark.parametrize(
    ("second", "shown"),
    [(lambda y: 0.02 * y**2, True), (lambda y: 0.03 * y**2 * (y > 1.7), True), (lambda y: 0.1 + 0 * y, False),
     (lambda y: 0.05 * y, False), (lambda y: 0.001 * y**2, False)],
)  # fmt: skip
def test_a_harmonic_that_comes_with_the_vibration_is_no_peace(second, shown, noise):
    """2X [um] over 1X [um]: square, of a stop that is reached, constant, a share, and below the accuracy of 0.05 um."""
    trials, blocks = vibrating(SIZES.__getitem__, lambda hertz: second(SIZES[hertz]), noise)
    found = with_vibration(trials, blocks, lambda trial, order: np.ones(1))
    assert bool(found) == shown and ("1200 rpm" in found) == shown
    verdict = judged(AllEvidence(QUIET, GOOD, growing=found)).verdict
    assert verdict.status == ("unknown" if shown else "no_disagreement")


def rising(hertz, natural=34.5, zeta=0.01):
    """Response of a mode over its static one."""
    share = hertz / natural
    return 1 / np.hypot(1 - share**2, 2 * zeta * share)


@pytest.mark.parametrize(
    ("natural", "force", "given", "shown"),
    [(34.5, lambda y: 0.004, False, False), (34.5, lambda y: 0.004, True, False), (40.5, lambda y: 0.004, False, True),
     (40.5, lambda y: 0.004, True, False), (34.5, lambda y: 0.004 * y**2, True, True)],
)  # fmt: skip
def test_a_force_at_2x_near_a_natural_frequency_is_no_stop(natural, force, given, shown):
    """1X of an unbalance and 2X of a force [um] that is constant, or grows with the square of 1X, through one mode.

    With the mode at 34.5 Hz, 17 Hz has more 2X than 20 Hz, and less 1X; at 40.5 Hz the model alone excludes a stop.
    """

    def first(hertz):
        return 2 * (hertz / 8) ** 2 * rising(hertz, natural) / rising(8.0, natural)

    def answers(trial, order):
        return np.array([rising(order * trial.speed / (2 * np.pi), natural) if given else 1.0])

    trials, blocks = vibrating(first, lambda hertz: force(first(hertz) / 2) * rising(2 * hertz, natural))
    assert bool(with_vibration(trials, blocks, answers)) == shown


@pytest.mark.parametrize(
    ("named", "more", "noted"),
    [(False, (), True), (True, (), False), (False, (UNSTEADY, 14.0), False), (False, (UNSTEADY, 4.0), True),
     (False, ("between", 14.0), False)],
)  # fmt: skip
def test_an_accuracy_is_doubted_only_where_nothing_is_found_and_it_would_end_the_disagreement(named, more, noted):
    """A line 8 times beyond the floor is a finding where it has a name; tones between blocks of 14 floors stay."""
    groups = [group(8.0)]
    for name, times in [more] if more else []:
        groups.append(Misfit("r", "1500 rpm", "y", name, 400, 400 * times**2, times * 5e-8, 5e-8, 0.0, 0))
    assert bool(accuracy_notes(5e-8, 4e-9, groups, named)) == noted


def certain(found):
    """Explanations without anything beyond the catalogue, by their probability."""
    return {e.effects: e.probability for e in found.odds if not e.beyond}


QUIET = SearchVerdict("no_disagreement")
GOOD = odds(nothing=0.97, beyond=0.03)


@pytest.mark.parametrize(
    ("more", "status"),
    [
        ({}, "no_disagreement"),
        ({"unexplained": 0.79}, "unknown"),
        ({"unexplained": 0.79, "large": ("a bearing is softer",)}, "unknown"),
        ({"left": (group(1.5), group(30.0))}, "unknown"),
        ({"worse": ("untouched_1",)}, "unknown"),
        ({"large": ("a bearing is softer",)}, "recalibrated"),
        ({"large": ("a bearing is softer",), "left": (group(30.0),)}, "unknown"),
        ({"scatter_known": False}, "unknown"),
        ({"scatter_known": False, "large": ("a bearing is softer",)}, "recalibrated"),
        ({"late": "the probes are late", "large": ("a bearing is softer",)}, "unknown"),
    ],
)
def test_no_disagreement_follows_from_all_evidence(more, status):
    """1.5 um at a held-out point over .05 um, or a calibration far off: never nothing to be recorded."""
    found = judged(AllEvidence(QUIET, GOOD, **more))
    assert found.verdict.status == status
    # what stays unexplained has its note where it is counted
    noted = "scatter_known" in more or (status == "unknown" and "unexplained" not in more)
    assert bool(found.notes) == noted
    assert status != "unknown" or (certain(found) == {}) == (not more.keys() & {"scatter_known", "late"})


@pytest.mark.parametrize(("nothing", "status"), [(0.4, "unknown"), (0.6, "unknown"), (0.9, "no_disagreement")])
def test_no_disagreement_needs_more_than_an_even_chance_that_nothing_is_missing(nothing, status):
    """A machine with a missing effect had passed with 60 % for nothing missing."""
    found = judged(AllEvidence(QUIET, odds((COUPLING, 1 - nothing), nothing=nothing)))
    assert found.verdict.status == status and bool(found.notes) == (status == "unknown")
    assert (
        judged(AllEvidence(QUIET, odds((COUPLING, 0.4), nothing=0.6), left=(group(4.9),))).verdict.status == "unknown"
    )


@pytest.mark.parametrize("more", [{"together": "all"}, {"growing": "1X grows"}, {"late": "the probes are late"}])
def test_odds_without_a_flagged_line_state_how_often_such_a_verdict_is_met(more):
    """All records refute nothing missing: .05 of .40 + .15 of .55 + .05, whatever odds the lines alone give.

    Late probes refute nothing: the odds stay.
    """
    given = odds((COUPLING, 0.06), nothing=0.9, beyond=0.04)
    found = judged(AllEvidence(QUIET, given, flagged=False, **more))
    assert found.verdict.status == "unknown" and found.reason == next(iter(more.values()))
    wanted = np.array([0.4 * 0.05, 0.55 * 0.15, 0.05])
    wanted = np.array([0.9, 0.06, 0.04]) if "late" in more else wanted / wanted.sum()
    assert [certain(found)[()], certain(found)[COUPLING]] == pytest.approx(wanted[:2], abs=1e-3)
    assert sum(e.probability for e in found.odds if e.beyond) == pytest.approx(wanted[2], abs=1e-3)


@pytest.mark.parametrize(
    ("shares", "more", "status"),
    [((0.6, 0.0), {}, "tie"), ((0.4, 0.0), {}, "unknown"), ((0.3, 0.3), {}, "tie"),
     ((0.6, 0.0), {"growing": "1X grows"}, "unknown")],
)  # fmt: skip
def test_an_effect_that_other_points_prefer_is_a_tie_where_the_calibration_alone_does_not_stand(shares, more, status):
    """A gain of a probe lowers the sum of squares by 60, too little for a name; a motion that grows is not its work.

    Nor is it one of a tie where the odds are against it and those that are alike.
    """
    (first, second), one, other = shares, fitted(COUPLING), fitted(RUNOUT)
    given = odds((COUPLING, first), (RUNOUT, second), nothing=0.9 - first - second, beyond=0.1)
    found = judged(AllEvidence(QUIET, given, frozenset(KNOWN), flagged=False, faint=(one, other), **more))
    assert found.verdict.status == status and (found.verdict.best is one) == (status == "tie")
    assert judged(AllEvidence(QUIET, GOOD, frozenset(KNOWN), flagged=False, faint=(one,))).verdict.best is None


def test_more_points_count_in_odds_to_the_same_power():
    """A fall of 8 at other points is a factor e of the likelihood to the power 1/4."""
    found = with_more(odds((COUPLING, 0.5), nothing=0.5, beyond=0.0), {COUPLING: 8.0})
    by = {e.effects: e.probability for e in found if not e.beyond}
    assert by[COUPLING] / by[()] == pytest.approx(np.e)


@pytest.mark.parametrize(
    ("falls", "share"),
    [({COUPLING: 1e3, RUNOUT: 7e2}, 1.0), ({COUPLING: 1e6}, 0.1),
     ({COUPLING: 1e3, RUNOUT: 8.0}, 0.1 * np.e / (0.9 + 0.1 * np.e))],
)  # fmt: skip
def test_more_points_settle_nothing_and_leave_the_others_their_own_proportions(falls, share):
    """Two effects and nothing have .025, .0975 and .8775: the first gets no name, whatever the points would give it.

    The others share what is left as they would without it: to the power 1/4 a fall of 700 is all, one of 8 a factor e.
    """
    found = with_more(odds((COUPLING, 0.025), (RUNOUT, 0.0975), nothing=0.8775), falls)
    by = {e.effects: e.probability for e in found if not e.beyond}
    assert sum(e.probability for e in found) == pytest.approx(1.0) and found[0].effects == COUPLING
    assert by[RUNOUT] == pytest.approx((1 - by[COUPLING]) * share)
    assert by_odds(search("named", fitted(COUPLING)), found, KNOWN).status == "tie"
    assert by[COUPLING] < SURE and shown_share(by[COUPLING]) == "94 %"
    sure = with_more(odds((COUPLING, 0.97), nothing=0.03), {COUPLING: 1e3})
    assert sure[0].probability == pytest.approx(0.97)


@pytest.mark.parametrize("status", ["no_disagreement", "recalibrated"])
def test_lines_left_where_nothing_was_fitted_change_headline_and_next_step(status):
    large = ("a bearing is softer",) if status == "recalibrated" else ()
    found = judged(AllEvidence(QUIET, GOOD, left=(group(4.9), group(2.0)), large=large))
    assert (found.verdict.status, found.left) == (status, 2) and "4.9" not in VERDICTS[status].sentence
    assert "held_out_1 (1500 rpm), y, 1X: 0.245 um over a floor of 0.05 um" in found.notes[0]
    own = text_of(status, found.left)
    assert "stay beyond the floor: 2." in own.sentence and own.exit_code == VERDICTS[status].exit_code
    for text in (own.sentence, own.meaning, own.next):
        assert "every group" not in text and "Nothing needs" not in text and "the records agree" not in text
    assert text_of(status) == VERDICTS[status]


@pytest.mark.parametrize(("times", "status"), [(0, "named"), (3.0, "named"), (40.0, "partial")])
def test_a_name_has_to_hold_at_points_that_were_not_fitted(times, status):
    """Something else is missing if 40 floors are left at a held-out point and 55 % of the gap are gone."""
    one, left = fitted(COUPLING), (group(times),) if times else ()
    evidence = AllEvidence(
        search("named", one), odds((COUPLING, 0.99), nothing=0.01), frozenset(KNOWN), left, gone=0.55
    )
    found = judged(evidence)
    assert (found.verdict.status, bool(found.notes)) == (status, times > 0) and found.verdict.best is one
    assert (text_of(status, found.left).sentence == VERDICTS[status].sentence) == (times != 3.0)
    assert (COUPLING in certain(found)) == (status == "named")


def test_a_name_holds_where_it_leaves_less_than_its_own_form_error():
    """40 floors of a line of 800 that the effect makes are its form; those of another line refute it."""
    given = odds((COUPLING, 0.99), nothing=0.01)
    left = (group(40.0), group(30.0, "held_out_2"))
    for of_form, status in ((left, "named"), (left[:1], "partial"), ((), "partial")):
        evidence = AllEvidence(search("named", fitted(COUPLING)), given, frozenset(KNOWN), left, of_form, gone=0.9)
        assert (judged(evidence).verdict.status, judged(evidence).left) == (status, 2)


@pytest.mark.parametrize(("times", "records", "shown"), [(1.37, 36, True), (1.37, 9, False), (1.0, 36, False)])
def test_what_all_records_show_together_is_no_peace(times, records, shown):
    """A stop of .07 um: nowhere a group beyond its floor, and a chance of one in 80 000 at 1X of all records."""
    groups = [group(times) for _ in range(records)]
    found = seen_together([*groups, replace(group(9.0), speed=150.0)])
    assert bool(found) == shown and (not shown or "1X of all records" in found)
    assert judged(AllEvidence(QUIET, GOOD, together=found)).verdict.status == "no_disagreement"  # 97 %
    verdict = judged(AllEvidence(QUIET, odds(nothing=0.94, beyond=0.06), together=found))
    assert verdict.verdict.status == ("unknown" if shown else "no_disagreement")
    assert (found in verdict.notes) == shown and (certain(verdict) == {}) == shown


@pytest.mark.parametrize("status", ["unknown", "partial", "named"])
def test_a_calibration_that_makes_untouched_records_worse_is_noted_whatever_the_verdict(status):
    one = fitted(COUPLING)
    given = search(status, *([one] if status != "unknown" else []))
    more = {"worse_alone": ("untouched_1",)}
    found = judged(AllEvidence(given, odds((COUPLING, 0.99), nothing=0.01), frozenset(KNOWN), gone=0.9, **more))
    assert found.verdict.status == status
    # with the effect that is named the calibration may well be the better one
    assert found.worse == (() if status == "named" else ("untouched_1",))
    assert any("untouched_1" in note for note in found.notes) == (status != "named")


def test_odds_never_name_what_the_verdict_does_not():
    """'unknown' above '97 %: sensor_gain.x' contradicts itself; that gain with something else does not."""
    found = judged(AllEvidence(search("unknown"), odds((RUNOUT, 0.97), beyond=0.02, nothing=0.01)))
    assert found.verdict.status == "unknown" and certain(found) == {(): 0.01}
    assert sum(e.probability for e in found.odds) == pytest.approx(1.0)
    assert found.odds[0].effects == RUNOUT and found.odds[0].beyond


@pytest.mark.parametrize(("astray", "status"), [((), "named"), (("shaft_stiffness",), "partial")])
def test_an_effect_that_needs_numbers_which_are_not_believed_is_no_name(astray, status):
    """A modulus far from that of steel next to a seal is a softer bearing as well."""
    given = odds((COUPLING, 0.99), nothing=0.01)
    found = judged(AllEvidence(search("named", fitted(COUPLING)), given, frozenset(KNOWN), astray=astray))
    assert found.verdict.status == status and any("shaft_stiffness" in note for note in found.notes) == bool(astray)
    assert sum(e.probability for e in found.odds if e.effects and not e.beyond) == (0.0 if astray else 0.99)


def test_nothing_missing_is_not_probable_where_points_that_were_not_fitted_refute_it():
    assert certain(judged(AllEvidence(QUIET, GOOD, left=(group(30.0),)))) == {}


@pytest.mark.parametrize("share", [0.2, 0.9])
def test_names_that_untouched_records_do_not_confirm_leave_no_odds_behind(share):
    one = fitted(COUPLING)
    found = judged(
        AllEvidence(search("named", one), odds((COUPLING, 0.99), nothing=0.01), frozenset(KNOWN), gone=share)
    )
    assert (found.verdict.status == "named") == (share > 0.5)
    assert (COUPLING in certain(found)) == (share > 0.5)


@pytest.mark.parametrize(("factor", "large"), [(0.35, True), (0.85, False), (1.15, False), (2.0, True)])
def test_a_bearing_far_from_its_file_is_a_finding_with_place_size_and_interval(factor, large):
    """Compliance 1 / k changes by s: k' = k / (1 - s); the standard deviation of k' is k' sd / (1 - s)."""
    machine, s = load_machine("plain_rotor"), 1 - 1 / factor
    rows = {row.path: row for row in recalibrated_values(machine, {"bearing.1.kx": (s, 0.01)})}
    row, before = rows["bearings.1.kxx"], machine.bearings[1].kxx
    assert (row.before, row.large) == (before, large)
    assert row.value == pytest.approx(factor * before) and row.sd == pytest.approx(row.value * 0.01 * factor)
    assert machine.bearing_names[1] in row.sentence
    assert ("softer" if factor < 1 else "stiffer") in row.sentence
    vague = recalibrated_values(machine, {"bearing.1.kx": (s, 3.0)})[0]
    assert not vague.large


def test_a_stiffness_alone_is_no_finding_about_the_damping():
    """The damping c (1 + l) / (1 - s)^2 of a softer bearing is that of the file where no record narrows its loss."""
    machine = load_machine("plain_rotor")
    for loss in ({}, {"bearing.1.cx": (0.0, 0.45)}):
        rows = recalibrated_values(machine, {"bearing.1.kx": (-2.0, 0.05)} | loss)
        assert [row.path for row in rows] == ["bearings.1.kxx"]
    rows = recalibrated_values(machine, {"bearing.1.kx": (-2.0, 0.05), "bearing.1.cx": (8.0, 0.1)})
    assert rows[1].value == pytest.approx(rows[1].before) and not rows[1].large


@pytest.mark.parametrize("together", [-0.9, 0.0, 0.9])
def test_the_scatter_of_a_damping_is_that_of_stiffness_and_loss_together(together):
    """Standard deviation of log c' = log(1 + l) - 2 log(1 - s) for small scatters, by drawn pairs."""
    machine, s, loss, sd = load_machine("plain_rotor"), -0.5, 0.4, (0.01, 0.02)
    known = {"bearing.1.kx": (s, sd[0]), "bearing.1.cx": (loss, sd[1])}
    row = recalibrated_values(machine, known, {"bearing.1.cx": together})[1]
    V = np.outer(sd, sd) * [[1, together], [together, 1]]
    drawn = np.random.default_rng(0).multivariate_normal((s, loss), V, 20000)
    share = np.std(np.log1p(drawn[:, 1]) - 2 * np.log1p(-drawn[:, 0]))
    assert row.sd / row.value == pytest.approx(share, rel=0.03)


@pytest.mark.parametrize(("sd", "shown"), [(0.05, True), (0.2, True), (0.3, False)])
def test_a_lost_damping_is_judged_by_the_interval_of_the_damping_itself(sd, shown):
    """A hundredth of the damping, +- 5 to 20 % of it: of its logarithm the interval would have no end.

    Where the records do not narrow it, its loss is the finding.
    """
    machine = load_machine("plain_rotor")
    found = {"bearing.1.kx": (0.0, 1e-3), "bearing.1.cx": (-0.99, sd)}
    rows = recalibrated_values(machine, found)[1:]
    assert len(rows) == shown and all(row.large for row in rows)
    assert [row.sd / row.before for row in rows] == pytest.approx([sd] * shown, rel=0.01)
    assert list(far_off(machine, found, {}, ["bearing.1.cx"])) == ["bearing.1.cx"]


def test_a_bearing_of_a_third_of_its_stiffness_can_keep_its_damping():
    lowest = 1 / (1 - COMPLIANCE_LIMITS[0]), 1 / (1 - COMPLIANCE_LIMITS[1])
    for factor in (0.35, *lowest):
        assert LOSS_LIMITS[0] - 1e-9 <= factor**-2 - 1 <= LOSS_LIMITS[1] + 1e-9


@pytest.mark.parametrize(
    ("before", "after", "worse"), [(3.0, 3.9, ()), (3.0, 4.1, ("a",)), (0.0, 3.0, ("a",)), (3.0, 1, ())]
)
def test_a_calibration_is_worse_by_the_floor_at_least(monkeypatch, before, after, worse):
    layout = SimpleNamespace(frequency=np.ones(4), record=np.zeros(4, int))
    comparison = SimpleNamespace(layout=layout, sigma=np.full(4, 5e-8), trials=[SimpleNamespace(name="a")])
    beyond = [SimpleNamespace(number=0)]
    monkeypatch.setattr("rotorsim.discrepancy.judge.beyond_floor", lambda *_: beyond)
    assert worse_than(comparison, np.full(4, before), np.full(4, after)) == worse


def test_strained_numbers_are_shown_in_words_and_not_by_their_keys():
    machine = load_machine("plain_rotor")
    found = {"unbalance.1.me~phase.c": (2e-4, 1e-6), "unbalance.1.me~phase.s": (1e-4, 1e-6),
             "bearing.1.cx": (9.0, 0.4), "actuator_x": (0.3, 0.01)}  # fmt: skip
    sentences = far_off(machine, found, {}, tuple(found))
    (own,) = machine.effects["unbalance"]
    me = abs(own.me * np.exp(1j * own.phase) + 2e-4 + 1e-4j)
    assert [key.partition(".")[0] for key in sentences] == ["effects", "effects", "bearing", "actuator_x"]
    sentences = list(sentences.values())
    assert sentences[0].startswith(f"me of unbalance 1 is {1e6 * me:.3g} g*mm +- 1 g*mm")
    assert sentences[1].startswith("phase of unbalance 1 is ") and "times" not in sentences[1]
    assert sentences[2] == f"the loss c / k^2 of {machine.bearings_in_words[1]} along x has changed by +900 % +- 40 %"
    assert sentences[3] == "the gain of the actuators along x has changed by +30 % +- 1 %"
    for key in ("~", "bearing.1", "actuator_x"):
        assert not any(key in sentence for sentence in sentences)


def test_a_strained_wave_that_the_machine_file_lacks_has_its_size():
    machine = load_machine("plain_rotor")
    bare = machine.with_({"effects": {k: list(v) for k, v in machine.effects.items() if k != "unbalance"}})
    wave = {"unbalance.0.me~phase.c": (3e-4, 1e-6), "unbalance.0.me~phase.s": (4e-4, 1e-6)}
    (sentence,) = far_off(bare, wave, {}, tuple(wave)).values()
    assert sentence == "me of unbalance is 500 g*mm +- 1 g*mm, the file has none"


def far_fit(number, **changes):
    """Fit with one bearing far from the file; a loss whose name ends with _ is hardly seen, so that its sd is large."""
    values, seen = {}, []
    for i in (0, 1):
        for what in ("kx", "ky", "cx", "cy"):
            far, usual = FAR[what[0]], NEAR if what[0] == "k" else LOSS_SD
            own = changes.get(what, 0.0) if i == number else 0.0
            values[FitParameter(f"bearing.{i}.{what}", 0.1, far if i == number else usual)] = own
            seen.append(2.0 if what[0] == "c" else 50.0)
    J = np.vstack([np.diag(seen), np.diag(seen)])
    return ParameterFit(tuple(values), ParameterPoint(values), np.zeros(len(J)), J, 0.0)


SOFT = far_fit(0, kx=-2.0, ky=-2.0, cx=8.0, cy=8.0)
"""Left bearing of a third of its stiffness, with the damping of the file."""


@pytest.mark.parametrize(
    ("fit", "far", "names"),
    [
        (SOFT, "0", ["bearing.0.kx", "bearing.0.ky"]),
        (far_fit(1, kx=0.19, cx=2.0), "1", ["bearing.1.cx"]),
        (far_fit(1, kx=0.25, cx=2.0), "1", ["bearing.1.kx", "bearing.1.cx"]),
        (far_fit(1, kx=0.19, cx=0.3), "1", ["bearing.1.kx"]),
        (far_fit(-1), "", []),
    ],
)
def test_a_far_bearing_always_has_a_number_that_is_off_the_file(fit, far, names):
    assert far_off_file(fit, far) == names


def run_of_two_records():
    """Run of a diagnosis, with records as far as the covariance of `far_fit` needs them."""
    layout = SimpleNamespace(record=np.repeat([0, 1], len(SOFT.parameters)))
    parts = {"fit": SimpleNamespace(layout=layout, scatter_known=True)}
    return DiagnosisRun(load_machine("plain_rotor"), None, parts, (), (), 0.01, lambda stage, most=0: None)


def test_a_far_calibration_is_a_finding_where_a_number_is_off_beyond_its_own_uncertainty():
    """A probe that reads less asks for a compliance of 0.25 +- 0.1 and a loss of -99 % +- 290 % of one bearing."""
    run, sharp = run_of_two_records(), far_fit(1, kx=0.25, cx=-0.99)
    assert run._clearly_off("1", sharp)
    assert not run._clearly_off("1", replace(sharp, J=0.1 * sharp.J))
    assert run._clearly_off("1", replace(far_fit(1, kx=0.7), J=0.1 * sharp.J))
    assert run._clearly_off("", far_fit(-1))
    run.fitted.scatter_known = False  # three times the floor leaves them at .25 +- .06 and at -99 % +- 100 %
    assert not run._clearly_off("1", sharp)
    assert run._clearly_off("1", far_fit(1, kx=0.7))
    found = judged(AllEvidence(QUIET, GOOD, unclear="no number is"))
    assert found.verdict.status == "unknown" and "no number is" in found.notes
    assert all(e.beyond for e in found.odds)


@pytest.mark.parametrize(("seen", "status"), [(2.0, "recalibrated"), (0.02, "unknown")])
def test_what_is_far_once_the_calibration_has_converged_is_judged(seen, status):
    """The calibration is near the file; converged, the damping of a bearing is gone, as far as the records see that.

    It is a place then, or no peace: nothing missing has 97 % and loses it.
    """
    run, base = run_of_two_records(), far_fit(-1)
    damping = FitParameter("bearing.1.cx", 0.1, LOSS_SD, *LOSS_LIMITS)
    J = np.full((len(base.J), 1), seen)
    gone = ParameterFit((damping,), ParameterPoint({damping: LOSS_LIMITS[0]}), np.zeros(len(J)), J, 0.0)
    run.place, run.converged = "", (base, gone, covariance(gone, run.fitted.layout.record))
    run._settle(base)
    assert (run.far_bearings, bool(run.unclear)) == (((1,), False) if status == "recalibrated" else ((), True))
    found = judged(AllEvidence(QUIET, GOOD, large=run.large, unclear=run.unclear, flagged=False))
    assert found.verdict.status == status and found.reason == run.unclear
    assert (certain(found)[()] > 0.9) == (status == "recalibrated")


def hypothesis(effect, cost):
    """A fitted hypothesis of one effect."""
    return SimpleNamespace(failed=False, keys=(effect,), forms=(SimpleNamespace(effect=effect),),
                           fit=SimpleNamespace(cost=cost))  # fmt: skip


@pytest.mark.parametrize(("effect", "cost", "acts"), [("labyrinth_seal", 27.0, True), ("shaft_bow", 52.0, False),
                                                      ("sensor_delay", 27.0, False)])  # fmt: skip
def test_a_delay_is_refused_where_it_is_better_than_the_effects_that_were_fitted(effect, cost, acts):
    """Nothing is refused where none was fitted: a seal that the calibration takes up fits with early probes too."""
    run = run_of_two_records()
    run.late, run.tried = SimpleNamespace(fit=SimpleNamespace(cost=37.0)), (hypothesis(effect, cost),)
    assert run._acts_late() == acts
    run.tried = ()
    assert run._acts_late()


def test_effects_that_help_and_are_no_name_are_stated_with_what_a_name_takes():
    run, base = run_of_two_records(), SimpleNamespace(cost=72.0)
    run.tried = (hypothesis("a", 27.0), hypothesis("b", 25.0), hypothesis("c", 43.0))
    (note,) = run._hints(base)
    assert "with b or a the sum of squares falls by 47" in note and "takes 100" in note
    assert run._hints(SimpleNamespace(cost=40.0)) == []


def test_places_that_records_do_not_distinguish_are_all_findings():
    """A far loss that the records hardly narrow had no sentence, and took that of the other place away."""
    loss, run = far_fit(1, kx=0.19, cx=2.0), run_of_two_records()
    left, right = run.machine.bearings_in_words
    ((both,), bearings), (one, number) = run._large([("0", SOFT), ("1", loss)]), run._large([("1", loss)])
    assert left in both and right in both and len(one) == 1 and right in one[0] and "+200 %" in one[0]
    assert (bearings, number) == ((0, 1), (1,))
    (softer,), _ = run._large([("1", far_fit(1, kx=-2.0, cx=0.6))])
    assert "stiffness" in softer and "loss" not in softer
    assert judged(AllEvidence(QUIET, GOOD, large=one)).verdict.status == "recalibrated"
    # of k / 3, a tenth of the compliance that is three times that of the file is a thirtieth of k
    k = run.machine.bearings[0].coefficients[0][0, 0] / 1e6
    finished, _ = run._large([("0", SOFT)], 0.01 * np.eye(len(SOFT.parameters)))
    assert f"kxx of {left} is {k / 3:.3g} MN/m +- {k / 90:.2g}" in finished[0]


@pytest.mark.parametrize(("worse", "status"), [(-50.0, "partial"), (8.0, "tie"), (20.0, "tie"), (30.0, "named")])
def test_an_error_of_the_sensors_is_named_where_no_force_at_its_order_leaves_nearly_as_little(worse, status):
    """Beforehand both are as likely; the likelihood is taken to the power 1/4."""
    one = fitted(RUNOUT, 100.0)
    given = with_other(odds((RUNOUT, 0.99), (COUPLING, 0.01)), RUNOUT, OTHER_FORCE, -worse)
    ratio = sum(e.probability for e in given if e.beyond) / next(e.probability for e in given if e.effects == RUNOUT)
    assert ratio == pytest.approx(np.exp(-worse / 8)) and sum(e.probability for e in given) == pytest.approx(1.0)
    assert judged(AllEvidence(search("named", one), given, frozenset(KNOWN))).verdict.status == status


@pytest.mark.parametrize(("promise", "fitted_too"), [(45.0, False), (55.0, True)])
def test_effects_that_no_group_shows_are_fitted_from_half_of_what_a_name_takes(promise, fitted_too, monkeypatch):
    """A tie below a name is of hypotheses that were fitted."""
    one, given = fitted(BOW), SimpleNamespace(promise=lambda: promise)
    run, base = object.__new__(DiagnosisRun), SimpleNamespace(parameters=(), vector=np.zeros(0))
    run.laws, run.tried, run._search = None, (), lambda *args: given
    monkeypatch.setattr(diagnosis, "judge", lambda found: SearchVerdict("unknown", tried=(one,)))
    verdict, _ = run._name(base, [], [])
    assert (verdict.status, verdict.tried) == ("no_disagreement", (one,) if fitted_too else ())
