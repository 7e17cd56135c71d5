"""Records with wrong units, exchanged channels or shifted clocks: refused before the fit with the likely cause."""

from dataclasses import replace

import numpy as np
import pytest

from identification import from_arrays, make_record
from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.experiments import campaign
from rotorsim.discrepancy.hidden_machine import record_of
from rotorsim.discrepancy.mistakes import check_before, check_units
from rotorsim.discrepancy.records import _laid_over, _of_mass_or_stiffness, check_after, make_trial

WANTED = ("fit_2", "fit_3", "fit_5")


@pytest.fixture(scope="module")
def plain(machine, models):
    """Records of the twin itself, and its prediction of them."""
    plan = [p for p in campaign(machine) if p.name in WANTED]
    records = [record_of(models.twin, p, ParameterPoint(), 1) for p in plan]
    nominal = comparison(models, records).predict(ParameterPoint())
    return records, nominal


def comparison(models, records):
    return TwinComparison(models.twin, [make_trial(r, "fit", f"r{i}") for i, r in enumerate(records)])


def changed(records, change):
    """Records whose displacements went through a change."""
    return [r.assign(disc_measured=r.disc_measured.copy(data=change(r.disc_measured.values))) for r in records]


def test_records_without_a_mistake_pass(plain, models):
    records, nominal = plain
    check_before(comparison(models, records), nominal)
    check_before(comparison(models, changed(records, lambda y: 1.4 * y)), nominal)


@pytest.mark.parametrize(("factor", "shown"), [(25.4, "25.4"), (1 / 25.4, "0.03937"), (1e3, "1000"), (1e-3, "0.001")])
def test_displacements_in_another_unit_are_suggested_and_never_assumed(plain, models, factor, shown):
    records, nominal = plain
    wrong = comparison(models, changed(records, lambda y: factor * y))
    with refused(DataError, "units", pytest.approx(factor)):
        check_before(wrong, nominal)


def test_exchanged_channels_are_noticed(plain, models):
    records, nominal = plain
    wrong = comparison(models, changed(records, lambda y: y[:, ::-1]))
    with pytest.raises(DataError, match="fit when they are exchanged"):
        check_before(wrong, nominal)


def test_a_clock_that_is_shifted_against_the_inputs_is_noticed(plain, models):
    records, nominal = plain
    wrong = comparison(models, changed(records, lambda y: np.roll(y, 25, axis=0)))
    with refused(DataError, "clock", lambda value: 5e-3 <= abs(value) < 6e-3):
        check_before(wrong, nominal)


def test_records_of_another_machine_are_refused(plain, models, rng):
    records, _ = plain
    wrong = comparison(models, changed(records, lambda y: rng.normal(0, 1e-5, y.shape)))
    with refused(DataError, "records", lambda value: isinstance(value, str)) as found:
        check_after(wrong, wrong.predict(ParameterPoint()))
    assert "machine calibrate" in str(found.value)  # the command does not run without


@pytest.mark.parametrize(("low", "high", "words"), [(0.7, 0.8, ("1.8 times", "0.56 times")), (0.9, 1.1, ())])
def test_frequencies_that_are_all_off_one_way_suggest_a_mass_or_a_stiffness(low, high, words):
    """A frequency goes with the root of stiffness over mass: .75^2 is .56, its inverse 1.8."""
    shown = _of_mass_or_stiffness(low, high)
    assert all(word in shown for word in words) and bool(shown) == bool(words)


@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_a_force_in_another_unit_is_refused_where_the_supports_are_off_too(plain, models, factor):
    """The machine is softer than its file, so that its resonances lie lower and no line is as in the file."""
    records, _ = plain
    softer = {FitParameter("shaft_stiffness", 0.1): -0.3}
    own = comparison(models, records)
    moved = [
        replace(t, spectra=np.concatenate([t.spectra[:, :, :1], own.lines_of(i, values)[None]], axis=2))
        for values in [own.predict(ParameterPoint(softer))]
        for i, t in enumerate(own.trials)
    ]
    for trial in moved:
        trial.spectra[:, :, 1:][:, :, trial.excited[1:]] /= factor
    wrong = TwinComparison(models.twin, moved)
    with refused(DataError, "units", pytest.approx(1 / factor)):
        check_units(wrong, wrong.predict(ParameterPoint()))


@pytest.mark.parametrize(("frequency", "gain"), [(1.08, 0.65), (0.9, 1.5)])
def test_another_machine_is_told_by_how_much_it_differs(frequency, gain):
    """A resonance at 100 Hz, and the same one 8 % higher with 65 % of the gain."""

    def response(f, at):
        return 1 / (1 - (f / at) ** 2 + 0.1j * f / at)

    f = np.arange(5.0, 250.0, 2.5)
    a, b = (np.log(np.abs(response(f, at))) for at in (100 * frequency, 100))
    assert _laid_over(np.log(f), a + np.log(gain), b) == pytest.approx((frequency, gain), rel=0.01)


def test_a_speed_that_the_angle_does_not_turn_with_is_refused():
    n, turns = 12000, 2 * np.pi * 40
    time = np.arange(n) / 5000
    wrong = from_arrays(time, None, np.zeros((n, 2)), angle=turns * time, speed=40.0 * 60, pressure=0.5e6)
    with refused(DataError, "speed", lambda value: value == pytest.approx(40.0 * 60)):
        make_trial(wrong)


@pytest.mark.parametrize("hertz", [12, 16, 30])
@pytest.mark.parametrize("size", [0.0, 1e-7, 20e-6])
@pytest.mark.parametrize("ring", ["hit", "start"])
def test_a_shaft_that_is_hit_without_a_recorded_force_is_refused(size, ring, hertz):
    """A mode of 70 Hz rings down from 0.8 s on, or from the start; below a tenth of the motion it may be anything.

    In less than a turn the orders of a slow shaft are any motion.
    """
    t = np.arange(10000) * 2e-4
    angle, begin = 2 * np.pi * hertz * t, 0.8 if ring == "hit" else 0.0
    mode = size * np.where(t >= begin, np.exp(-20 * (t - begin)) * np.sin(2 * np.pi * 70 * (t - begin)), 0.0)
    motion = 5e-6 * np.column_stack([np.cos(angle), np.sin(angle)]) + mode[:, None] * [1.0, 0.3]
    motion += 5e-9 * np.random.default_rng(0).standard_normal(motion.shape)
    turning = {"angle_measured": angle, "speed_measured": np.full(t.size, 2 * np.pi * hertz)}
    record = make_record(t, {"disc_measured": motion} | turning)
    if size == 20e-6 and ring == "hit":
        with refused(DataError, "disc_force", lambda at: abs(at - 0.8) < 0.1):
            make_trial(record)
    else:
        make_trial(record)


def test_a_shaft_at_rest_before_a_hit_has_no_ratio():
    """The ratio of a hit after zeros had 300 digits."""
    t = np.arange(10000) * 2e-4
    mode = np.where(t >= 0.8, np.exp(-20 * (t - 0.8)) * np.sin(2 * np.pi * 70 * (t - 0.8)), 0.0)
    record = make_record(t, {"disc_measured": 2e-5 * mode[:, None] * [1.0, 0.3], "speed_measured": np.zeros(t.size)})
    with refused(DataError, "disc_force", lambda at: abs(at - 0.8) < 0.1) as found:
        make_trial(record)
    assert len(str(found.value)) < 200 and "at rest" in str(found.value)
