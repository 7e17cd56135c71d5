"""Recovery of records from killed runs out of their temporary files."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

import h5py

from rotorsim.base.files import GROWING, left_behind, sweep, target_of
from rotorsim.base.hdf5 import DiskFile, check_hdf5
from rotorsim.experiments.recording import FEWEST

ENDED = "killed"


def recover(folder: Path) -> list[tuple[Path, int]]:
    """Bring back what killed runs of this computer had recorded in a folder, and remove their other temporary files.

    Parameters
    ----------
    folder : Path
        Where records are written; need not exist.

    Returns
    -------
    list of (Path, int)
        Files NAME-killed.nc, NAME-killed-2.nc ... and their numbers of samples.

    Raises
    ------
    OSError
        If a file cannot be moved; it stays as it is.
    """
    sweep(folder)
    found = []
    for part in left_behind(folder, GROWING):
        samples = _samples(part)
        if samples < FEWEST:
            part.unlink()
            continue
        path = _free(folder / target_of(part))
        os.rename(part, path)
        found.append((path, samples))
    return found


def duration(path: Path) -> float:
    """Length [s] of a record that a run wrote."""
    with h5py.File(path, "r") as file:
        return float(len(file["time"]) / file.attrs["sample_rate_hz"])


def _samples(part: Path) -> int:
    """Samples in a temporary file, which is marked; 0 if it was killed before its first flush or within one."""
    if check_hdf5(part) is not None:
        return 0
    with suppress(OSError, KeyError, RuntimeError), DiskFile(part, "r+") as disk:
        with h5py.File(disk, "r+", track_order=True) as file:
            samples = len(file["time"])
            file.attrs["ended"] = ENDED  # in the space that was reserved for the samples to come
        disk.finish()
        return samples
    return 0


def _free(path: Path) -> Path:
    """The first free name for what is left of a record."""
    number, free = 1, path.with_stem(f"{path.stem}-{ENDED}")
    while free.exists():
        number += 1
        free = path.with_stem(f"{path.stem}-{ENDED}-{number}")
    return free
