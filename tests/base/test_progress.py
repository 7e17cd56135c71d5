"""Progress: bars and counters on a terminal, nothing in a pipe."""

import io
import sys

import numpy as np

from rotorsim.base.display import VisibleStream, bar, counter, end_line, line, progress_line, track


def show():
    """Every kind of progress, once."""
    with bar(("{task.completed} of {task.total} cases",), total=3) as update:
        if update is not None:
            update(completed=3)
    assert len(list(track([(np.zeros((5, 2)),), (np.zeros((3, 2)),)], 8, 2e-4, True))) == 2
    count = counter(2, "records")
    count(), count("anything")
    line("stage")
    end_line()
    with progress_line("study") as report:
        report("step 1")


def on_a_terminal(monkeypatch, show, stands_for=lambda stream: stream):
    """Text that is written to a terminal, through the stream that stands for it."""
    stream = io.StringIO()
    stream.isatty = lambda: True
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stderr", stands_for(stream))
        show()
    return stream.getvalue()


def test_nothing_is_written_to_a_pipe(capsys):
    show()
    with bar() as update:
        assert update is None
    assert capsys.readouterr() == ("", "")


def test_a_terminal_shows_bars_and_counters(monkeypatch):
    text = on_a_terminal(monkeypatch, show)
    for wanted in (
        "3 of 3 cases",
        "0.0 s simulated",
        "100 %",
        "1 of 2 records",
        "2 of 2 records\x1b[K\n",
        "stage",
        "study: step 1",
    ):
        assert wanted in text


def test_the_escapes_of_a_bar_reach_the_terminal_of_a_command_as_they_are(monkeypatch):
    text = on_a_terminal(monkeypatch, show, VisibleStream)
    assert "\x1b[" in text and "\\x1b" not in text and "\\r" not in text


def test_a_bar_that_is_not_asked_for_is_not_shown(monkeypatch):
    def nothing():
        with bar(show=False) as update:
            assert update is None

    assert on_a_terminal(monkeypatch, nothing) == ""
