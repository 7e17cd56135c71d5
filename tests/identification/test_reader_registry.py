"""Registry of readers: a format of one's own in one file, the choice by first bytes and suffix."""

from importlib import import_module
from pkgutil import iter_modules

import h5py
import numpy as np
import pytest

import identification as idn
from identification import readers
from identification.readers import READERS, reader, reader_of
from identification.records.columns import Column, DataTable

OWN = b"TWO1"


@pytest.fixture
def two():
    """A reader of two channels of doubles behind four bytes, which leaves the registry again."""

    @reader(".two", magic=OWN)
    def read_two(path):
        x, y = np.fromfile(path, offset=len(OWN)).reshape(-1, 2).T
        columns = (Column("disc_measured_x", x, "um"), Column("disc_measured_y", y, "um"))
        return DataTable("TWO", columns, time=np.arange(len(x)) * 2e-4)

    yield read_two
    READERS[:] = [one for one in READERS if one.function is not read_two]


def test_every_module_of_the_readers_registers_one():
    modules = [name for _, name, _ in iter_modules(readers.__path__)]
    assert len(modules) >= 6
    registered = {one.function.__module__ for one in readers.readers()}
    assert registered == {import_module(f"identification.readers.{name}").__name__ for name in modules}


@pytest.mark.parametrize("name", ["run.two", "run.dat"])
def test_a_format_of_ones_own_is_read_as_a_record(two, written, name):
    values = np.arange(20.0).reshape(10, 2)
    record = idn.read(written(name, OWN + values.tobytes()))
    np.testing.assert_allclose(record["disc_measured"].values, 1e-6 * values)
    assert record.attrs["source_format"] == "TWO"


def test_what_a_reader_of_ones_own_raises_on_damage_is_one_error_with_the_files_name(two, written):
    """Seventeen values are no pairs: the reader raises ValueError."""
    path = written("run.two", OWN + np.arange(17.0).tobytes())
    for look in (idn.read, idn.columns):
        with pytest.raises(idn.ReadError, match=r"run\.two") as caught:
            look(path)
        assert isinstance(caught.value.__cause__, Exception)


def test_a_file_that_does_not_begin_like_its_suffix_is_refused(two, written):
    with pytest.raises(idn.ReadError):
        reader_of(written("run.two", b"ONE1"))


@pytest.mark.parametrize(
    ("name", "head", "expected"),
    [
        ("a.mat", b"", "read_mat73"),
        ("a.h5", b"", "read_plain_hdf5"),
        ("a.nc", b"", "read_netcdf"),
        ("a.dat", b"", "read_netcdf"),
        ("a.mat", b"MATLAB 7.3", "read_mat73"),
        ("a.h5", b"MATLAB 7.3", "read_mat73"),
        ("a.dat", b"MATLAB 7.3", "read_mat73"),
    ],
)
def test_hdf5_goes_to_the_reader_of_its_header_and_suffix(tmp_path, name, head, expected):
    """A file of MATLAB 7.3 has the same two letters at byte 126 as one of version 5."""
    path = tmp_path / name
    with h5py.File(path, "w", userblock_size=512 if head else 0) as file:
        file["x"] = np.zeros(3)
    if head:
        with path.open("r+b") as file:
            file.write(head.ljust(124) + b"\x00\x02IM")
    assert reader_of(path).function.__name__ == expected
