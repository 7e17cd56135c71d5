"""Detection of closed-loop records by provenance or by feedback in the data."""

import numpy as np
import pytest
from scipy.signal import butter, chirp, sosfilt

import identification as idn
from identification.records.checks import FEED, check_modes, controller_of, fed_back
from model3 import TS, looped_model3 as looped, made, model, prbs, record

pytestmark = pytest.mark.numerical

N, NOISE = 10000, 0.5e-6


@pytest.mark.parametrize(
    ("gain", "corner"),
    [(5e3, 1000.0), (1e5, 200.0)]
    + [pytest.param(*more, marks=pytest.mark.slow) for more in ((5e3, 200.0), (2e4, 200.0), (2e4, 1e3), (1e5, 1e3))],
)
def test_a_foreign_record_of_a_closed_loop_gives_a_warning(gain, corner):
    u, _, y = looped(1, gain, corner)
    assert np.abs(u).max() < 5 and fed_back(u, y) > 3 * FEED
    found = idn.identify(made(u, y), 1)
    assert any("a controller seems to act" in text and "or without the controller" in text for text in found.warnings)


def excitations(rng):
    """References (N, 2) as people use them in open loop."""
    t = np.arange(N) * TS
    white = rng.normal(size=(N, 2))
    clocked = np.repeat(white[: N // 25], 25, axis=0)
    phases = rng.uniform(0, 2 * np.pi, 80)
    lines = np.sin(2 * np.pi * 5 * t[:, None] * np.arange(1, 81) + phases)
    return {
        "binary": prbs(rng, N),
        "binary, quick": prbs(rng, N, 3),
        "binary, as measured": prbs(rng, N) + 1e-3 * rng.normal(size=(N, 2)),
        "binary, 12 bit": np.round((prbs(rng, N) + 5e-4 * rng.normal(size=(N, 2))) / 2.44e-3) * 2.44e-3,
        "white": white,
        "steps": clocked,
        "up to 200 Hz": sosfilt(butter(4, 200, fs=1 / TS, output="sos"), white, axis=0),
        "80 to 200 Hz": sosfilt(butter(4, [80, 200], btype="band", fs=1 / TS, output="sos"), white, axis=0),
        "chirp": np.column_stack([chirp(t, 20, t[-1], 300), chirp(t, 300, t[-1], 20)]),
        "sines": np.column_stack([lines[:, ::2].sum(axis=1), lines[:, 1::2].sum(axis=1)]) / 6,
    }


@pytest.mark.parametrize("seeds", [2, pytest.param(20, marks=pytest.mark.slow)])
def test_no_open_loop_excitation_is_taken_for_feedback(seeds):
    """Ten kinds, with noise, imbalance and a drift: the largest share of 200 records is .004, of .05."""
    t, found = np.arange(N) * TS, {}
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        for name, u in excitations(rng).items():
            y = model().simulate(u, TS) + NOISE * rng.normal(size=(N, 2)) + 1e-6 * t[:, None]
            y += 5e-6 * np.column_stack([np.cos(500 * t), np.sin(500 * t)])
            found[name] = max(found.get(name, 0.0), fed_back(u, y))
    assert max(found.values()) < FEED / 2, found


def test_a_record_that_names_its_controller_is_refused_for_output_error():
    u, external, y = looped(0, 1e5)
    for attrs, more, name in (
        ({"controller": "Law", "law": "lqr"}, {}, "lqr"),
        ({"controller": "ProportionalLaw"}, {}, "ProportionalLaw"),
        ({"experiment": "controlled"}, {}, "controlled"),
    ):
        data = made(u, y, **more).assign_attrs(attrs)
        for method in ("auto", "oe"):
            with pytest.raises(idn.UnfitError, match=rf"made in closed loop \({name}.*or without the controller"):
                idn.identify(data, method=method)
        assert any(text.startswith("made in closed loop") for text in idn.identify(data, check=False).warnings)
    data = made(u, y, reference_external=external)
    with pytest.raises(idn.UnfitError, match=r"reference_external differs.*'auto'"):
        idn.identify(data, method="oe")


def test_an_external_reference_that_is_all_of_the_reference_is_open_loop():
    data = record(0, seconds=2.0)
    data = made(data.reference.values, data.disc_measured.values, reference_external=data.reference.values)
    assert controller_of(data) == ""
    assert not idn.identify(data, 3).warnings


@pytest.mark.parametrize("name", ["none", "off", "No", " Open loop "])
def test_a_foreign_record_that_names_no_controller_is_open_loop(name):
    assert controller_of(record(0, seconds=0.5).assign_attrs(controller=name)) == ""


def test_a_short_or_resting_record_shows_nothing_of_feedback():
    assert fed_back(np.zeros((5000, 2)), np.ones((5000, 2))) == 0.0
    assert fed_back(np.ones((100, 2)), np.ones((100, 2))) == 0.0


def test_a_mode_above_the_nyquist_frequency_is_refused():
    check_modes(2 * np.pi * np.array([110.0, 0.49 / TS]), TS)
    for wrong in (87e3, np.nan):
        with pytest.raises(idn.UnfitError, match=r"mode at .* Hz"):
            check_modes(2 * np.pi * np.array([110.0, wrong]), TS)
