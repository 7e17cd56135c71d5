"""Stages of a study: cached results, damaged files, JSON round trip of report sections."""

import json

import plotly.graph_objects as go
import pytest

from rotorsim.base.processes import processes
from rotorsim.report.page import Block
from studies.thesis.cached_cases import CachedCase, run_cases
from studies.thesis.page import blocks_of, plain_blocks
from studies.thesis.stage_key import key_of


def square(value, log):
    """Note the call; return a square."""
    with open(log, "a", encoding="utf-8") as stream:
        stream.write(f"{value}\n")
    if value < 0:
        raise ValueError("negative")
    return {"square": value**2}


def cases(log, values):
    return [CachedCase("square", f"case {v}", key_of(str(v)), f"{__name__}:square", (v, str(log))) for v in values]


def silent(name, done, of):
    pass


def test_a_stage_is_run_once_and_then_read(tmp_path):
    log = tmp_path / "log"
    first = run_cases(tmp_path / "stages", cases(log, (2, 3)), 1, silent)
    assert first == {"case 2": {"square": 4}, "case 3": {"square": 9}}
    assert run_cases(tmp_path / "stages", cases(log, (2, 3, 4)), 1, silent)["case 4"] == {"square": 16}
    assert log.read_text().split() == ["2", "3", "4"]


def test_processes_give_what_one_process_gives_in_the_same_order():
    for workers in (1, 2):
        with processes(workers) as each:
            assert list(each(abs, [-3, 2, -1])) == [3, 2, 1]


def test_what_was_done_before_a_failure_is_kept(tmp_path):
    log = tmp_path / "log"
    with pytest.raises(ValueError, match="negative"):
        run_cases(tmp_path / "stages", cases(log, (2, -1, 5)), 1, silent)
    result = []
    with pytest.raises(ValueError, match="negative"):
        run_cases(tmp_path / "stages", cases(log, (2, -1)), 1, lambda *one: result.append(one))
    assert log.read_text().split() == ["2", "-1", "-1"]
    assert result == [("case -1", 1, 2)]


def test_a_damaged_result_is_made_again(tmp_path):
    log = tmp_path / "log"
    (case,) = cases(log, (3,))
    run_cases(tmp_path, [case], 1, silent)
    (tmp_path / f"{case.file}.json").write_text('{"square":')
    assert run_cases(tmp_path, [case], 1, silent) == {"case 3": {"square": 9}}
    assert log.read_text().split() == ["3", "3"]


def test_keys_follow_every_part_and_the_sources():
    assert key_of("a", "b") != key_of("ab")
    assert key_of("a") == key_of("a")
    assert key_of("a", kind="control") != key_of("a", kind="verify")


def test_sections_come_back_from_their_files():
    figure = go.Figure(go.Scatter(x=[1, 2], y=[3, 4]))
    blocks = [Block("Table", "text", ("a", "b"), [("x", 1.5), ("y", True)]), Block("Figure", figure=figure)]
    table, shown = blocks_of(json.loads(json.dumps(plain_blocks(blocks))))
    assert (table.title, table.text, list(table.heads), table.rows) == (
        "Table",
        "text",
        ["a", "b"],
        [["x", 1.5], ["y", True]],
    )
    assert table.figure is None
    assert list(shown.figure.data[0].y) == [3, 4]
