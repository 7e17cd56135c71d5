"""Text for a reader: values in sentences and on terminals, cards of results, progress of a run.

Foreign text never steers a terminal (`visible`). A card is a short `repr` and, from the same rows, a small table in
notebooks. Progress appears on a terminal alone, never in a pipe.
"""

import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from functools import partial
from html import escape
from itertools import count
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, TypeVar

OBEYED = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")
"""Characters that a terminal obeys instead of showing them, and those that turn the direction of what follows."""


def visible(text: str) -> str:
    """A text with the escapes of the characters that a terminal would obey; ends of lines and tabs stay."""
    return OBEYED.sub(lambda found: ascii(found[0])[1:-1], text)


class VisibleStream:
    """Text stream to a terminal or pipe that writes `visible` text; Rich, whose own escapes are meant, goes round it.

    It has no `buffer`: Click would write there what it supposes that the encoding does not take.
    """

    def __init__(self, stream: Any) -> None:
        self.rich_proxied_file = stream

    def write(self, text: str) -> int:
        """Write a text."""
        return int(self.rich_proxied_file.write(visible(text)))

    def writelines(self, lines: Iterable[str]) -> None:
        """Write texts."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        if name in ("buffer", "rich_proxied_file"):
            raise AttributeError(name)
        return getattr(self.rich_proxied_file, name)


def direct(stream: Any) -> Any:
    """The stream below a `VisibleStream`, for escapes of our own."""
    return getattr(stream, "rich_proxied_file", stream)


def quote(value: Any) -> str:
    """A value as a file has it: control characters escaped, cut to a readable length."""
    if hasattr(value, "item") and getattr(value, "ndim", None) == 0:  # a number of NumPy, as a plain one
        value = value.item()
    text = {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else text[:56] + "..." + text[-1]


def listing(names: Iterable[Any], most: int = 6) -> str:
    """The first few names of many, quoted."""
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(quote(name) for name in names[:most]) + more


def told_apart(paths: Sequence[Path]) -> list[str]:
    """Name of each file, after as many of its folders as tell it from the others."""
    most = max((len(path.parts) for path in paths), default=0)
    ends = [[str(Path(*path.parts[-k:])) for k in range(1, most + 1)] for path in paths]
    counts = [Counter(column) for column in zip(*ends, strict=True)]
    return [next((end for end, count in zip(own, counts, strict=True) if count[end] == 1), own[-1]) for own in ends]


ALIKE, BEGUN = 0.7, 0.6
"""Least share of letters in common, in order, with a name that is misspelt; less where the first letter is the same.

So 'pins' may be 'pin_1', and 'reserve' is no 'pressure'.
"""


def closest(name: Any, known: Iterable[str]) -> str:
    """The known name that is most like this one; empty if none is."""
    text, names = str(name), sorted(known)
    begun = [one for one in names if one[:1] == text[:1]]
    return next(iter([*get_close_matches(text, names, 1, ALIKE), *get_close_matches(text, begun, 1, BEGUN)]), "")


def did_you_mean(name: Any, known: Iterable[str]) -> str:
    """'did you mean ...?' where a known name is similar, else the known names."""
    known = list(known)
    close = closest(name, known)
    return f"did you mean '{close}'?" if close else f"known are {', '.join(known)}"


def neither(name: str, kind: str, known: Iterable[str]) -> str:
    """Sentence about a name that is of no shipped thing of a kind and of no file, with the nearest one or all."""
    known = list(known)
    close = closest(name, known)
    if close:
        return f"'{name}' is neither {kind} nor a file; did you mean '{close}'?"
    return f"'{name}' is neither {kind} ({', '.join(known)}) nor a file; give one of these or a path"


CELL = "text-align:left;padding:1px 12px 1px 0;vertical-align:top"


class Card(NamedTuple):
    """Title of one line and rows (name, text) that display a value."""

    title: str
    rows: list[tuple[str, str]]


class Shown:
    """Base of values with a `repr` of one line, and all rows when printed and in notebooks; `card` has them."""

    def card(self) -> Card:
        """Title and rows."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return text(self.card())

    def __str__(self) -> str:
        return lines(self.card())

    def _repr_html_(self) -> str:
        return html(self.card())


def text(card: Card) -> str:
    """One line: the title, and the rows that fit."""
    line = f"<{card.title}"
    for name, value in card.rows:
        more = f"{line}; {name} {value}"
        if len(more) > 160:
            break
        line = more
    return f"{line}>"


def lines(card: Card) -> str:
    """The title, and every row on a line of its own."""
    width = max((len(name) for name, _ in card.rows), default=0)
    return "\n".join([card.title, *(f"  {name:{width}}  {value}" for name, value in card.rows)])


def html(card: Card) -> str:
    """Table with the title above; its colours are those of the notebook."""
    head = f'<th style="{CELL};font-weight:normal;opacity:.7">'
    cell = f'<td style="{CELL}">'
    rows = "".join(f"<tr>{head}{escape(name)}</th>{cell}{escape(value)}</td></tr>" for name, value in card.rows)
    return f"<div><strong>{escape(card.title)}</strong><table>{rows}</table></div>"


def several(values: Iterable[Any], form: str = ".4g", scale: float = 1.0, most: int = 4) -> str:
    """The first numbers of many, with commas."""
    numbers = list(values)
    shown = ", ".join(format(scale * float(one), form) for one in numbers[:most])
    return f"{shown}, ... ({len(numbers)})" if len(numbers) > most else shown


class Reported:
    """Base of results that `rotorsim.report.write` makes a page of."""

    writer: ClassVar[Callable[[Any, str | Path], Path]]

    def report(self, path: str | Path) -> Path:
        """Write the HTML report, complete or not at all; raises WriteError."""
        return Reported.writer(self, path)


Block = TypeVar("Block", bound=tuple)
Update = Callable[..., None]
Report = Callable[[str], None]
"""Function that takes the name of a step before it starts."""
BAR, LEFT = "bar", "time left"
"""Columns of a bar that are not text."""
RUN = (
    "{task.fields[simulated]:.1f} s simulated",
    BAR,
    "{task.percentage:.0f} %",
    "{task.fields[factor]:.0f} x real time",
    LEFT,
)
"""Columns of a run: simulated time, real-time factor, time left."""


def on_terminal() -> bool:
    """Whether standard error, where progress is shown, is a terminal."""
    return sys.stderr.isatty()


@contextmanager
def bar(columns: Sequence[str] = (), text: str = "", show: bool = True, **fields: Any) -> Iterator[Update | None]:
    """Progress bar of these columns, by default those of rich after a text; `fields` are their first values.

    Gives a function that updates fields, such as `completed` and `total`; None where nothing is shown.
    """
    if not (show and on_terminal()):
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    drawn = {BAR: BarColumn, LEFT: TimeRemainingColumn}
    shown = [drawn[column]() if column in drawn else TextColumn(column) for column in columns]
    # Rich looks through one stream only, and while it shows a bar it puts another one over ours
    with Progress(*shown, console=Console(file=direct(sys.stderr))) as progress:
        yield partial(progress.update, progress.add_task(visible(text), **{"total": None} | fields))


def silent(text: str) -> None:
    """A `Report` that shows nothing."""


def line(text: str, last: bool = False) -> None:
    """Write over the line of progress; the `last` text stays."""
    if on_terminal():
        print(f"\r{visible(text)}\x1b[K", end="\n" if last else "", file=direct(sys.stderr), flush=True)


@contextmanager
def progress_line(name: str) -> Iterator[Report]:
    """A `Report` that shows each step on the line of progress behind a name; the line is empty again at the end."""
    try:
        yield lambda text: line(f"{name}: {text} ...")
    finally:
        line("")


def end_line() -> None:
    """End the line of progress, so that it stays."""
    if on_terminal():
        print(file=sys.stderr)


def counter(total: int, things: str) -> Callable[..., None]:
    """A function that counts its calls: '3 of 12 records'."""
    numbers = count(1)

    def show(*_: Any) -> None:
        done = next(numbers)
        line(f"{done} of {total} {things}", done == total)

    return show


def track(blocks: Iterable[Block], samples: int, sample: float, show: bool) -> Iterator[Block]:
    """Pass blocks (table, ...) on; if `show`, count their samples of `sample` [s] on a progress bar."""
    with bar(RUN, show=show, total=samples, simulated=0.0, factor=0.0) as update:
        if update is None:
            yield from blocks
            return
        begin, done = time.perf_counter(), 0
        for block in blocks:
            done += len(block[0])
            elapsed = max(time.perf_counter() - begin, 1e-9)
            update(completed=done, simulated=done * sample, factor=done * sample / elapsed)
            yield block
