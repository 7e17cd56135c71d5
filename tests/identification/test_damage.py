"""Randomly damaged data files: read correctly or refused with one sentence."""

import numpy as np
import pytest

import identification as idn

N = 60


def made():
    rng = np.random.default_rng(0)
    return idn.from_arrays(
        np.arange(N) / 5000, np.ones((N, 2)), rng.normal(size=(N, 2)) * 1e-6, angle=np.arange(N) * 0.02
    )


def text_with_decimal_commas(path):
    path.write_text("time;angle\n" + "".join(f"{i},5;{i}\n" for i in range(N)))
    return path


def tdms(path):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("rig", "angle", np.arange(N) * 1.0, {"wf_increment": 2e-4})])
    return path


WRITERS = {
    "a.csv": lambda path: idn.save(made(), path),
    "b.csv": text_with_decimal_commas,
    "a.mat": lambda path: idn.save(made(), path),
    "a.tdms": tdms,
}


def damaged(content, rng):
    """Content that is cut, overwritten or stretched somewhere."""
    at = int(rng.integers(1, len(content)))
    some = rng.integers(0, 256, int(rng.integers(1, 20)), dtype=np.uint8).tobytes()
    return (content[:at], content[:at] + some + content[at + len(some) :], content[:at] + some + content[at:])[
        rng.integers(3)
    ]


@pytest.mark.parametrize("name", WRITERS)
def test_damage_ends_in_a_sentence_or_in_a_record(tmp_path, name):
    content = WRITERS[name](tmp_path / name).read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(150):
        (tmp_path / name).write_bytes(damaged(content, rng))
        try:
            idn.examine(idn.load(tmp_path / name))
        except (idn.ReadError, idn.SchemaError) as error:
            assert "\n" not in str(error) and str(error).isprintable() and len(str(error)) < 700
