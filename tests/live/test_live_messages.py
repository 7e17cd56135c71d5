"""Log lines of the live rig's server: one line each, and a last one where more are left out."""

import logging

import pytest

from rotorsim.live.serving import MOST, OneLine, quiet


@pytest.mark.parametrize("name", ["rotorsim live", "rotorsim desk"])
def test_a_flood_of_log_lines_ends_with_a_line_that_reports_it(capsys, name):
    handler = OneLine(name)
    for number in range(MOST + 10):
        handler.emit(logging.LogRecord("nicegui", logging.ERROR, "", 0, f"fault {number}", None, None))
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == MOST + 1 and lines[-1] == f"{name}: these were {MOST} lines; no more are written"
    assert all(line.startswith(f"{name}: ") for line in lines)


def test_malformed_messages_are_dropped_and_a_closed_page_is_still_seen(monkeypatch):
    """The server library learns from a TypeError how many arguments the handler of a disconnection takes."""
    core = pytest.importorskip("nicegui.core")

    def takes_one(sid):
        return sid

    monkeypatch.setattr(core.sio, "handlers", {"/": {"event": takes_one, "disconnect": takes_one}})
    quiet()
    handlers = core.sio.handlers["/"]
    assert handlers["event"]("sid", "malformed") is None
    with pytest.raises(TypeError):
        handlers["disconnect"]("sid", "transport close")
    assert handlers["disconnect"]("sid") == "sid"
