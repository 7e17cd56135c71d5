"""Drift along a single probe, its own or the shaft's, is left out and noted.

A clock at another rate turns the order from block to block.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data_vector import without_probe_drift
from rotorsim.discrepancy.mistakes import check_clock_rate
from rotorsim.discrepancy.trial import trial_of

N, SPEEDS = 12500, (20.0, 26.3, 30.0, 34.7, 40.1)
T = np.arange(N) * 2e-4


def steady(hertz, rng, clock=0.0, drift=(0.0, 0.0)):
    """Circle of 5 um whose probes have a clock that drifts [1], and themselves drift [m/s]; 20 nm of noise."""
    rows = np.zeros((N, 6))
    rows[:, 0] = 2 * np.pi * hertz
    late = 2 * np.pi * hertz * T * (1 - clock)
    y = 5e-6 * np.column_stack([np.cos(late), np.sin(late)]) + np.outer(T, drift)
    return trial_of(rows, y + rng.normal(0, 2e-8, (N, 2)), 0.0, f"{hertz} Hz")


def test_the_drift_of_one_probe_is_taken_out_and_noted(rng):
    plain, own = ([steady(f, np.random.default_rng(2), drift=d) for f in SPEEDS] for d in ((0.0, 0.0), (0.0, 4e-6)))
    left, notes = without_probe_drift(own)
    assert len(notes) == 1 and notes[0].startswith("y drifts by +4 um/s in 5 of 5")
    assert "the probe, or the shaft along it" in notes[0] and "no motion" not in notes[0]
    for one, wanted in zip(left, plain, strict=True):
        assert np.abs(one.spectra - wanted.spectra)[:, :, 1:].max() < 2e-9


@pytest.mark.parametrize("drift", [(0.0, 0.0), (4e-6, 4e-6), (1e-9, 0.0)])
def test_a_shaft_that_moves_aside_is_no_drift_of_a_probe(rng, drift):
    own = [steady(f, rng, drift=drift) for f in SPEEDS]
    left, notes = without_probe_drift(own)
    assert not notes and all(a is b for a, b in zip(left, own, strict=True))


@pytest.mark.parametrize("rate", [3e-4, -1e-4])
def test_a_clock_that_drifts_is_refused_with_its_rate(rng, rate):
    with refused(DataError, "clock", lambda value: value == pytest.approx(rate, rel=0.05)):
        check_clock_rate(SimpleNamespace(trials=[steady(f, rng, clock=rate) for f in SPEEDS]))


def test_one_clock_passes(rng):
    check_clock_rate(SimpleNamespace(trials=[steady(f, rng) for f in SPEEDS]))
    check_clock_rate(SimpleNamespace(trials=[steady(f, rng, clock=3e-4) for f in SPEEDS[:2]]))


def noisy(hertz, rng, noise, clock=0.0):
    """Order of two blocks of 0.6 s with a share of noise, as the check of the clock reads it."""
    f = np.fft.rfftfreq(3000, 2e-4)
    k = round(hertz * 0.6)
    lines = np.zeros((2, 2, len(f)), complex)
    turn = np.exp(-2j * np.pi * clock * f[k] * 0.6 * np.arange(2))[:, None]
    lines[:, :, k] = 1e-5 * (turn * [1, -1j] + noise * (rng.standard_normal((2, 2, 2)) @ [1, 1j]))
    return SimpleNamespace(orders=(), clock=0.0, blocks=2, speed=2 * np.pi * f[k], broken=(), frequencies=f,
                           spectra=lines, length=3000)  # fmt: skip


@pytest.mark.parametrize("count", [16, 60])
def test_noise_alone_is_no_drift_of_a_clock(rng, count):
    """Two blocks that agree by chance count for no more than the others: of 100 rigs with 5 % of noise none drifts."""
    for _ in range(100):
        trials = [noisy(f, rng, 0.05) for f in rng.uniform(15, 60, count)]
        check_clock_rate(SimpleNamespace(trials=trials))


def test_records_of_which_few_drift_have_one_clock(rng):
    trials = [noisy(f, rng, 0.01, 1e-3 if i < 6 else 0.0) for i, f in enumerate(rng.uniform(15, 60, 16))]
    check_clock_rate(SimpleNamespace(trials=trials))
    with refused(DataError, "clock", lambda value: value == pytest.approx(1e-3, rel=0.2)):
        check_clock_rate(SimpleNamespace(trials=[noisy(t.speed / (2 * np.pi), rng, 0.01, 1e-3) for t in trials]))
