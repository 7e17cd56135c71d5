"""Clock of the displacements against that of the inputs: offset by record as calibration, drift from the blocks."""

from dataclasses import replace

import numpy as np
import pytest

from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.discrepancy import hide
from rotorsim.discrepancy.calibration import ParameterPoint
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.hidden_machine import HiddenTruth, truth_twin
from rotorsim.discrepancy.mistakes import _simultaneous
from rotorsim.discrepancy.records import make_trial, make_trials, open_records
from rotorsim.discrepancy.trial import clock_offset, delayed, drift_of, without_drift
from rotorsim.machine import load_machine

F = np.arange(1, 200) * 1.25


def lines(rng):
    return rng.normal(size=(2, len(F))) + 1j * rng.normal(size=(2, len(F)))


@pytest.mark.parametrize("tau", [0.0, 37e-6, -1.3e-3, 2.9e-3])
def test_an_offset_of_the_clock_is_found_to_its_standard_deviation(rng, tau):
    """Noise of 1 % of a line: sd = 1 / sqrt(sum |omega s / sigma|^2 + 1 / sd_0^2); without noise it is exact."""
    s, sigma = lines(rng), np.full((2, len(F)), 0.01)
    exact, sd = clock_offset(delayed(s, F, tau), s, F, 1e-3, sigma)
    prior_pull = tau * (sd / 1e-3) ** 2
    assert exact == pytest.approx(tau - prior_pull, abs=1e-9)
    assert sd == pytest.approx(1 / np.sqrt(np.sum((2 * np.pi * F * np.abs(s) / 0.01) ** 2) + 1e6), rel=1e-12)
    noisy = delayed(s, F, tau) + 0.01 * lines(rng)
    assert abs(clock_offset(noisy, s, F, 1e-3, sigma)[0] - tau) < 4 * sd


@pytest.mark.parametrize("drift", [0.0, 20e-6, -150e-6])
def test_a_drift_follows_from_the_blocks_and_is_taken_out(rng, drift):
    """Four blocks of 0.8 s: block b is late by the drift times its distance from the middle."""
    s = lines(rng)
    middle = (np.arange(4) - 1.5) * 0.8
    blocks = np.array([delayed(s, F, drift * t) for t in middle])
    assert drift_of(blocks, F, 0.8) == pytest.approx(drift, abs=1e-12)
    np.testing.assert_allclose(without_drift(blocks, F, 0.8, drift), np.array([s] * 4), atol=1e-12)


@pytest.mark.parametrize("value", ["soon", -1e-3, 0.5])
def test_a_clock_that_is_not_a_short_time_is_refused_in_one_sentence(value):
    record = hit(load_machine("plain_rotor"))[0][1]
    with refused(DataError, "clock", value):
        make_trial(record.assign_attrs(clock=value))


def hit(machine):
    """Records of hits without a change of the calibration, by name."""
    twin = truth_twin(machine, ())
    return open_records(hide(machine, (), 1, truth=HiddenTruth((), (), ParameterPoint(), 1), twin=twin))


def test_the_residual_of_a_record_with_another_clock_is_that_of_one_with_the_same():
    """Displacements of one record 1.234 ms late; 1e-3 of the gap that made is left."""
    machine = load_machine("plain_rotor")
    trials = make_trials(machine, hit(machine)[:2], "fit")
    late = [replace(t, clock=3e-3, spectra=delayed(t.spectra, t.frequencies, 1.234e-3)) for t in trials[:1]]
    twin = truth_twin(machine, ())
    apart = {
        name: TwinComparison(twin, own, 1) for name, own in (("same", trials[:1]), ("late", late),
        ("stated not", [replace(late[0], clock=0.0)]))
    }  # fmt: skip
    left = {name: float(np.linalg.norm(c.measured - c.predict(ParameterPoint()))) for name, c in apart.items()}
    assert left["stated not"] > 20 * left["same"]
    assert left["late"] < left["same"] + 1e-3 * left["stated not"]
    (offset, sd), *none = apart["late"].clock_offsets(ParameterPoint()).values()
    assert not none and sd > 0
    assert offset == pytest.approx(1.234e-3, abs=2e-6)
    assert apart["same"].clock_offsets(ParameterPoint()) == {}


def test_records_of_one_name_in_two_folders_stay_two_records(tmp_path):
    """Two speeds recorded as steady.nc: names by their folders, by a number where nothing else is different."""
    machine = load_machine("plain_rotor")
    for name, record in hit(machine)[:2]:
        (tmp_path / name).mkdir()
        record.to_netcdf(tmp_path / name / "steady.nc", engine="h5netcdf")
    files = sorted(tmp_path.rglob("*.nc"))
    names = [f"{file.parent.name}/steady" for file in files]
    assert [name for name, _ in open_records(files)] == names
    assert [name for name, _ in open_records(str(files[0]))] == ["steady"]
    assert len(open_records(open_records(files[0])[0][1])) == 1
    assert [name for name, _ in open_records([files[0], *files])] == [f"{names[0]} (1)", f"{names[0]} (2)", names[1]]
    assert len(_simultaneous(make_trials(machine, open_records(files), "fit"))) == 2
