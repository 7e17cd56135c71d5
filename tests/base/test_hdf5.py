"""File object for libhdf5: bytes of a plain file, errors of the disk kept from libhdf5, space reserved in advance."""

import errno
import random
from pathlib import Path

import pytest
import xarray as xr

from fuzzing.disk import largest_file
from rotorsim.base.files import WriteError
from rotorsim.base.hdf5 import DiskFile, write_netcdf


def written(file: DiskFile, content: bytearray, rng: random.Random) -> None:
    """Write at a random place, into the file and into the content that it must have."""
    first = rng.randrange(len(content) + rng.choice([1, 100, 9000]))
    data = rng.randbytes(rng.choice([1, 10, 500, 4096, 10_000]))
    file.seek(first)
    assert file.write(data) == len(data)
    content.extend(bytes(max(first - len(content), 0)))
    content[first : first + len(data)] = data


def read(file: DiskFile, size: int) -> bytes:
    """All bytes, as libhdf5 would read them."""
    file.seek(0)
    found = bytearray(size)
    assert file.readinto(found) == size
    return bytes(found)


@pytest.mark.parametrize("seed", range(20))
def test_random_writes_leave_the_bytes_of_a_plain_file(tmp_path: Path, seed: int) -> None:
    rng, path, content = random.Random(seed), tmp_path / "a", bytearray()
    with DiskFile(path) as file:
        for _ in range(50):
            if rng.random() < 0.8:
                written(file, content, rng)
            elif rng.random() < 0.5:
                content.extend(bytes(rng.randrange(6000)))
                file.truncate(len(content))
            else:
                file.reserve(rng.randrange(20_000))
            assert read(file, len(content)) == bytes(content)
        file.copy_to(tmp_path / "b")
        file.finish()
    assert path.read_bytes() == (tmp_path / "b").read_bytes() == bytes(content)


@pytest.mark.parametrize("limit", range(0, 60_000, 3000))
def test_no_write_fails_on_a_disk_that_ends_and_what_was_written_is_read(tmp_path: Path, limit: int) -> None:
    rng, content = random.Random(limit), bytearray()
    with largest_file(limit), DiskFile(tmp_path / "a") as file:
        while len(content) <= 2 * limit + 20_000:
            written(file, content, rng)
            assert read(file, len(content)) == bytes(content)
        with pytest.raises(OSError) as raised:
            file.finish()
        assert raised.value is file.error


@pytest.mark.parametrize("reserves", [True, False], ids=["a disk that reserves", "a disk that takes zeros"])
def test_space_that_was_reserved_takes_writes_after_the_disk_has_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reserves: bool
) -> None:
    def refused(*arguments: int) -> None:
        raise OSError(errno.EOPNOTSUPP, "not supported")

    if not reserves:
        monkeypatch.setattr("rotorsim.base.hdf5.os.posix_fallocate", refused, raising=False)
    path = tmp_path / "a"
    with DiskFile(path) as file:
        file.reserve(3000)
        with largest_file(3000):
            with pytest.raises(OSError):
                file.reserve(3001)
            file.write(bytes(range(250)) * 12)
            file.finish()
    assert path.read_bytes() == bytes(range(250)) * 12


def test_a_dataset_that_does_not_fit_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    write_netcdf(path, xr.Dataset({"a": ("x", [1.0])}))
    before = path.read_bytes()
    with largest_file(20_000), pytest.raises(WriteError):
        write_netcdf(path, xr.Dataset({"a": ("x", [1.0] * 10_000)}))
    assert path.read_bytes() == before and [one.name for one in tmp_path.iterdir()] == ["a.nc"]
