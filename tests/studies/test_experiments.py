"""Experiments on the claims: the table, changes of a machine, crossings of the thesis' numbers, tables of results."""

import math
from pathlib import Path

import pytest

import rotorsim as rs
from refusals import refused
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.control import DesignError
from rotorsim.control.designs import lead
from rotorsim.control.designs.hinf_synthesis import closed, controller
from rotorsim.control.systems import peak_gain
from studies.thesis.claims.judge import MET, NEAR, NOT_MET
from studies.thesis.experiments import limit, measures
from studies.thesis.experiments.pages import HEADS, markdown, plain, rows
from studies.thesis.experiments.run import Found, reached
from studies.thesis.experiments.table import (
    FactorStudy,
    changed,
    chosen_experiments,
    experiments,
    figure_of,
    known_figures,
    read,
    values,
)

GOOD = """[one]
words = "unbalance"
fields = ["effects.unbalance.me"]
factors = [1.0, 2.0]
measure = "runout"
figures = ["I4.before"]
why = "assumed"
"""
EXPLAINED = {"I3", "I4", "I5", "I7", "I9", "I10", "I11", "C1", "C2", "C3", "C4", "C5", "C7", "C8", "C10", "C11", "C12"}
"""Claims that are near or not met in studies/thesis/README.md."""


@pytest.fixture(scope="module")
def machine():
    return rs.Plant("dtu_gas_bearing").machine


def one(**changes):
    table = dict(name="one", words="unbalance", fields=("effects.unbalance.me",), factors=(1.0, 2.0), measure="runout",
                 figures=("I4.before",), why="assumed") | changes  # fmt: skip
    return FactorStudy(**table)


def test_every_claim_that_is_not_met_has_its_experiment():
    assert {claim for found in experiments() for claim in found.claims} >= EXPLAINED


def test_every_experiment_can_be_run_on_the_shipped_rig(machine):
    for found in experiments():
        assert callable(measures.measure(found.measure))
        assert found.why.endswith(".")
        assert all(figure_of(key).words for key in found.figures)
        for factor in found.factors:
            other = changed(machine, found, factor)
            assert (other.hash == machine.hash) == (factor == 1), (found.name, factor)


def test_a_factor_multiplies_every_field_that_a_star_means(machine):
    found = one(fields=("injectors.*.pd_gain", "injectors.2.pd_zero^-1"), measure="actuators", figures=("I9.p1_x",))
    other = changed(machine, found, 0.5)
    assert [b.pd_gain / a.pd_gain for a, b in zip(machine.injectors, other.injectors, strict=True)] == [0.5] * 4
    assert other.injectors[2].pd_zero == pytest.approx(machine.injectors[2].pd_zero * 2)
    assert other.injectors[0].pd_zero == machine.injectors[0].pd_zero
    assert len(values(machine, found)) == 5


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('why = "assumed"', "", "one needs the keys"),
        ("[1.0, 2.0]", "[2.0, 3.0]", "must hold 1"),
        ("[1.0, 2.0]", "[1.0, 1.0]", "each once"),
        ("I4.before", "I4.before_", "no figure I4.before_; did you mean 'I4.before'"),
        ("words =", "words", "is not a TOML file"),
    ],
)
def test_a_bad_table_is_refused_in_one_sentence(old, new, words):
    with pytest.raises(DataError, match=words):
        read(GOOD.replace(old, new))


def test_fields_that_are_no_numbers_and_unknown_names_are_refused(machine):
    for path in ("name", "effects.unbalance", "effects.unbalance.mass", "injectors.9.pd_gain"):
        with pytest.raises(DataError, match="no number"):
            changed(machine, one(fields=(path,)), 2.0)
    with pytest.raises(MachineFileError, match="damping_ratio"):
        changed(machine, one(fields=("shaft.damping_ratio",), factors=(1.0, -1.0)), -1.0)
    with refused(DataError, "only", "I99"):
        chosen_experiments(["I99"])
    with pytest.raises(DataError, match="no measure 'runouts'; did you mean 'runout'"):
        measures.measure("runouts")


def test_only_takes_claims_and_names():
    assert {found.name for found in chosen_experiments(["I4"])} == {"unbalance"}
    assert [found.name for found in chosen_experiments(["pd_gain"])] == ["pd_gain"]
    assert chosen_experiments([]) == experiments()


def test_the_factor_of_the_thesis_number_is_found_between_those_tried_nearest_to_one():
    figure = known_figures()["I4.before"]
    assert reached(figure, [(0.5, 3.0), (1.0, 6.0), (2.0, 12.0)]) == pytest.approx(1.5)
    assert reached(figure, [(0.25, 12.0), (1.0, 6.0), (2.0, 12.0)]) == pytest.approx(1 - 0.375)
    assert reached(figure, [(1.0, 6.0), (2.0, 8.0)]) is None
    assert reached(figure, [(1.0, math.nan), (2.0, 12.0)]) is None
    bound = known_figures()["C4.softening_peak"]  # one-sided: at most 1.6
    assert reached(bound, [(1.0, 1.7), (2.0, 1.5)]) == pytest.approx(1.5)


def test_the_best_factor_meets_the_most_figures_and_is_the_nearest_of_these():
    found = Found(one(factors=(1.0, 1.5, 2.0)), {f: {"I4.before": 6.0 * f} for f in (1.0, 1.5, 1.7)}, {2.0: "no film."})
    assert (found.best, found.verdict("I4.before", 1.0), found.verdict("I4.before", 1.5)) == (1.5, NEAR, MET)
    assert found.verdict("I4.before", 2.0) == NOT_MET
    assert Found(one(), {1.0: {"I4.before": 6.0}}, {2.0: "no film."}).best == 1.0


def test_tables_hold_both_columns_and_why(machine):
    found = Found(one(), {1.0: {"I4.before": 6.0}, 2.0: {"I4.before": 10.0}}, {}, ["w_x"])
    assert rows(found) == [("I4 amplitude before", "9 um", "6", "10 (x 2)", f"{NEAR} -> {MET}", "x 1.75")]
    text = markdown([found], machine)
    assert "| I4 | unbalance | x 2 | 0 to 1 of 1 | w_x |" in text
    assert "w_x are lost" in text and "assumed" in text and f"| {' | '.join(HEADS)} |" in text
    (kept,) = plain([found])
    assert kept["figures"]["I4.before"]["values"] == {"1": 6.0, "2": 10.0}
    failed = Found(one(), {1.0: {"I4.before": 6.0}}, {2.0: "the shaft touches."})
    assert "At 2 no figure: the shaft touches." in markdown([failed], machine)


def test_a_machine_whose_records_cannot_be_identified_leaves_a_sentence(machine):
    noisy = machine.with_({"effects.noise.sigma": 1e-3}).text
    found = measures.figures(noisy, machine.text, "fits")
    assert set(found) == {"failed"}
    assert found["failed"].startswith("identify: ")


def test_unbalance_raises_the_amplitude_and_a_larger_position_gain_the_slow_pole(machine):
    loud = machine.with_({"effects.unbalance.me": 13e-6})
    small, large = (measures.figures(m.text, machine.text, "runout")["I4.before"] for m in (machine, loud))
    assert small == pytest.approx(6.4, rel=0.05)
    assert 8 < large < 12
    (gain,) = chosen_experiments(["pd_gain"])
    slow = [measures.figures(changed(machine, gain, factor).text, machine.text, "actuators")["I9.p1_x"]
            for factor in (0.75, 1.0, 1.1)]  # fmt: skip
    assert slow == sorted(slow)
    assert figure_of("I9.p1_x").met[0] < slow[1] < figure_of("I9.p1_x").met[1]


def test_hardening_control_is_that_of_table_d1():
    assert lead.HARDENING.kappa == (0.0061, 0.0133)


def test_below_the_stated_level_no_controller_is_found_and_above_it_one_is():
    """On the model of nine records of the rig; the level is that of the effort's weight of the experiment."""
    model = rs.load_model(Path(__file__).parents[1] / "control" / "rig_model.json")
    at = (400.0, 0.7e6)
    level, P = limit.least_level(model, *at), limit.problem(model, *at)
    with pytest.raises(DesignError, match="no controller reaches"):
        controller(P, 0.999 * level)
    assert peak_gain(closed(P, controller(P, 1.3 * level))) <= 1.3001 * level
