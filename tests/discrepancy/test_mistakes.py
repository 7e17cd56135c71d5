"""Mistakes with probes, named by the shape of the motion or by their calibration, and one bearing far from its file."""

import re
from dataclasses import replace

import numpy as np
import pytest

from identification import make_record
from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.discrepancy import diagnose
from rotorsim.discrepancy.calibration import (
    COMPLIANCE_LIMITS,
    LOSS_LIMITS,
    LOSS_SD,
    FitParameter,
    ParameterPoint,
    calibration,
)
from rotorsim.discrepancy.comparison import SensitivityColumns, TwinComparison
from rotorsim.discrepancy.fit import KEY, ParameterFit, _with_far, far_places, fit_parameters, relinearised
from rotorsim.discrepancy.gap import virtual_readings
from rotorsim.discrepancy.mistakes import (
    _mistakes,
    _with_mistake,
    check_alternatives,
    check_late,
    check_probes,
    check_speed_unit,
)
from rotorsim.discrepancy.records import NO_REFERENCE, make_trials, reference_notes
from rotorsim.discrepancy.run_ups import empty_sweep, ramp
from rotorsim.discrepancy.trial import delayed
from rotorsim.machine import load_machine

N, TS, SECOND = 6000, 2e-4, 0.15
SPEEDS = (20.0, 30.0, 37.0)
OFF = ParameterPoint({FitParameter(f"bearing.{i}.k{a}", 0.1): v for (i, a), v in
                      {(0, "x"): -0.2, (0, "y"): 0.15, (1, "x"): 0.1, (1, "y"): -0.1}.items()}
                     | {FitParameter("unbalance.0.me~phase.s", 1e-6): 2e-5})  # fmt: skip
"""Supports that are 10 to 20 % off, and another unbalance."""


@pytest.mark.parametrize(
    ("factor", "what"), [(1.0, ""), (1 / 60, "Hz taken for rpm"), (1 / (2 * np.pi), "Hz taken for rad/s")]
)
def test_a_resonance_at_speeds_of_another_unit_is_asked_for(models, factor, what):
    """A run-up through the resonance of supports a quarter stiffer, with speeds as they are or by another unit."""
    speeds = 2 * np.pi * np.arange(10.0, 90.0, 1.0)
    swept = replace(empty_sweep(speeds, 0.0), rows=ramp(speeds, 60.0, 0.0))
    swept = replace(swept, length=len(swept.rows))
    stiffer = {FitParameter(f"bearing.{i}.k{a}", 0.1): 0.2 for i in (0, 1) for a in "xy"}
    lines = TwinComparison(models.twin, [swept], 1)
    lines = lines.lines_of(0, lines.predict(ParameterPoint(stiffer)))
    read = replace(swept, speeds=factor * speeds, rows=ramp(factor * speeds, 60.0, 0.0))
    read = replace(read, length=len(read.rows), spectra=np.concatenate([np.zeros((2, 1)), lines], axis=1)[None])
    comparison = TwinComparison(models.twin, [read], 1)
    simulated = comparison.predict(ParameterPoint())
    if what:
        with pytest.raises(DataError, match=what) as error:
            check_speed_unit(comparison, simulated)
        assert error.value.argument == "speed" and error.value.value < factor * speeds[-1]
    else:
        check_speed_unit(comparison, simulated)


@pytest.fixture(scope="module")
def comparison(models):
    """Steady records of two planes at three speeds, without numbers yet."""
    opened = []
    for i, hertz in enumerate(SPEEDS):
        t = np.arange(N) * TS
        angle = 2 * np.pi * hertz * t
        circle = np.column_stack([np.cos(angle), np.sin(angle)])
        values = {"disc_measured": circle, "angle_measured": angle, "speed_measured": np.full(N, 2 * np.pi * hertz),
                  "probe_measured": circle}  # fmt: skip
        coords = {"probe": ["2X", "2Y"], "probe_quantity": ["relative_displacement"] * 2, "probe_unit": ["m"] * 2,
                  "probe_position": [SECOND] * 2, "probe_angle": [0.0, np.pi / 2], "probe_gain": [1, 1]}  # fmt: skip
        attrs = {"record": f"r{i}", "disc_probes": "1X, 1Y", "disc_probe_angles": [0.0, np.pi / 2]}
        opened.append((f"r{i}", make_record(t, values, attrs, probes=coords)))
    return TwinComparison(models.twin, make_trials(load_machine("plain_rotor"), opened, None))


def measured(comparison, change, plane, point=OFF):
    """The twin's readings at a point, those of a plane (0, 1; None for both) through a change (2, 2)."""
    y = comparison.predict(point)
    out = y.copy()
    for i, trial in enumerate(comparison.trials):
        if plane is None or trial.other_plane == bool(plane):
            for own, lines in zip(comparison.numbers_of(i), change @ comparison.lines_of(i, y), strict=True):
                out[own] = np.concatenate([lines.real, lines.imag])
    return out


SWAP, QUARTER = np.array([[0, 1], [1, 0]]), np.array([[0, 1], [-1, 0]])
CASES = {
    "2X and 2Y are exchanged": (SWAP, 1), "1X and 1Y are exchanged": (SWAP, 0),
    "probe 1Y is reversed": (np.diag([1, -1]), 0), "probe 2X is reversed": (np.diag([-1, 1]), 1),
    "2X and 2Y are turned by": (QUARTER, 1), "2X and 2Y are both reversed": (-np.eye(2), 1),
}  # fmt: skip


@pytest.mark.parametrize("sentence", CASES)
def test_a_mistake_with_the_probes_of_a_plane_is_named(comparison, sentence):
    comparison.measured = measured(comparison, *CASES[sentence])
    with refused(DataError, "probes", lambda value: bool(value)) as found:
        check_probes(comparison, comparison.predict(ParameterPoint()))
    assert sentence in str(found.value)


def test_a_record_without_the_second_plane_takes_part_in_what_it_shows(comparison):
    """One of three records has no second plane: it shows no exchange of planes, and no mistake with the other plane."""
    lone = next(t for t in comparison.trials if t.other_plane)
    given = TwinComparison(comparison.twin, [t for t in comparison.trials if t is not lone])
    alone = next(i for i, t in enumerate(given.trials) if t.name == lone.name.partition(", ")[0])
    for mistake in _mistakes(given.trials):
        changed = _with_mistake(given.trials, mistake)
        if "planes are exchanged" in mistake.sentence:
            assert [np.array_equal(a.spectra, b.spectra) for a, b in zip(changed, given.trials, strict=True)] == [
                i == alone for i in range(len(changed))
            ]
    given.measured = measured(given, *CASES["2X and 2Y are exchanged"])
    with refused(DataError, "probes", "channels 2X and 2Y are exchanged"):
        check_probes(given, given.predict(ParameterPoint()))


@pytest.mark.parametrize("factor", [1.0, 0.4, 2.5])
def test_supports_that_are_far_off_are_no_mistake_with_the_probes(comparison, factor):
    point = ParameterPoint({**OFF.values, FitParameter("bearing.1.kx", 0.1): 1 - 1 / factor,
                            FitParameter("bearing.1.ky", 0.1): 1 - 1 / factor})  # fmt: skip
    comparison.measured = measured(comparison, np.eye(2), None, point)
    check_probes(comparison, comparison.predict(ParameterPoint()))


def test_a_shaft_that_turns_the_other_way_is_named(comparison):
    """In both planes the orbit is mirrored, which no mistake with one plane does."""
    comparison.measured = measured(comparison, np.diag([1, -1]), None)
    with refused(DataError, "probes", "the rotation is in the other sense"):
        check_probes(comparison, comparison.predict(ParameterPoint()))


FLOOR = 2e-8
"""Floor [m] of a number."""


def calibrated(given: TwinComparison, measured: np.ndarray):
    """Calibration of readings with noise of a floor, and the sensitivities at the file's own numbers."""
    given.sigma = np.full(len(measured), FLOOR)
    given.measured = measured + np.random.default_rng(1).normal(0, 0.3 * FLOOR, len(measured))
    parameters = calibration(given.twin, len(given.trials))
    J = SensitivityColumns(given).columns(ParameterPoint(), parameters)
    base = fit_parameters(given, ParameterPoint(), parameters, J / FLOOR)
    return relinearised(given, base), J


def test_a_bearing_of_a_third_of_its_stiffness_is_found_at_its_place(comparison):
    """Priors that are alike for both bearings spread the change over both of them."""
    third = {FitParameter(f"bearing.0.k{axis}", 0.1): 1 - 1 / 0.33 for axis in "xy"}
    base, _ = calibrated(comparison, comparison.predict(ParameterPoint({**OFF.values, **third})))
    ((number, fit),) = far_places(comparison, base)
    assert number == "0"
    found, spread = ({k.key: v for k, v in zip(f.parameters, f.vector, strict=True)} for f in (fit, base))
    true = {k.key: v for k, v in OFF.values.items()}
    for axis in "xy":
        one, other = f"bearing.0.k{axis}", f"bearing.1.k{axis}"
        assert 1 / (1 - found[one]) == pytest.approx(0.33, rel=0.2) and abs(spread[one] - (1 - 1 / 0.33)) > 0.5
        assert abs(found[other] - true[other]) < 0.1 < 0.25 < abs(spread[other] - true[other])
    assert abs(found[KEY]) < 0.2 * abs(spread[KEY])


class TwoValleys:
    """A bearing's compliance fits at .5, but for a constant misfit of 5 floors, and at -2, a third of its stiffness.

    Where it has a loss, its damping fits as it is in the file.
    """

    def residual(self, point):
        (v,) = (v for k, v in point.values.items() if k.key == "bearing.0.kx")
        damping = [50 * ((1 + c) / (1 - v) ** 2 - 1) for k, c in point.values.items() if k.key == "bearing.0.cx"]
        return np.array([6 * np.sin(np.pi * (v - 0.5) / 2.5), 5.0 * (v > -0.75), *damping])

    def jacobian(self, point, parameters, progress=None):
        moved = [self.residual(point.moved([k], np.array([1e-6]))) for k in parameters]
        return np.column_stack([(self.residual(point) - y) / 1e-6 for y in moved])


@pytest.mark.parametrize("loss", [(), (FitParameter("bearing.0.cx", 0.1, LOSS_SD, *LOSS_LIMITS),)])
def test_a_far_bearing_is_looked_for_from_the_file_on_too(loss):
    """The calibration lies in the wrong valley, which no step leaves; the damping is that of the file."""
    own = (*(FitParameter(f"bearing.{i}.kx", 0.1, 0.3, *COMPLIANCE_LIMITS) for i in (0, 1)), *loss)
    point = ParameterPoint({own[0]: 0.5, own[1]: 0.0, **dict.fromkeys(loss, -0.75)})
    r, J = TwoValleys().residual(point), TwoValleys().jacobian(point, own)
    base = ParameterFit(own, point, r, J, float(r @ r))
    assert relinearised(TwoValleys(), base).vector[0] == pytest.approx(0.5, abs=0.1)
    assert _with_far(TwoValleys(), base, "0", lambda: None).vector[0] == pytest.approx(-2.0, abs=0.15)


def test_supports_10_to_20_percent_off_have_no_far_place_and_cost_no_fit(comparison, monkeypatch):
    base, _ = calibrated(comparison, comparison.predict(OFF))
    away = replace(base, parameters=tuple(replace(k, sd=min(k.sd, 0.15)) for k in base.parameters))
    monkeypatch.setattr("rotorsim.discrepancy.fit.fit_parameters", None)
    assert far_places(comparison, away) == []


def test_exchanged_planes_are_named_by_their_calibration(comparison):
    y, own = comparison.predict(OFF), {}
    for i, trial in enumerate(comparison.trials):
        own.setdefault(trial.name.partition(", ")[0], []).append(i)
    given = TwinComparison(comparison.twin, comparison.trials)
    measured = y.copy()
    for a, b in own.values():
        for one, other in zip(given.numbers_of(a), given.numbers_of(b), strict=True):
            measured[one], measured[other] = y[other], y[one]
    spectra = {i: given.lines_of(i, measured) for pair in own.values() for i in pair}
    given.trials = [with_lines(t, spectra[i]) for i, t in enumerate(given.trials)]
    base, J = calibrated(given, measured)
    with refused(DataError, "probes", lambda value: "planes are exchanged" in value):
        check_alternatives(given, base, J)
    right, J = calibrated(comparison, y)
    assert check_alternatives(comparison, right, J) is None


def unexplained(given):
    """A calibration that leaves 2X of 5 um, which no bearing moves and no alternative of the probes explains."""
    measured = given.predict(OFF)
    for i, trial in enumerate(given.trials):
        at = int(np.argmin(np.abs(trial.frequencies[1:] - 2 * trial.speed / (2 * np.pi))))
        for own in given.numbers_of(i):
            measured[own[at]] += 5e-6
    return calibrated(given, measured)


def test_what_no_bearing_moves_and_no_alternative_explains_costs_no_fit(comparison, monkeypatch):
    """A force at 2X has neither a far bearing nor an alternative of the probes fitted with the plant."""
    base, J = unexplained(TwinComparison(comparison.twin, comparison.trials))
    given = TwinComparison(comparison.twin, comparison.trials)
    given.sigma, given.measured = np.full(len(base.residual), FLOOR), given.predict(base.point) + FLOOR * base.residual
    for name in ("fit.fit_parameters", "mistakes.fit_parameters"):
        monkeypatch.setattr(f"rotorsim.discrepancy.{name}", None)
    assert far_places(given, base) == [] and check_alternatives(given, base, J) is None


def with_lines(trial, lines):
    """Trial whose blocks have these lines (2, k)."""
    spectra = np.repeat(np.concatenate([np.zeros((2, 1)), lines], axis=1)[None], trial.blocks, axis=0)
    return replace(trial, spectra=spectra)


@pytest.mark.parametrize("lag", [0.0014, -0.002, 0.00235, -0.00013])
def test_a_delay_of_all_probes_against_the_angle_is_named(comparison, lag):
    y = comparison.predict(OFF)
    given = TwinComparison(comparison.twin, comparison.trials)
    late = [delayed(given.lines_of(i, y), t.frequencies[1:], lag) for i, t in enumerate(given.trials)]
    given.trials = [with_lines(t, lines) for t, lines in zip(given.trials, late, strict=True)]
    base, J = calibrated(given, np.concatenate([t.vector(t.spectra) for t in given.trials]))
    found = check_alternatives(given, base, J)
    assert abs(found.lag - lag) < 6e-5
    with refused(DataError, "clock", lambda value: value == found.lag):
        check_late([given], found)
    # what the delay leaves of other records speaks against it
    other = replace(given.trials[0], spectra=given.trials[0].spectra * 1.2)
    left = TwinComparison(given.twin, [other, *given.trials[1:]])
    left.sigma = given.sigma
    check_late([given, left], found)


def test_a_virtual_reading_has_the_relative_error_of_the_unbalance_that_makes_it(comparison):
    """1X at the bearings is proportional to the unbalance: of 2 % along itself, 2 % of every amplitude."""
    own = comparison.twin.machine.effects["unbalance"][0]
    parameters = [FitParameter(f"unbalance.0.me~phase.{part}", 1e-7) for part in "cs"]
    along = 0.02 * own.me * np.array([np.cos(own.phase), np.sin(own.phase)])
    fit = fit_parameters(comparison, ParameterPoint(), parameters, np.zeros((len(comparison.measured), 2)), steps=0)
    (note,) = virtual_readings(comparison, replace(fit, parameters=tuple(parameters)), np.outer(along, along))
    sizes = [(float(a), float(sd)) for a, sd in re.findall(r"[xy] ([\d.e+-]+) \+- ([\d.e+-]+) um", note)]
    assert len(sizes) == 4 and all(f"{name} x " in note for name in comparison.twin.machine.bearings_in_words)
    for size, sd in sizes:
        assert sd == pytest.approx(0.02 * size, rel=0.03)


def record_of_the_rig(**channels):
    """A tenth of a second of a record, without references unless they are given."""
    n = 500
    known = {"disc_measured": np.zeros((n, 2)), "speed": np.full(n, 300.0), "pressure": np.full(n, 3e5)}
    return make_record(np.arange(n) * 2e-4, known | channels, {"record": "one", "role": "fit"})


def test_records_without_references_of_a_machine_with_pins_are_noted_before_anything_is_computed():
    def first(note):
        raise ValueError(note)

    with pytest.raises(ValueError) as found:
        diagnose("dtu_gas_bearing", [record_of_the_rig()], progress=first, noted=first)
    assert str(found.value) == NO_REFERENCE.format("every record")


def test_references_that_are_recorded_or_that_no_pin_follows_need_no_note():
    rig, driven = load_machine("dtu_gas_bearing"), record_of_the_rig(reference=np.zeros((500, 2)))
    assert reference_notes(rig, [("one", driven)]) == []
    assert reference_notes(rig, [("one", driven), ("two", record_of_the_rig())]) == [NO_REFERENCE.format("'two'")]
    assert reference_notes(load_machine("plain_rotor"), [("one", record_of_the_rig())]) == []
