"""The command line, whose desk notes on stderr what its windows ask for and what it computes; a program."""

import functools
import os

from rotorsim.desk import server
from rotorsim.desk.panels import DeskPoint

WORD = "noted"


def note(event, name, text):
    """A line of an event, the panel and the digest of the text."""
    os.write(2, f"{WORD}\t{event}\t{name}\t{server._digest(text) or '-'}\n".encode())  # whole lines of several threads


class Wanted(dict):
    """The questions of windows, noted."""

    def __setitem__(self, window, asked):
        if self.get(window, ("", "", ""))[1:] != asked[1:]:
            note("wanted", "-", asked[1])
        super().__setitem__(window, asked)


def noted(function):
    """`answer_of` that notes its begin and its end."""

    @functools.wraps(function)
    def compute(text: str, point: DeskPoint, name: str):
        note("begin", name, text)
        try:
            return function(text, point, name)
        finally:
            note("end", name, text)

    return compute


def carried(self, function, *arguments):
    """The child's call, noted in the process that waits for it."""
    return noted(functools.partial(CALL, self, function))(*arguments)


def read(lines):
    """Events of such a desk: (event, panel, digest of the text)."""
    return [tuple(line.rstrip().split("\t")[1:]) for line in list(lines) if line.startswith(WORD)]


if __name__ == "__main__":
    from rotorsim.cli import main

    CALL = server.PanelStream._call
    server.answer_of = noted(server.answer_of)
    server.PanelStream._call = carried
    server.PanelStream.__init__ = functools.partialmethod(server.PanelStream.__init__, wanted=Wanted())
    main()
