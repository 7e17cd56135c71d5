"""Log lines of the live rig's server: one line each, and a last one where more are left out."""

import logging

from rotorsim.live.messages import MOST, OneLine


def test_a_flood_of_log_lines_ends_with_a_line_that_says_so(capsys):
    handler = OneLine()
    for number in range(MOST + 10):
        handler.emit(logging.LogRecord("nicegui", logging.ERROR, "", 0, f"fault {number}", None, None))
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == MOST + 1 and lines[-1] == f"rotorsim live: these were {MOST} lines; no more are written"
