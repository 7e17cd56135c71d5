"""Order tracking, spectra and summaries against signals with known amplitudes and phases."""

import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from identification import make_record
from rotorsim.base.errors import DataError
from rotorsim.experiments.summary import summarise
from rotorsim.signals.orders import find_resonances, track_orders
from rotorsim.signals.record_blocks import BLOCK, blocks, open_record
from rotorsim.signals.spectra import largest_sub_synchronous, waterfall

TS = 2e-4
AMPLITUDES = {1: (3e-6 * np.exp(-0.7j), 2e-6 * np.exp(-1.9j)), 2: (1e-6j, 0.4e-6), 3: (-0.3e-6, 0.2e-6 * np.exp(2j))}


def ramp(duration: float, start: float, stop: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s], speed [rad/s] and angle [rad] of a linear run-up between speeds in Hz."""
    time = np.arange(0, duration, TS)
    rate = (stop - start) / duration
    return time, 2 * np.pi * (start + rate * time), 2 * np.pi * (start * time + rate * time**2 / 2) + 0.3


def record_of(
    time: np.ndarray, speed: np.ndarray, angle: np.ndarray, disc: np.ndarray, **more: np.ndarray
) -> xr.Dataset:
    return make_record(time, {"disc": disc, "angle": angle, "speed": speed, **more})


def orders_of_a_ramp() -> xr.Dataset:
    time, speed, angle = ramp(20.0, 5.0, 90.0)
    disc = np.array([1e-6, -20e-6]) + 1e-7 * time[:, None]
    for n, pair in AMPLITUDES.items():
        disc = disc + np.real(np.outer(np.exp(1j * n * angle), pair))
    return record_of(time, speed, angle, disc)


def test_orders_of_a_ramp_come_out_with_amplitude_and_phase() -> None:
    """Constant amplitudes in a ramp lie in the span of the fit, so only round-off is left."""
    tracked = track_orders(orders_of_a_ramp())
    assert tracked.sizes["window"] > 50
    for n, pair in AMPLITUDES.items():
        np.testing.assert_allclose(
            tracked["amplitude"].sel(order=n), np.tile(pair, (tracked.sizes["window"], 1)), atol=1e-15
        )
    np.testing.assert_allclose(tracked["mean"][:, 1], -20e-6 + 1e-7 * tracked["time"], atol=1e-15)


def test_the_speed_of_a_window_is_that_of_its_middle() -> None:
    tracked = track_orders(orders_of_a_ramp())
    expected = 2 * np.pi * (5 + 85 / 20 * tracked["time"])
    np.testing.assert_allclose(tracked["speed"], expected, rtol=1e-9)


def test_a_round_forward_orbit_has_no_backward_part_and_y_lags_by_90_degrees() -> None:
    time, speed, angle = ramp(2.0, 40.0, 40.0)
    tracked = track_orders(record_of(time, speed, angle, 2e-6 * np.column_stack((np.cos(angle), np.sin(angle)))))
    first = tracked.sel(order=1).isel(window=0)
    assert complex(first["forward"]) == pytest.approx(2e-6, abs=1e-15)
    assert abs(complex(first["backward"])) < 1e-15
    assert -np.angle(first["amplitude"][1].item(), deg=True) == pytest.approx(90)


def test_amplitudes_are_zero_to_peak() -> None:
    time, speed, angle = ramp(2.0, 50.0, 50.0)
    record = record_of(time, speed, angle, 4e-6 * np.column_stack((np.cos(angle), 0 * angle)))
    assert abs(track_orders(record)["amplitude"][0, 0, 0].item()) == pytest.approx(4e-6)
    assert float(waterfall(record)["amplitude"].max()) == pytest.approx(4e-6, rel=1e-6)
    assert summarise(record, track_orders(record))["largest_orbit"]["um"] == pytest.approx(4, rel=1e-3)


def test_block_size_does_not_change_the_orders() -> None:
    record = orders_of_a_ramp()
    whole, small = track_orders(record, block=10**9), track_orders(record, block=777)
    xr.testing.assert_identical(whole, small)


def test_a_sine_between_the_lines_of_the_spectrum_shows_within_the_scalloping_of_hann() -> None:
    """Padded to twice its length, a Hann spectrum loses at most 0.36 dB = 4.1 % between two lines."""
    time, speed, angle = ramp(6.0, 100.0, 100.0)
    f = 37.3
    disc = 5e-6 * np.column_stack((np.cos(2 * np.pi * f * time), np.zeros_like(time)))
    spectra = waterfall(record_of(time, speed, angle, disc), lines=12)
    line = spectra["amplitude"].sel(axis="x").isel(line=3)
    assert float(spectra["frequency"][int(line.values.argmax())]) == pytest.approx(
        f, abs=spectra.attrs["resolution_hz"] / 4 + 1e-9
    )
    assert 0.959 * 5e-6 < float(line.max()) <= 5.01e-6


def test_the_full_spectrum_separates_forward_from_backward() -> None:
    """Taking the trend off a piece of half a second leaks 1e-3 of a line into its mirror image."""
    time, speed, angle = ramp(4.0, 100.0, 100.0)
    whirl = 3e-6 * np.exp(2j * np.pi * 50 * time) + 1e-6 * np.exp(-2j * np.pi * 80 * time)
    spectra = waterfall(record_of(time, speed, angle, np.column_stack((whirl.real, whirl.imag))))
    line = spectra["full"].isel(line=2)
    for f, size in ((50, 3e-6), (-80, 1e-6), (-50, 0), (80, 0)):
        assert float(line.sel(signed_frequency=f, method="nearest")) == pytest.approx(size, abs=5e-9)


@pytest.mark.parametrize(
    ("run", "size", "off", "rel"), [((4.0, 100.0, 100.0), 0.5, 0.01, 0.01), ((0.35, 200.0, 433.0), 36.0, 0.02, 0.05)]
)
def test_sub_synchronous_whirl_is_found_with_its_ratio(run, size, off, rel) -> None:
    """Also in a ramp from 12,000 to 26,000 rpm in .35 s, where the line moves by 110 Hz: one spectrum of it all has a
    third of its size.
    """
    time, speed, angle = ramp(*run)
    whirl = 3e-6 * np.exp(1j * angle) + 1e-6 * size * np.exp(0.48j * angle)
    found = largest_sub_synchronous(waterfall(record_of(time, speed, angle, np.column_stack((whirl.real, whirl.imag)))))
    assert found is not None
    assert found["ratio"] == pytest.approx(0.48, abs=off)
    assert found["um"] == pytest.approx(size, rel=rel)


def test_synchronous_motion_alone_has_nothing_below_1x() -> None:
    assert largest_sub_synchronous(waterfall(orders_of_a_ramp())) is None


def test_a_resonance_in_a_ramp_is_a_peak_and_an_end_is_flagged() -> None:
    time, speed, angle = ramp(40.0, 5.0, 90.0)
    f = speed / (2 * np.pi)
    x = 1e-6 / np.hypot(1 - (f / 50) ** 2, 0.1 * f / 50) * np.cos(angle)
    y = 1e-6 * (f / 90) ** 2 * np.sin(angle)
    record = record_of(time, speed, angle, np.column_stack((x, y)))
    peaks = summarise(record, track_orders(record))["peaks"]
    in_x, in_y = ([p for p in peaks if p["order"] == 1 and p["axis"] == a] for a in "xy")
    assert [p["local_maximum"] for p in in_x] == [True]
    assert in_x[0]["rpm"] == pytest.approx(3000, rel=0.01)
    assert in_x[0]["um"] == pytest.approx(10, rel=0.02)
    assert [p["local_maximum"] for p in in_y] == [False]
    assert in_y[0]["rpm"] > 5300


def test_growing_whirl_between_the_orders_makes_no_peaks_of_orders() -> None:
    time, speed, angle = ramp(40.0, 5.0, 90.0)
    whirl = 2e-6 * np.exp(1j * angle) + 4e-6 * np.exp((time - 40) / 5 + 0.45j * angle)
    tracked = track_orders(record_of(time, speed, angle, np.column_stack((whirl.real, whirl.imag))))
    assert np.abs(tracked["amplitude"].sel(order=[2, 3])).max() < 0.002 * 4e-6
    assert not any(p["local_maximum"] for p in summarise(orders_of_a_ramp(), tracked)["peaks"])


def test_film_contact_and_flow_are_summarised() -> None:
    time, speed, angle = ramp(3.0, 0.0, 60.0)
    h = np.where(np.abs(time - 2) < 0.01, 1e-6, 9e-6)
    film = {"h_min": h, "contact": (h < 2e-6).astype(float), "mass_flow": np.full(time.size, 4e-5)}
    record = record_of(time, speed, angle, 1e-6 * np.column_stack((np.cos(angle), np.sin(angle))), **film)
    found = summarise(record, track_orders(record))
    assert found["smallest_film"]["um"] == pytest.approx(1)
    assert found["contact"]["samples"] == int((h < 2e-6).sum())
    assert found["contact"]["first_time_s"] == pytest.approx(1.99, abs=2 * TS)
    assert found["contact"]["first_rpm"] == pytest.approx(60 * 20 * 1.99, rel=1e-3)
    density = 101325 / (287.05 * 273.15)
    assert found["mass_flow"]["mean_nl_min"] == pytest.approx(4e-5 / density * 60e3)
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize(
    ("duration", "start", "stop"), [(5.0, 0.0, 0.0), (0.01, 0.0, 1.0), (3.0, 25.0, 25.0), (3.0, 60.0, 0.0)]
)
def test_standstill_short_constant_and_falling_speed_give_a_summary(duration: float, start: float, stop: float) -> None:
    time, speed, angle = ramp(duration, start, stop)
    record = record_of(time, speed, angle, 1e-6 * np.column_stack((np.cos(angle), np.sin(angle))))
    found = summarise(record, track_orders(record))
    assert found["samples"] == time.size
    assert found["smallest_film"] is None and found["contact"] is None and found["mass_flow"] is None
    json.dumps(found, allow_nan=False)


def test_long_standstill_is_skipped_and_the_ramp_after_it_tracked() -> None:
    time, speed, angle = ramp(4.0, 10.0, 60.0)
    rest = np.arange(-100.0, -TS / 2, TS)
    time, speed = np.append(rest, time), np.append(0 * rest, speed)
    angle = np.append(0 * rest + angle[0], angle)
    record = record_of(time, speed, angle, 2e-6 * np.column_stack((np.cos(angle), np.sin(angle))))
    tracked = track_orders(record)
    assert tracked.sizes["window"] >= 8
    np.testing.assert_allclose(np.abs(tracked["amplitude"].sel(order=1))[-5:], 2e-6, rtol=1e-6)


def test_a_backward_turning_shaft_is_tracked() -> None:
    time, speed, angle = ramp(2.0, -30.0, -30.0)
    tracked = track_orders(record_of(time, speed, angle, 2e-6 * np.column_stack((np.cos(angle), np.sin(angle)))))
    assert abs(complex(tracked["forward"].sel(order=1)[0])) == pytest.approx(2e-6)
    assert float(tracked["speed"][0]) < 0


def test_a_missing_variable_is_named() -> None:
    record = orders_of_a_ramp().drop_vars("angle")
    with pytest.raises(DataError, match="angle"):
        track_orders(record)
    with pytest.raises(DataError, match="disc_measured"):
        track_orders(record.drop_vars("disc"))


def test_a_file_is_read_in_blocks_and_gives_the_same_numbers(tmp_path: Path) -> None:
    record = orders_of_a_ramp()
    record.to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    with open_record(tmp_path / "run.nc") as opened:
        assert all(len(b["time"]) <= BLOCK for b in blocks(opened, ["time"]))
        xr.testing.assert_identical(track_orders(opened), track_orders(record))


def test_what_is_no_record_is_refused_with_its_name(tmp_path: Path) -> None:
    (tmp_path / "no.nc").write_text("not a record")
    with pytest.raises(DataError, match=r"no\.nc"):
        open_record(tmp_path / "no.nc")


@pytest.mark.parametrize("encoding", [{}, {"dtype": "i4", "scale_factor": 1e-9, "_FillValue": -(2**31)}])
def test_an_opened_record_holds_the_values_of_its_file_also_where_they_are_coded_and_when_it_is_pickled(
    tmp_path: Path, encoding: dict[str, Any]
) -> None:
    path = tmp_path / "run.nc"
    orders_of_a_ramp().to_netcdf(path, engine="h5netcdf", encoding={"disc": encoding}, unlimited_dims=["time"])
    with xr.open_dataset(path, engine="h5netcdf", create_default_indexes=False) as known, open_record(path) as opened:
        assert opened.identical(known)
        assert opened.xindexes.keys() == known.xindexes.keys()
        assert opened.encoding == known.encoding
        for piece in (slice(5, 900), slice(None, None, 7), slice(90, 5, -3), [3, 5], -1):
            assert np.array_equal(opened["disc"].isel(time=piece), known["disc"].isel(time=piece))
        assert pickle.loads(pickle.dumps(opened)).identical(known)
    path.unlink()


def test_windows_of_a_fast_shaft_are_shorter_than_a_quarter_of_a_second():
    """At 2500 turns a second, sampled at 50 kHz: windows of 60 revolutions, 24 ms."""
    time = np.arange(10_000) / 50e3
    angle = 2 * np.pi * 2500 * time
    shown = np.stack([1e-6 * np.cos(angle), 1e-6 * np.sin(angle)], axis=1)
    record = xr.Dataset(
        {"disc": (("time", "axis"), shown), "angle": ("time", angle)}, coords={"time": time, "axis": ["x", "y"]},
        attrs={"sample_rate_hz": 50e3},
    )  # fmt: skip
    found = track_orders(record, (1,))
    assert found.sizes["window"] == 8
    np.testing.assert_allclose(abs(found["amplitude"].values[:, 0]), 1e-6, rtol=1e-9)


def started_at_speed(noise: float = 0.0, zeta: float = 0.02) -> tuple[xr.Dataset, float]:
    """A run from 100 to 130 Hz that starts at rest in its equilibrium, and the time [s] of its free decay to 1 %."""
    time, speed, angle = ramp(20.0, 100.0, 130.0)
    omega = 2 * np.pi * 49.0
    free = -2e-6 * np.exp((-zeta + 1j * np.sqrt(1 - zeta**2)) * omega * time)
    whirl = 2e-6 * np.exp(1j * (angle - angle[0])) + free
    rng = np.random.default_rng(3)
    disc = np.column_stack((whirl.real, whirl.imag)) + noise * rng.normal(size=(time.size, 2))
    record = record_of(time, speed, angle, disc).assign_attrs(machine="", experiment="runup")
    return record, float(np.log(100) / (zeta * omega))


@pytest.mark.parametrize("noise", [0.0, 1e-7])
def test_the_way_from_rest_onto_the_orbit_is_left_out_of_the_numbers(noise: float) -> None:
    """Free vibration at .49 X with the size of the orbit: the start of the run, and no whirl of the rotor."""
    record, decay = started_at_speed(noise)
    found = summarise(record, track_orders(record))
    assert 0.3 * decay < found["start_transient_s"] < 3 * decay + 0.5
    below = found["sub_synchronous"]
    assert below is None or below["um"] < 0.05
    assert found["largest_orbit"]["um"] == pytest.approx(2, rel=0.05 + 5e6 * noise)
    assert len(track_orders(record)["time"]) < len(track_orders(record.drop_attrs())["time"])


@pytest.mark.parametrize(("rate", "settled"), [(0.15, False), (1.0, True)])
def test_a_slow_start_at_a_held_speed_is_left_out_and_one_that_outlasts_half_of_the_run_is_named(rate, settled):
    """A decay of `rate` [1/s] that no eight windows show; the orbit was reported twice as large, with its start."""
    time, speed, angle = ramp(20.0, 100.0, 100.0)
    whirl = 2e-6 * np.exp(1j * (angle - angle[0])) - 2e-6 * np.exp((-rate + 2j * np.pi * 49.0) * time)
    disc = np.column_stack((whirl.real, whirl.imag))
    record = record_of(time, speed, angle, disc).assign_attrs(machine="", experiment="steady")
    found = summarise(record, track_orders(record))
    assert found["start_settled"] is settled
    end = found["start_transient_s"]
    assert end == pytest.approx(10.0, abs=0.5) if not settled else 3.0 < end < 7.0
    orbit = 2.0 * (1 + np.exp(-rate * end))
    assert found["largest_orbit"]["um"] == pytest.approx(orbit, rel=0.05)


def test_a_short_run_at_a_held_speed_leaves_its_start_out():
    """Fewer windows than the median takes."""
    time, speed, angle = ramp(2.0, 100.0, 100.0)
    whirl = 2e-6 * np.exp(1j * (angle - angle[0])) - 2e-6 * np.exp((-25.0 + 2j * np.pi * 49.0) * time)
    record = record_of(time, speed, angle, np.column_stack((whirl.real, whirl.imag)))
    found = summarise(record := record.assign_attrs(machine="", experiment="steady"), track_orders(record))
    assert 0.05 < found["start_transient_s"] < 0.6 and found["start_settled"]
    assert found["largest_orbit"]["um"] == pytest.approx(2.0, rel=0.02)


def test_a_whirl_that_stays_or_grows_is_no_start_transient() -> None:
    record, _ = started_at_speed(zeta=-0.0004)
    found = summarise(record, track_orders(record))
    assert found["start_transient_s"] == 0.0
    assert found["sub_synchronous"]["ratio"] == pytest.approx(0.4, abs=0.1)


def test_a_run_from_rest_and_a_measured_record_keep_their_start() -> None:
    record, _ = started_at_speed()
    assert summarise(record.drop_attrs(), track_orders(record.drop_attrs()))["start_transient_s"] == 0.0
    ramped = orders_of_a_ramp().assign_attrs(machine="", experiment="runup")
    assert summarise(ramped, track_orders(ramped))["start_transient_s"] == 0.0


def test_an_order_is_reported_where_it_is_resolved_alone() -> None:
    """2X in the noise has no largest value; one in the middle that is no peak is at no end of the run."""
    time, speed, angle = ramp(30.0, 10.0, 90.0)
    rng = np.random.default_rng(1)
    first = 3e-6 * np.column_stack((np.cos(angle), np.sin(angle)))
    record = record_of(time, speed, angle, first + 2e-7 * rng.normal(size=first.shape))
    peaks = summarise(record, track_orders(record))["peaks"]
    assert {p["order"] for p in peaks} == {1}
    hump = 1e-6 * (1 + 0.05 * np.sin(np.pi * time / 30))[:, None] * np.column_stack((np.cos(2 * angle), 0 * angle))
    record = record_of(time, speed, angle, first + hump)
    in_x = [p for p in summarise(record, track_orders(record))["peaks"] if p["order"] == 2 and p["axis"] == "x"]
    assert [(p["local_maximum"], p["at_end"]) for p in in_x] == [(False, "")]


def test_an_order_above_the_half_of_the_sampling_rate_is_not_resolved() -> None:
    """At 1000 turns a second and 5 kHz, 3X would be an alias at 2000 Hz."""
    time, speed, angle = ramp(4.0, 600.0, 1000.0)
    record = record_of(time, speed, angle, 1e-6 * np.column_stack((np.cos(3 * angle), np.cos(angle))))
    tracked = track_orders(record)
    slow = np.abs(tracked["speed"].values) * 3 < 0.9 * np.pi / TS
    third = tracked["resolved"].sel(order=3, axis="x").values
    assert 0 < slow.sum() < slow.size
    assert third[slow].all() and not third[~slow].any()


def test_an_order_that_grows_until_it_is_tracked_no_more_passes_no_resonance() -> None:
    """The last window that resolves it is an end of what was tracked, and no peak: beyond, nothing is known."""
    time, speed, angle = ramp(4.0, 600.0, 1000.0)
    size = 1e-6 * speed / speed[-1]
    record = record_of(time, speed, angle, size[:, None] * np.column_stack((np.cos(3 * angle), np.cos(angle))))
    tracked = track_orders(record)
    resolved = np.flatnonzero(tracked["resolved"].sel(order=3, axis="x").values)
    (found,) = find_resonances(tracked, 3, "x")
    assert resolved[-1] < tracked.sizes["window"] - 1
    assert (found["local_maximum"], found["at_end"]) == (False, "end")
    assert found["rpm"] * np.pi / 30 == pytest.approx(tracked["speed"].values[resolved[-1]])


@pytest.mark.parametrize(("rise", "end"), [(1.0, "end"), (-1.0, "start")])
def test_extremes_at_an_end_of_the_run_are_flagged(rise: float, end: str) -> None:
    time, speed, angle = ramp(10.0, 50.0, 60.0)
    size = 2e-6 * (1 + 0.3 * rise * time / 10)
    disc = size[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
    film = 1e-5 - 2 * size
    found = summarise(
        record_of(time, speed, angle, disc, h_min=film), track_orders(record_of(time, speed, angle, disc))
    )
    assert found["largest_orbit"]["at_end"] == end and found["smallest_film"]["at_end"] == end
    assert {p["at_end"] for p in found["peaks"] if p["order"] == 1} == {end}
