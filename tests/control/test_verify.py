"""Verification of a law on the plant: compiled loop bit-identical, impacts, sensor faults, safety circle."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from refusals import refused
from rotorsim.base.errors import LimitError
from rotorsim.control import LawError
from rotorsim.control.designs import lqr, p
from rotorsim.experiments import Impact, controlled
from rotorsim.machine import Limits, Machine
from rotorsim.plant import Plant
from rotorsim.report.control import verification_page
from rotorsim.report.page import html
from rotorsim.verify import SafeSpeed, Verification, closed_loop, safe_speed
from rotorsim.verify.closed_loop import Criteria, _impact_rows, at_most, below, edited, other_machines, worst_ratio
from rotorsim.verify.runs import Frozen, Run, run_rows, steady_rows
from rotorsim.verify.transients import (
    ImpactResponse,
    changing,
    comparison,
    envelope_damping,
    excursion,
    impact_answers,
    impact_responses,
)

POINT = (314.0, 0.5e6)


@pytest.fixture(scope="module")
def plant():
    return Plant("dtu_gas_bearing")


def test_the_compiled_loop_is_the_experiments_bit_for_bit(plant, model):
    law = lqr.design(model).with_(average=0.02, fade=0.01)
    hammer = Impact(*POINT, peak=20.0, lead=0.05, spacing=0.05)
    record = controlled(plant, law, *POINT, duration=0.1, excitations=[hammer])
    rows = steady_rows(*POINT, 0.1)
    rows[:, 4:6] += hammer.rows(0, len(rows))[:, 4:6]
    run = run_rows(plant, law, rows)
    np.testing.assert_array_equal(run.disc, record.disc.values)
    np.testing.assert_array_equal(run.reference, record.reference.values)
    assert np.abs(run.reference).max() > 0.1


def test_control_lowers_the_response_to_hits_in_both_directions(plant, model):
    law = lqr.design(model)
    for q in ((0.0, 0.3e6), POINT):
        before, after = impact_responses(plant, None, *q), impact_responses(plant, law, *q)
        assert np.all(np.divide(after.response, before.response) < 0.8)
        assert after.damping > 2.5 * before.damping
        assert not after.touched


def test_the_disc_answers_to_a_hit_of_the_journal_as_the_journal_to_one_of_the_disc(plant):
    """Reciprocity of Maxwell and Betti, which a film's small cross-coupling leaves within some per cent at rest."""
    film, disc, rows = plant.machine.films[0], plant.machine.discs[0], steady_rows(0.0, 0.5e6, 0.2)
    quiet = run_rows(plant, None, rows)
    rows[100:105, 4] = 10.0
    on_disc = run_rows(plant, None, rows)
    on_journal = run_rows(plant, None, rows, position=film.position)
    there, back = on_disc.pair("journal") - quiet.pair("journal"), on_journal.disc - quiet.disc
    assert back[:, 0] == pytest.approx(there[:, 0], abs=0.05 * np.abs(there[:, 0]).max())
    assert np.abs(back).max() < 0.5 * np.abs(on_disc.disc - quiet.disc).max()
    same = run_rows(plant, None, rows, position=disc.position)
    assert same.disc == pytest.approx(on_disc.disc, abs=1e-12)


@pytest.mark.slow
def test_a_plant_of_another_rate_answers_to_hits_and_a_law_of_its_rate_as_at_the_rigs(plant, model):
    fine = Plant(plant.machine.with_({"solver.sampling_rate": 1e4}))
    assert fine.machine.sampling_time == pytest.approx(1e-4)
    before, sooner = impact_responses(plant, None, *POINT), impact_responses(fine, None, *POINT)
    assert sooner.response == pytest.approx(before.response, rel=0.02)
    assert sooner.damping == pytest.approx(before.damping, rel=0.1)
    after = impact_responses(fine, lqr.design(model, lqr.Spec(Ts=1e-4)), *POINT)
    assert np.all(np.divide(after.response, sooner.response) < 0.8)
    assert after.damping > 2.5 * sooner.damping


def test_a_hanging_sensor_holds_its_last_value(plant, model):
    law = p.design(model, p.Spec(kappa_x=0.375, kappa_y=0.33)).with_(average=0.02, fade=0.0, plausibility=None)
    run = run_rows(plant, law, steady_rows(*POINT, 0.12), fault=Frozen(0, 0.08))
    late = run.reference[round(0.09 / 2e-4) :]
    assert late[:, 0].std() < 0.05 * late[:, 1].std()


def test_a_machine_without_actuators_is_refused(model):
    with refused(LawError, "machine", "plain_rotor"):
        closed_loop(lqr.design(model), Plant("plain_rotor"))


def test_the_damping_of_a_decay_is_found():
    t = np.arange(500) * 2e-4
    for zeta in (0.02, 0.1, 0.3):
        decay = np.exp(-zeta * 750 * t) * np.sin(np.sqrt(1 - zeta**2) * 750 * t)
        assert envelope_damping(np.column_stack([decay, 0 * t])) == pytest.approx(zeta, rel=0.2)


def test_a_tight_circle_is_left_at_once_and_a_wide_one_never(plant):
    ramp = {"start": 300.0, "stop": 330.0, "rate": 300.0}
    assert safe_speed(plant, None, radius=1e-7, **ramp).left
    wide = safe_speed(plant, None, radius=1e-3, **ramp)
    assert (wide.left, wide.why) == (False, "reached the end of the ramp")
    assert wide.speed == pytest.approx(330.0, rel=1e-3)


def test_robustness_is_asked_on_the_other_calibrations_and_clearances(plant):
    others = dict(other_machines(plant))
    assert list(others) == ["dtu_gas_bearing_b", "dtu_gas_bearing_c", "clearance -10 %", "clearance +10 %"]
    clearances = [other.machine.bearings[1].clearance for other in list(others.values())[2:]]
    np.testing.assert_allclose(clearances, (22.5e-6, 27.5e-6))


def test_other_machines_are_computed_as_finely_and_named_as_shipped_where_this_one_is_changed():
    """A coarse grid holds for every row; a change of the machine does not reach the shipped files."""
    coarse = Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)
    others = dict(other_machines(coarse))
    assert next(iter(others)) == "dtu_gas_bearing_b"
    for other in others.values():
        assert (other.machine.grid, other.machine.solver) == (coarse.machine.grid, coarse.machine.solver)
        assert Machine.from_text(other.machine.text) == other.machine
    warmer = Plant(coarse.machine.replace("gas.temperature", "320 K"))
    names = {name: other.machine.gas.temperature for name, other in other_machines(warmer)}
    assert names == {"dtu_gas_bearing_b as shipped": 293.15, "dtu_gas_bearing_c as shipped": 293.15,
                     "clearance -10 %": 320.0, "clearance +10 %": 320.0}  # fmt: skip


def test_a_machine_on_which_nothing_was_measured_passes_no_robustness():
    """The worst of no points, or of points without a number, is no number and fails every bound."""

    def responses(value):
        return ImpactResponse(0.0, 3e5, (value, value), (0.0, 0.0), 0.0, False, 0.1)

    assert np.isnan(worst_ratio([]))
    ended = (responses(np.inf), responses(np.inf))
    assert np.isnan(worst_ratio([(responses(2.0), responses(1.0)), ended]))
    assert at_most("", worst_ratio([ended]), 1.0).passed is False
    assert worst_ratio([(responses(2.0), responses(1.0)), (responses(1.0), responses(3.0))]) == 3.0


def test_a_law_gains_nothing_from_a_run_without_control_that_ended():
    """Such a point is left out; where the law's own run ended the ratio is infinite."""

    def responses(value, ended=""):
        return ImpactResponse(0.0, 3e5, (value, value), (0.0, 0.0), 0.0, bool(ended), 0.1, ended)

    over, fine, lost = responses(2.0), responses(3.0), responses(np.inf, "ended at 3000 rpm")
    assert worst_ratio([(lost, over), (over, fine)]) == 1.5
    assert np.isnan(worst_ratio([(lost, over)])) and worst_ratio([(over, lost)]) == np.inf
    rows = {row.check: row for row in _impact_rows((lost,), (over,), Criteria())}
    assert not rows["impact response along x, mean"].passed and not rows["impact response, worst point"].passed
    assert "without control ended at 3000 rpm" in rows["no contact in the hits"].remark
    rows = {row.check: row for row in _impact_rows((lost, over), (over, fine), Criteria())}
    assert rows["impact response along x, mean"].measured == 1.5


def test_a_run_up_to_a_limit_of_the_machine_is_safe_up_to_there(plant):
    """The disc's rim, of 70 mm, passes 22 m/s at 314.3 rad/s; up to there the run is that without the limit."""
    ramp = {"start": 300.0, "stop": 330.0, "rate": 300.0, "radius": 1e-3}
    free = safe_speed(plant, None, **ramp)
    held = safe_speed(Plant(plant.machine.with_({"limits": Limits(tip_speed="22 m/s")})), None, **ramp)
    assert (held.left, held.run.ended) == (False, held.why)
    assert held.why.startswith("ended at 3002 rpm: the rim of discs.0, radius 70 mm, moves at 22.0")
    assert 314.2 < held.speed <= 22.0 / 0.07
    np.testing.assert_array_equal(held.run.table, free.run.table[: len(held.run.table)])
    with pytest.raises(LimitError, match="begin lower or raise it"):
        safe_speed(Plant(plant.machine.with_({"limits": Limits(tip_speed="5 m/s")})), None, **ramp)


def test_a_run_up_ends_where_equilibria_have_more_choked_feed_holes_than_the_machine_allows(plant):
    narrow = plant.machine.replace("injection.curtain_discharge", 0.01).replace("limits.choked_feeds", 0.5)
    with pytest.raises(LimitError, match="100 % of the feed holes of bearing 1 are choked"):
        safe_speed(Plant(narrow), None, start=300.0, stop=310.0, rate=300.0, radius=1e-3)


def test_a_run_of_a_verification_ends_at_a_limit_of_the_machine(plant, model):
    """The rim passes 22 m/s at 314.3 rad/s, half-way up the ramp; until then the run is that without the limit."""
    law, rows = lqr.design(model), changing((300.0, 330.0), (0.5e6, 0.5e6), 0.1)
    held, free = run_rows(limited(plant, tip_speed="22 m/s"), law, rows), run_rows(plant, law, rows)
    assert held.at_limit and held.ended.startswith("ended at 3002 rpm: the rim of discs.0") and not free.at_limit
    assert 2000 < len(held.table) < len(free.table) == len(rows)
    np.testing.assert_array_equal(held.table, free.table[: len(held.table)])
    assert excursion(held) == np.inf > excursion(free)


def test_a_run_that_begins_with_choked_feed_holes_has_no_samples(plant):
    narrow = Plant(plant.machine.replace("injection.curtain_discharge", 0.01).replace("limits.choked_feeds", 0.5))
    run = run_rows(narrow, None, steady_rows(*POINT, 0.1))
    assert run.at_limit and len(run.table) == 0 and "100 % of the feed holes of bearing 1 are choked" in run.ended


def test_a_verification_beyond_a_limit_of_the_machine_is_not_passed_and_states_it(model):
    """30 m/s, 4093 rpm: hits at 6000 rpm, run-up and speed ramp pass it; what stays at 3000 rpm is judged as ever."""
    coarse = Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)
    result = closed_loop(lqr.design(model), limited(coarse, tip_speed="30 m/s"), quick=True)
    rows = {row.check: row for row in result.rows}
    assert not result.passed
    for name in ("impact response, worst point", "no contact in the hits", "run-up and coast-down",
                 "speed ramp of 60 krpm/s"):  # fmt: skip
        assert rows[name].passed is False and "above limits.tip_speed 30 m/s" in rows[name].remark, name
    assert rows["pressure step 0.3 to 0.7 MPa"].passed and rows["sensor x hangs"].passed
    assert rows["smallest damping ratio, closed"].measured > 0.1


@pytest.fixture(scope="module")
def coarse():
    return Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)


def test_a_law_that_its_alarms_suspend_fails_and_its_alarms_are_stated_by_run(coarse, model):
    """A range of 10 nm: once the centre is found every sample is out of it; bounds on amplitudes and voltages hold."""
    law = lqr.design(model)
    limits = replace(law.plausibility, range=1e-8)
    result = closed_loop(law.with_(plausibility=limits), coarse, quick=True)
    row = {row.check: row for row in result.rows}["suspended by alarms, sound sensors"]
    assert (row.passed, row.bound) == (False, 2.0) and row.measured > 90 and not result.passed
    assert "hits at 0 rpm, 0.3 MPa" in {one.run for one in result.alarms}
    assert all(one.bad > 0.5 * one.samples for one in result.alarms if one.sound)
    text = html(verification_page(result))
    head = verification_page(result).introduction
    assert f"{row.check} {row.measured:.4g}" in head and "(bound 2)" in head
    assert "Alarms" in text and f"{result.alarms[0].bad} of 4000" in text and result.alarms[0].sentence[-60:] in text


def test_alarms_of_a_sound_law_are_those_of_a_hanging_sensor_and_of_an_overload(coarse, model):
    result = closed_loop(lqr.design(model), coarse, quick=True)
    assert [one.run for one in result.alarms if not one.sound] == ["sensor x hangs", "sensor y hangs"]
    assert {one.run for one in result.alarms if one.sound} <= {"hit of 100 N (saturation)"}
    assert {row.check: row for row in result.rows}["suspended by alarms, sound sensors"].passed
    assert closed_loop(p.make(p.Spec(kappa_x=0.0, kappa_y=0.0)), coarse, quick=True).alarms == ()


def test_alarms_of_the_run_to_the_safe_speed_are_in_its_sentence():
    run = Run(np.zeros((1, 1)), np.zeros((1, 6)), alarms=(5, 100, "5 bad samples; the last: it jumped"))
    found = comparison(made(600.0), replace(made(1200.0), run=run))
    wanted = "alarms in the whole run, also beyond this speed, of 100 samples 5 bad samples; the last: it jumped;"
    assert wanted in found["sentence"]
    assert "alarms" not in comparison(made(600.0), made(1200.0))["sentence"]


def test_a_criterion_that_an_earlier_verification_did_not_have_is_not_edited():
    before = asdict(Criteria())
    assert edited({name: v for name, v in before.items() if name != "suspended"}, before) == []
    assert len(edited(before, before | {"suspended": 0.5})) == 1


def test_a_law_that_does_nothing_fails_whatever_the_last_digit(coarse):
    idle = p.make(p.Spec(kappa_x=0.0, kappa_y=0.0))
    rows = {row.check: row for row in closed_loop(idle, coarse, quick=True).rows}
    for name in (
        "impact response along x, mean",
        "impact response, worst point",
        "imbalance amplitude at 6 krpm, 0.7 MPa",
    ):
        assert rows[name].passed is False and "changes nothing" in rows[name].remark, name
    for measured in (1 - 1e-12, 1.0, 1 + 1e-12):
        assert below("", measured, 1.0).passed is False
    assert below("", 0.99, 1.0).passed and below("", 1.0, 1.2).passed and below("", 1.0, None).passed is None
    assert below("", np.nan, 1.0).passed is False


def limited(plant, **limits):
    return Plant(plant.machine.with_({"limits": Limits(**limits)}))


def made(speed, left=True, checked=628.3185, beyond=()):
    return SafeSpeed(speed, left, "left the circle of 20 um", None, checked, beyond)


def test_safe_speeds_are_compared_with_the_last_checked_speed():
    rpm = np.pi / 30
    numbers = comparison(made(6420 * rpm), made(28980 * rpm, beyond=("above 6000 rpm: more",)))
    assert numbers["ratio"] == pytest.approx(28980 / 6420) and numbers["times_checked"] == pytest.approx(4.83)
    assert (numbers["last_checked_rpm"], numbers["at_least"]) == (pytest.approx(6000), False)
    assert numbers["sentence"] == (
        "open loop 6420 rpm (107 Hz), left the circle of 20 um; closed loop 28980 rpm (483 Hz), left the circle of "
        "20 um: 4.51 times the open loop; the model was compared with measurements up to 6000 rpm (100 Hz), and the "
        "closed loop's speed, 4.83 times that, is not checked"
    )
    slow = comparison(made(3000 * rpm), made(5900 * rpm, left=False))
    assert slow["at_least"] and slow["sentence"].endswith(
        "more than 1.97 times the open loop; the model was compared with measurements up to 6000 rpm (100 Hz)"
    )
    unknown = comparison(made(300.0, checked=None), made(600.0, checked=None))
    assert unknown["times_checked"] is None and "states no speeds at which its model was checked" in unknown["sentence"]


def test_what_a_safe_speed_exceeds_is_stated_from_the_last_checked_speed_on(plant):
    found = safe_speed(plant, None, start=620.0, stop=640.0, rate=400.0, radius=1e-3)
    assert found.checked == pytest.approx(200 * np.pi)
    assert [text.partition(":")[0] for text in found.beyond] == ["above 6000 rpm"]
    assert safe_speed(plant, None, start=600.0, stop=610.0, rate=400.0, radius=1e-3).beyond == ()


def test_a_verification_on_another_machine_says_so(plant, model):
    law = lqr.design(model).with_(about={"machine": "my_rig 0123"})
    result = Verification(law, "dtu_gas_bearing", (), (), ())
    assert result.remark.startswith("law lqr: was designed on a model of my_rig, and the machine is dtu_gas_bearing")
    assert "Law lqr: was designed on a model of my_rig" in html(verification_page(result))
    assert Verification(law, "my_rig", (), (), ()).remark == ""


def test_a_response_is_a_norm_and_its_square_an_energy(plant):
    """Twice the answer is twice the response and four times the energy; the words on a page keep them apart."""
    found = impact_responses(plant, None, 300.0, 0.5e6)
    disc = impact_answers(plant, None, 300.0, 0.5e6, 20.0)[0] * 1e6
    hammer = Impact(peak=20.0, width=1e-3, angle=0.0, lead=0.4, spacing=0.2, Ts=plant.machine.sampling_time)
    force = hammer.rows(2000, 500)[:, 4:6]
    energies = (disc**2).sum() / (force**2).sum()
    assert found.response[0] ** 2 == pytest.approx(energies, rel=1e-6)
    rows = _impact_rows((found,), (found,), Criteria())
    assert not any("energy" in row.check for row in rows)
