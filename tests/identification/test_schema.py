"""Record schema: records and vectors from arrays, and validation errors."""

import numpy as np
import pytest
import xarray as xr

import identification as idn

T = np.arange(10) / 5000
XY = np.zeros((10, 2))


def test_from_arrays_gives_a_record_of_the_schema():
    record = idn.from_arrays(T, XY, XY, speed=100, journal=XY)
    assert idn.validate(record) is record
    assert set(record) == {"reference", "disc_measured", "journal", "speed", "pressure"}
    assert record["speed"].dims == ("time",) and record["speed"].values.tolist() == [100.0] * 10
    assert record["disc_measured"].attrs["units"] == "m"


def test_from_arrays_copies():
    disc = np.zeros((10, 2))
    record = idn.from_arrays(T, None, disc)
    disc[:] = 1
    assert not record["disc_measured"].values.any() and "reference" not in record


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((T, XY.T, XY), r"record.reference: shape \(2, 10\), expected \(n, 2\) with n = 10"),
        ((T, XY, XY[:5]), r"record.disc_measured: shape \(5, 2\)"),
        ((T[None], XY, XY), r"record.time: shape \(1, 10\)"),
        ((T, "abc", XY), "record.reference: "),
        ((T, XY * 1j, XY), "record.reference: "),
        ((T, [[1], [2, 3]], XY), "record.reference: "),
        ((T, XY, np.ma.masked_less(XY, 1)), "record.disc_measured: 20 NaN"),
        ((T, XY, np.full((10, 2), np.nan)), "record.disc_measured: 20 NaN.* time 0"),
        ((T[:1], XY[:1], XY[:1]), "record.time: 1 samples.* 2"),
    ],
)
def test_arrays_that_do_not_fit_are_named(arguments, sentence):
    with pytest.raises(idn.SchemaError, match=sentence):
        idn.from_arrays(*arguments)


def test_an_unknown_variable_is_answered_with_the_nearest():
    with pytest.raises(idn.SchemaError, match=r"record.journl: .*'journal'"):
        idn.from_arrays(T, XY, XY, journl=XY)


@pytest.mark.parametrize(
    ("time", "sentence"),
    [
        (np.delete(np.arange(100) / 5000, slice(40, 50)), "record.time: 1 .*0.0002 s.* 0.0022 s"),
        (np.where(np.arange(100) == 40, np.nan, np.arange(100)), "record.time: 1 NaN.* sample 41"),
        (np.where(np.arange(100) == 40, 39, np.arange(100)), "record.time: .* 1 places.* sample 40"),
        (np.arange(100)[::-1], "record.time: .* 99 places"),
        (np.arange(100) + 0.3 * (np.arange(100) % 2), "record.time: .* 0.7 s to 1.3 s"),
        (np.arange(100) * np.linspace(1, 1.04, 100), "record.time: "),
    ],
)
def test_a_clock_that_does_not_tick_evenly_is_refused(time, sentence):
    with pytest.raises(idn.SchemaError, match=sentence):
        idn.from_arrays(time, np.zeros((time.size, 2)), None)


def test_rounded_time_stamps_are_even_and_the_sampling_time_is_the_mean():
    time = np.round(np.arange(1000) / 25600, 6)
    record = idn.from_arrays(time, np.zeros((1000, 2)), None)
    assert idn.sampling_time(record) == pytest.approx(1 / 25600, rel=1e-4)


def test_a_late_start_of_a_fast_clock_is_even():
    time = 1.7e9 + np.arange(1000) / 50_000
    idn.from_arrays(time, np.zeros((1000, 2)), None)


def test_require_names_what_a_use_lacks():
    record = idn.from_arrays(T, None, XY)
    assert idn.require(record, "disc_measured", use="a test") is record
    with pytest.raises(idn.SchemaError, match=r"no reference and no angle.*identification"):
        idn.require(record, "reference", "angle", use="identification")


def test_vectors_follow_their_schema(vectors):
    assert vectors["amplitude"].dims == ("speed", "order", "axis")
    assert idn.validate(vectors) is vectors
    assert idn.validate(vectors.isel(speed=slice(None, None, -1))).sizes["speed"] == 7


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda v: v.drop_vars("phase"), "vectors: no 'phase'"),
        (lambda v: v.isel(speed=[0, 2, 1]), "vectors.speed: "),
        (lambda v: v.isel(speed=[0, 0, 1]), "vectors.speed: "),
        (lambda v: v.assign_coords(order=[1, 2, 2]), r"vectors.order: \[1, 2, 2\]"),
        (lambda v: v.assign_coords(order=[0.5, 1, 2]), "vectors.order: "),
        (lambda v: v.assign_coords(axis=["y", "x"]), r"record\.axis"),
        (lambda v: v.assign(amplitude=(v["amplitude"] * -1).assign_attrs(units="m")), "vectors.amplitude"),
        (lambda v: v.assign(amplitude=v["amplitude"].assign_attrs(units="um")), "unit 'um', expected 'm'"),
        (lambda v: v.assign(phase=(v["phase"] * np.nan).assign_attrs(units="rad")), "42 NaN or infinite"),
    ],
)
def test_vectors_that_do_not_fit_are_refused(vectors, change, sentence):
    with pytest.raises(idn.SchemaError, match=sentence):
        idn.validate(change(vectors))


def test_a_record_with_renamed_axes_or_texts_is_refused(record):
    with pytest.raises(idn.SchemaError, match=r"record\.axis"):
        idn.validate(record.assign_coords(axis=["h", "v"]))
    texts = xr.Variable("time", ["a"] * 200, {"units": "rad"})
    with pytest.raises(idn.SchemaError, match=r"record\.angle"):
        idn.validate(record.assign(angle=texts))
