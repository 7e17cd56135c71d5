"""Archives of other people: read within limits, unpacked where they belong, refused in a sentence otherwise."""

import io
import struct
import zipfile
from contextlib import suppress

import numpy as np
import pytest
from scipy.io import savemat

import rotorsim as rs
from rotorsim.base import input_files
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.input_files import ArchiveError, read_archive, unpack
from rotorsim.discrepancy.files import from_bytes


def zipped(files, method=zipfile.ZIP_DEFLATED, **attributes):
    """Bytes of an archive of these names and contents."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", method) as made:
        for name, data in files:
            entry = zipfile.ZipInfo(name)
            entry.compress_type = method
            for attribute, value in attributes.items():
                setattr(entry, attribute, value)
            made.writestr(entry, data)
    return content.getvalue()


def patched(data, position, value, form="<H"):
    """An archive with another number in the entry of its table of contents."""
    at = data.index(b"PK\x01\x02") + position
    return data[:at] + struct.pack(form, value) + data[at + struct.calcsize(form) :]


def test_an_archive_comes_back_as_it_was_written(tmp_path):
    rng = np.random.default_rng(0)
    files = {f"folder {k}/file_{k}.bin": rng.bytes(k) for k in range(0, 3000, 300)} | {"ä.csv": b"0" * 5_000_000}
    for method in input_files.METHODS:
        (tmp_path / "a.zip").write_bytes(zipped(files.items(), method))
        assert read_archive(tmp_path / "a.zip") == files
    unpack(files, tmp_path / "out")
    assert {path.relative_to(tmp_path / "out").as_posix() for path in (tmp_path / "out").rglob("*.*")} == set(files)


NAMES = (
    "/etc/passwd", "../up", "a/../../up", "..", "C:/x", "c:x", "a\\..\\b", "\\\\host\\share",
    "nul\x1b[2J", "line\nbreak",
    "x" * 500, "\u202etxt.exe",
)  # fmt: skip
MB = 1_000_000
PLAIN = zipped([("a", b"abc")])
HOSTILE = {
    **{f"name {k}": zipped([(name, b"")]) for k, name in enumerate(NAMES)},
    "bomb": zipped([("a", bytes(60 * MB))]),
    "bomb of many": zipped([(f"a{k}", bytes(MB)) for k in range(60)]),
    "many": zipped([(f"a{k}", b"") for k in range(6000)]),
    "link": zipped([("a", b"/etc/passwd")], external_attr=0o120777 << 16),
    "device": zipped([("a", b"")], external_attr=0o020666 << 16),
    "twice": zipped([("a", b"1"), ("A", b"2")]),
    "encrypted": patched(PLAIN, 8, 1),
    "unknown method": patched(PLAIN, 10, 95),
    "bzip2": zipped([("a", b"abc")], zipfile.ZIP_BZIP2),
    "lzma": zipped([("a", b"abc")], zipfile.ZIP_LZMA),
    "size too small": patched(PLAIN, 24, 1, "<L"),
    "size of 4 GB": patched(PLAIN, 24, 2**32 - 2, "<L"),
    "wrong sum": patched(PLAIN, 16, 1, "<L"),
    "place beyond the end": patched(PLAIN, 42, 10_000_000, "<L"),
    "cut": PLAIN[:-10],
    "empty": b"",
    "text": b"no archive",
    "end alone": PLAIN[-22:],
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_archive_is_refused_with_a_sentence(kind, tmp_path):
    (tmp_path / "a.zip").write_bytes(HOSTILE[kind])
    for source in (HOSTILE[kind], tmp_path / "a.zip"):
        if kind == "end alone":  # its table of contents lies before the file
            with pytest.raises(ArchiveError):
                read_archive(source)
            continue
        with pytest.raises(ArchiveError) as caught:
            read_archive(source)
        assert str(caught.value).isprintable() and len(str(caught.value)) < 300


def test_any_damage_of_an_archive_is_refused_or_does_no_harm():
    rng = np.random.default_rng(1)
    whole = zipped([("a", b"abc" * 100), ("b/c", rng.bytes(300))])
    for _ in range(2000):
        data = bytearray(whole)
        for _ in range(rng.integers(1, 4)):
            data[rng.integers(len(data))] = rng.integers(256)
        try:
            files = read_archive(bytes(data))
        except ArchiveError:
            continue
        assert sum(map(len, files.values())) <= 1000 and all(".." not in name for name in files)


def test_a_file_that_is_also_a_folder_is_refused(tmp_path):
    with pytest.raises(ArchiveError, match="both as a file and as a folder"):
        unpack({"a": b"", "a/b": b""}, tmp_path)


@pytest.mark.parametrize("load", [rs.load_law, rs.load_model])
def test_a_matlab_file_that_unpacks_without_end_or_is_damaged_is_refused(load, tmp_path):
    path = tmp_path / "law.mat"
    savemat(path, {"A": np.zeros((4000, 4000)), "Ts": 1.0}, do_compression=True)
    assert path.stat().st_size < 1_000_000
    with pytest.raises(RotorsimError, match="unpacks to more than 100 MB"):
        load(path)
    savemat(path, {name: np.eye(2) for name in "ABCD"} | {"Ts": 1e-3}, do_compression=True)
    whole, rng = path.read_bytes(), np.random.default_rng(0)
    for _ in range(200):
        data = bytearray(whole[: rng.integers(len(whole) + 1)] if rng.random() < 0.3 else whole)
        for _ in range(rng.integers(1, 4) if data else 0):
            data[rng.integers(len(data))] = rng.integers(256)
        path.write_bytes(data)
        with suppress(RotorsimError):
            load(path)


def test_arrays_that_claim_more_than_there_is_are_refused():
    header = b"\x93NUMPY\x01\x00v\x00" + b"{'descr': '<f8', 'fortran_order': False, 'shape': (%d,), }"
    for size in (10**9, 10**15, 10**30):
        content = (header % size).ljust(127) + b"\n"
        with pytest.raises(DataError, match="is damaged"):
            from_bytes(zipped([("content.npy", content)]), "{}")
    with pytest.raises(DataError, match="encrypted"):
        from_bytes(HOSTILE["encrypted"], "{}")
