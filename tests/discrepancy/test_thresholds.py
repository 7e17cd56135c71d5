"""Verdicts as thresholds on the odds: made-up odds of hypotheses that a search has accepted."""

from types import SimpleNamespace

import pytest

from rotorsim.discrepancy.verdict import Explanation, SearchVerdict, by_odds, joined_classes

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
    """What a search found."""
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
