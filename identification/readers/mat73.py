"""MATLAB files of version 7.3 (HDF5 with MATLAB's class attributes and transposed matrices)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from identification.readers.hdf5 import opened
from identification.readers.mat import HEADER, build, refusal
from identification.records.table import Table

_KINDS = {"function_handle": "function"}


def read_mat73(path: Path) -> Table:
    """Table of a v7.3 file; references, cells and objects are not followed."""
    import h5py

    arrays, others, header = {}, {}, None
    with opened(path) as file:
        for name, item in file.items():
            if name.startswith("#"):  # where MATLAB keeps what references lead to
                continue
            kind = _kind(item)
            if name == HEADER and kind == "char":
                header = "".join(map(chr, np.ravel(item[()]).astype(int)))
                continue
            shape = tuple(reversed(item.shape)) if isinstance(item, h5py.Dataset) and item.shape else (0, 0)
            if reason := refusal(shape, kind):
                others[name] = reason
            else:
                arrays[name] = np.asarray(item[()]).T
    return build("MATLAB v7.3", arrays, others, header)


def _kind(item: Any) -> str:
    """MATLAB's class of an object; without it, by its type in HDF5."""
    import h5py

    if "MATLAB_object_decode" in item.attrs:
        return "opaque"
    named = item.attrs.get("MATLAB_class")
    if named is not None:
        text = named.decode("ascii", "replace") if isinstance(named, bytes) else str(named)
        kind = _KINDS.get(text, text)
        numeric = isinstance(item, h5py.Dataset) and item.dtype.kind in "fiub"
        return kind if numeric or kind in ("cell", "function", "opaque") else "struct"
    if not isinstance(item, h5py.Dataset):
        return "struct"
    return "double" if item.dtype.kind in "fiub" else "object"
