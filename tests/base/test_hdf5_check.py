"""HDF5 check in a child process: crashes, hangs and oversized files end in one sentence."""

import json
import os
import pickle
import random
import struct
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import h5py
import numpy as np
import pytest

import identification as idn
from rotorsim.base import hdf5
from rotorsim.base.errors import DataError
from rotorsim.base.hdf5 import check_hdf5
from rotorsim.signals.record_blocks import open_record

SEEDS = [0, 1, 2, 3, 12, 36, 137]
"""On the damage of three of these libhdf5 2.0 crashes, and 137 hides the address of an object that crashes it."""
MORE = range(400)
"""Seeds of damage: libhdf5 crashes on 23, and on one, 246, it does not end."""


def undamaged(path: Path, old: bool) -> bytes:
    """A file with groups, chunks, filters, texts, scales and attributes, in the old layout or the new."""
    version = ("earliest", "latest") if old else ("v108", "v108")
    with h5py.File(path, "w", libver=version, track_order=not old) as file:
        group = file.create_group("group")
        for i in range(12):
            file[f"v{i}"] = np.arange(3.0)
            file[f"v{i}"].attrs["units"] = "m"
            group[f"w{i}"] = i
        time = file.create_dataset(
            "time", data=np.arange(2000) / 5e3, chunks=(10,), compression="gzip", fletcher32=True
        )
        file.create_dataset("text", data=["abc" * i for i in range(30)], dtype=h5py.string_dtype())
        angle = file.create_dataset("angle", (2000,), "f8", maxshape=(None,), chunks=(10,))
        angle[:1000] = 1
        time.make_scale("time")
        angle.dims[0].attach_scale(time)
        for i in range(20):
            file.attrs[f"a{i}"] = "text" * i
    return path.read_bytes()


def damaged(content: bytes, seed: int) -> bytes:
    """Content with an address in it, or some bytes, replaced."""
    rng, out = random.Random(seed), bytearray(content)
    kind = rng.random()
    for _ in range(rng.choice([1, 1, 2, 4])):
        at = rng.randrange(len(out) - 8)
        if kind < 0.5:
            while not 48 <= struct.unpack_from("<Q", out, at)[0] < len(out):
                at = rng.randrange(len(out) - 8)
            address = struct.unpack_from("<Q", out, at)[0]
            other = rng.choice([at // 8 * 8, rng.randrange(len(out)), address + 8, address - 8, 2**40, 2**63])
            struct.pack_into("<Q", out, at, other)
        elif kind < 0.8:
            out[at] = rng.choice([0, 1, 127, 128, 255, rng.randrange(256)])
        else:
            out[at : at + 4] = rng.choice([b"\xff" * 4, b"\0" * 4, b"\0\0\0\x7f"])
    return bytes(out)


@pytest.mark.parametrize("seeds", [SEEDS, pytest.param(MORE, marks=pytest.mark.slow)], ids=["some", "many"])
def test_no_damaged_file_ends_the_process_that_reads_records(tmp_path: Path, seeds: Sequence[int]) -> None:
    paths = []
    whole = [undamaged(tmp_path / "old.h5", old=True), undamaged(tmp_path / "new.h5", old=False)]
    for seed in seeds:
        paths.append(tmp_path / f"{seed}.nc")
        paths[-1].write_bytes(damaged(whole[seed % 2], seed))
    code = (
        "import json, sys, identification as idn; from rotorsim.base import hdf5; hdf5.SECONDS = 3.0\n"
        "for path in json.load(sys.stdin):\n"
        "    try: idn.read(path)\n"
        "    except (idn.ReadError, idn.SchemaError) as error: assert len(str(error).splitlines()) == 1, error\n"
        "print('alive')"
    )
    text = json.dumps([str(path) for path in paths])
    done = subprocess.run([sys.executable, "-c", code], input=text, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "alive\n", "")


def record(path: Path) -> Path:
    """A small record."""
    return idn.save(idn.from_arrays(np.arange(50) / 5e3, np.ones((50, 2)), np.ones((50, 2)) * 1e-6), path)


def test_a_file_that_claims_to_hold_more_than_memory_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.nc", "w") as file:
        file.create_dataset("time", (10**12,), "f8", chunks=(1000,))
    with pytest.raises(idn.ReadError, match="claims to hold more than fits into memory; it is damaged: copy it again"):
        idn.read(tmp_path / "a.nc")
    with pytest.raises(DataError, match="claims to hold more than fits"):
        open_record(tmp_path / "a.nc")


def test_an_undamaged_file_is_read_in_a_child_once_until_it_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    ask = hdf5._ask
    monkeypatch.setattr(hdf5, "_ask", lambda path: asked.append(path) or ask(path))
    path = record(tmp_path / "a.nc")
    assert check_hdf5(path) is None and not asked  # written by this process
    os.utime(path, ns=(1, 1))
    for _ in range(3):
        assert check_hdf5(path) is None
    assert len(asked) == 1


def test_a_child_that_was_killed_is_replaced(tmp_path: Path) -> None:
    for number in range(2):
        path = record(tmp_path / f"{number}.nc")
        os.utime(path, ns=(1, 1))
        assert check_hdf5(path) is None
        hdf5._started().process.kill()


def interrupted(stream: object) -> None:
    """Ctrl-C while an answer is waited for."""
    raise KeyboardInterrupt


def test_an_interrupted_check_does_not_answer_for_the_next_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    good, bomb = record(tmp_path / "good.nc"), tmp_path / "bomb.nc"
    os.utime(good, ns=(1, 1))
    with h5py.File(bomb, "w") as file:
        file.create_dataset("time", (10**12,), "f8", chunks=(1000,))
    load = pickle.load
    monkeypatch.setattr("rotorsim.base.processes.pickle.load", interrupted)
    with pytest.raises(KeyboardInterrupt):
        check_hdf5(bomb)
    monkeypatch.setattr("rotorsim.base.processes.pickle.load", load)
    assert check_hdf5(good) is None
