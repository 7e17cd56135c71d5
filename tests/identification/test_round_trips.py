"""File round trips of records and vectors: identical Datasets in every format, to the last bit."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra.numpy import arrays

import identification as idn
from fuzzing.disk import largest_file

SUFFIXES = (".csv", ".mat", ".nc")
FINITE = st.floats(allow_nan=False, allow_infinity=False)
TEXT = st.text(st.characters(exclude_categories=("Cs",)), min_size=1, max_size=10)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_record_comes_back_identical(record, tmp_path, suffix):
    record["disc_measured"].attrs["sensor"] = "eddy current"
    path = idn.save(record, tmp_path / f"record{suffix}")
    assert idn.read(path).identical(record)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_vectors_come_back_identical(vectors, tmp_path, suffix):
    assert idn.read(idn.save(vectors, tmp_path / f"vectors{suffix}")).identical(vectors)


@given(disc=arrays(float, (4, 2), elements=FINITE), attrs=st.dictionaries(TEXT, TEXT | st.integers() | FINITE))
def test_csv_keeps_every_bit_and_every_attribute(tmp_path_factory, disc, attrs):
    record = idn.from_arrays(np.arange(4) * 0.1, None, disc, attrs=attrs)
    back = idn.read(idn.save(record, tmp_path_factory.mktemp("csv") / "a.csv"))
    assert back.identical(record)
    assert back["disc_measured"].values.tobytes() == disc.tobytes()


@given(disc=arrays(float, (4, 2), elements=FINITE), pins=st.integers(1, 5))
def test_mat_keeps_every_bit(tmp_path_factory, disc, pins):
    record = idn.from_arrays(np.arange(4) * 0.1, None, disc, pin=np.ones((4, pins)))
    back = idn.read(idn.save(record, tmp_path_factory.mktemp("mat") / "a.mat"))
    assert back.identical(record)
    assert back["disc_measured"].values.tobytes() == disc.tobytes()


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_injectors_keep_their_numbers(record, tmp_path, suffix):
    some = record.isel(injector=[1, 3])
    assert idn.read(idn.save(some, tmp_path / f"a{suffix}")).identical(some)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_foreign_record_keeps_its_provenance(written, tmp_path, suffix):
    path = written("rig.csv", "time [ms],angle [deg],note\n0,0,1\n1,180,1\n")
    first = idn.read(path)
    assert first.attrs["source"] == "rig.csv" and first.attrs["unused_columns"] == ["note"]
    assert first["angle"].values == pytest.approx([0, np.pi]) and first["time"].values.tolist() == [0, 0.001]
    again = idn.read(idn.save(first, tmp_path / f"a{suffix}"))
    assert again.equals(first) and again.attrs["source_sha256"] == first.attrs["source_sha256"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_snapshots_of_the_film_stay_in_netcdf_alone_and_are_named(record, tmp_path, suffix):
    film = ("snapshot", "theta", "z"), np.ones((2, 4, 3)), {"units": "Pa"}
    whole = record.assign(film_pressure=film, snapshot_time=("snapshot", [0.0, 0.1]))
    whole = whole.assign_coords(theta=np.arange(4.0), z=np.arange(3.0))
    back = idn.read(idn.save(whole, tmp_path / f"a{suffix}"))
    assert back.identical(idn.held(whole, f"a{suffix}"))
    if suffix == ".nc":
        assert back.identical(whole)
    else:
        assert back.drop_attrs().identical(record.drop_attrs())
        assert idn.notes_of(back) == [f"not over time and so left out of a{suffix}: film_pressure, snapshot_time"]
        later = idn.read(idn.save(back, tmp_path / "later.nc"))
        assert idn.notes_of(later) == idn.notes_of(back)  # and true there


@pytest.mark.parametrize("suffix", [".csv", ".mat"])
def test_channels_of_several_bearings_are_columns_that_reading_lists(tmp_path, suffix):
    time, moves = np.arange(4) * 0.1, np.arange(16.0).reshape(4, 2, 2)
    record = idn.make_record(time, {"disc": moves[:, 0], "journals": moves}, bearings=["front", "rear"])
    assert idn.to_pandas(record)["journals_rear_x"].tolist() == moves[:, 1, 0].tolist()
    back = idn.read(idn.save(record, tmp_path / f"a{suffix}"))
    assert list(back) == ["disc"]
    assert back.attrs["unused_columns"] == [f"journals_{b}_{a}" for b in ("front", "rear") for a in "xy"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_failed_write_leaves_the_old_file_as_it_was(record, tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_text("mine")
    with largest_file(3000), pytest.raises(OSError, match=r"a\.\w+: cannot be written: it is larger") as caught:
        idn.save(record, path)
    assert caught.value.filename == str(path)
    assert path.read_text() == "mine" and len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    ("change", "name", "sentence"),
    [
        (lambda r: r, "a.xlsx", "'.xlsx'"),
        (lambda r: r.assign(extra=r["angle"]), "a.csv", "record.extra"),
        (lambda r: r.assign_attrs(a=object()), "a.csv", "attribute"),
        (lambda r: r.assign_attrs(a=object()), "a.nc", "record: netCDF"),
        (lambda r: r.assign(angle=r["angle"] * np.nan), "a.csv", "record.angle: "),
        (lambda r: r.assign_coords(time=r["time"].values[::-1]), "a.mat", "time falls"),
    ],
)
def test_what_a_format_cannot_hold_is_refused_and_nothing_written(record, tmp_path, change, name, sentence):
    with pytest.raises(idn.SchemaError, match=sentence):
        idn.save(change(record), tmp_path / name)
    assert not list(tmp_path.iterdir())
