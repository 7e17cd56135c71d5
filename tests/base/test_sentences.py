"""Names of files in tables: as short as is clear."""

from pathlib import Path

import pytest

from rotorsim.base.display import told_apart


@pytest.mark.parametrize(
    ("paths", "names"),
    [
        ([], []),
        (["a/b/c.nc"], ["c.nc"]),
        (["a/run/p.nc", "b/run/p.nc", "a/q.nc"], ["a/run/p.nc", "b/run/p.nc", "q.nc"]),
        (["p.nc", "a/p.nc"], ["p.nc", "a/p.nc"]),
        (["a/p.nc", "a/p.nc"], ["a/p.nc", "a/p.nc"]),
    ],
)
def test_each_name_has_as_many_folders_as_tell_it_apart(paths, names):
    assert told_apart([Path(path) for path in paths]) == [str(Path(name)) for name in names]
