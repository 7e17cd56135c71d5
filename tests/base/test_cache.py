"""Cache: keys follow every source that computes a result; damaged files and full disks are no errors."""

from pathlib import Path

import numpy as np
import pytest

import studies
from fuzzing.disk import largest_file
from rotorsim.base.cache import ROOT, Cache, key_of, source_files, sources_hash
from rotorsim.base.files import WriteError
from rotorsim.campaign import store
from rotorsim.discrepancy import comparison
from studies.thesis import stage_key

PACKAGES = ("reynolds", "fe_shaft", "identification", "rotorsim", "fmu", "studies")
STUDIES = Path(studies.__file__).parent
RESULTS = {
    "response": (comparison.SOURCES, "rotorsim.discrepancy.comparison"),
    "sensitivity": (comparison.SOURCES, "rotorsim.discrepancy.comparison"),
    "record": (store.SOURCES, "rotorsim.campaign.worker"),
    "design": (stage_key.SOURCES["control"], "rotorsim.control"),
    "verification": (stage_key.SOURCES["verify"], "studies.thesis.control_cases"),
    "hysteresis": (stage_key.SOURCES["hysteresis"], "studies.thesis.claims.hysteresis"),
    "identification": (stage_key.SOURCES["identification"], "rotorsim.study.identification_vs_physics"),
    "targets": (stage_key.SOURCES["identification"], "studies.thesis.claims.targets"),
}


@pytest.fixture(scope="module")
def graph():
    grimp = pytest.importorskip("grimp")
    return grimp.build_graph(*PACKAGES, exclude_type_checking_imports=True, cache_dir=None)


def file_of(module):
    """Source file of a module."""
    root = STUDIES.parent if module.startswith("studies") else ROOT
    path = root.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


@pytest.mark.parametrize("result", RESULTS)
def test_a_key_follows_every_source_that_is_imported(graph, result):
    """Files had moved out of the folders that were hashed: edits of them served stale results."""
    sources, entry = RESULTS[result]
    imported = {entry, *graph.find_descendants(entry)}
    above = {name for module in imported for name in graph.find_upstream_modules(module)}
    imported |= above - {"rotorsim", "studies", "studies.thesis"}
    assert not {file_of(module) for module in imported} - set(source_files(*sources))


def test_a_source_that_moved_away_is_an_error():
    with pytest.raises(FileNotFoundError, match="rotorsim/moved: no such source"):
        sources_hash("rotorsim/base", "rotorsim/moved")


def test_a_key_follows_every_part():
    keys = {key_of("a", "b"), key_of("ab"), key_of("a", ("b",)), key_of("a", 1), key_of("a", 1.0), key_of()}
    assert len(keys) == 6 and key_of("a", "b") in keys


def test_damaged_files_are_computed_again(tmp_path):
    rng = np.random.default_rng(0)
    cache, wanted = Cache(tmp_path), np.arange(20.0)
    path = tmp_path / "k.npy"
    cache.array("k", (20,), lambda: wanted)
    whole = path.read_bytes()
    for _ in range(200):
        damaged = bytearray(whole[: rng.integers(len(whole))])
        if damaged:
            damaged[rng.integers(len(damaged))] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        np.testing.assert_array_equal(cache.array("k", (20,), lambda: wanted), wanted)
    path.write_bytes(whole)
    np.testing.assert_array_equal(cache.array("k", (20,), lambda: -wanted), wanted)
    np.testing.assert_array_equal(cache.array("k", (4, 5), lambda: -wanted.reshape(4, 5)), -wanted.reshape(4, 5))


def test_a_damaged_value_is_not_found(tmp_path):
    cache = Cache(tmp_path / "stages")
    assert cache.find("stage") is None
    assert cache.keep("stage", {"pair": (1, 2)}) == {"pair": [1, 2]} == cache.find("stage")
    for text in (b'{"pair": [1,', b"\xff", b"[" * 100_000):
        (cache.folder / "stage.json").write_bytes(text)
        assert cache.find("stage") is None


def test_a_full_disk_is_an_error_only_where_results_are_required(tmp_path):
    with largest_file(100):
        np.testing.assert_array_equal(Cache(tmp_path).array("k", (99,), lambda: np.ones(99)), np.ones(99))
        assert Cache(tmp_path).keep("k", "-" * 200) == "-" * 200
        with pytest.raises(WriteError):
            Cache(tmp_path, required=True).keep("k", "-" * 200)
    assert not list(tmp_path.iterdir())
