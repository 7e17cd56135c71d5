"""Random data files and mappings, whole and damaged, and calls of `rotorsim data` on them."""

import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

import identification as idn
from fuzzing.values import NONSENSE

MORE = {
    "check": [[], [], [], ["--json"], ["--json"], ["--force"]],
    "convert": [[], [], [], ["--force"], ["--force"], ["extra"]],
    "mapping": [[], [], [], [], ["extra"]],
}
"""Further arguments of each command, some of them unknown to it."""
N = 40
NAMES = ("a.csv", "a.mat", "a.nc", "b.csv")
MAPPING = """[time]
column = "t"
unit = "ms"
[channels.disc_measured.x]
column = "X probe"
unit = "V"
sensitivity = "8 V/mm"
sign = -1
[channels.disc_measured.y]
column = 3
unit = "um"
[channels.speed]
column = "n"
unit = "rpm"
[constants]
pressure = "0.3 MPa"
"""
WORDS = (
    *NONSENSE, "[time]", "[channels.pin.1]", "column = 99", "column = -1", 'unit = "furlong"', "scale = 1e400",
    "sign = 0", "[file]", 'delimiter = "space"', "nan", "-inf", '"', ";", ",", "\0", "1e999", "t,t,t", "\ufeff",
)  # fmt: skip


@lru_cache
def contents() -> dict[str, bytes]:
    """Good files by name: records in three formats and a rig's own table."""
    rng = np.random.default_rng(0)
    good = idn.from_arrays(
        np.arange(N) / 5000, np.ones((N, 2)), rng.normal(size=(N, 2)) * 1e-6, angle=np.arange(N) * 0.02, speed=100.0
    )
    rows = np.column_stack([np.arange(N) * 0.2, rng.normal(size=(N, 2)), np.full(N, 6000)])
    table = "\n".join(["t,X probe,Y probe,n", *(",".join(f"{v:.9g}" for v in row) for row in rows)])
    made = {"b.csv": table.encode()}
    with tempfile.TemporaryDirectory() as folder:
        for name in NAMES[:3]:
            idn.save(good, Path(folder) / name)
            made[name] = (Path(folder) / name).read_bytes()
    return made


@st.composite
def damaged(draw: Any, content: bytes, words: bool) -> bytes:
    """Content that is cut, overwritten or stretched in up to two places."""
    for _ in range(draw(st.integers(0, 2))):
        at = draw(st.integers(0, len(content)))
        some = draw(st.sampled_from(WORDS).map(str.encode) if words else st.binary(min_size=1, max_size=9))
        end = draw(st.sampled_from([len(content), at + len(some), at]))
        content = content[:at] + some + content[end:] if end < len(content) else content[:at]
    return content


@st.composite
def data_calls(draw: Any) -> tuple[dict[str, bytes], list[str]]:
    """Files to write, and arguments."""
    name = draw(st.sampled_from(NAMES))
    files = {
        name: draw(damaged(contents()[name], name.endswith("csv"))),
        "map.toml": draw(damaged(MAPPING.encode(), True)),
    }
    what = draw(st.sampled_from(["check", "check", "convert", "mapping"]))
    mapped = [f"--mapping={draw(st.sampled_from(['map.toml'] * 9 + ['none.toml', '.', '']))}"]
    with_map = mapped if what != "mapping" and name != "a.nc" and (name == "b.csv" or draw(st.booleans())) else []
    out = (
        [draw(st.sampled_from(["o.nc", "o.csv", "o.mat", "o.xyz", "o", name, "no/o.nc", "."]))]
        if what == "convert"
        else []
    )
    more = draw(st.sampled_from(MORE[what]))
    return files, ["data", what, name, *out, *with_map, *more]
