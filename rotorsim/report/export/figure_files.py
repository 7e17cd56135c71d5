"""Figures of a page as files next to it."""

from __future__ import annotations

import re
from pathlib import Path

from rotorsim.base.errors import DataError
from rotorsim.base.files import write_bytes, write_text
from rotorsim.base.sentences import did_you_mean
from rotorsim.report.export.browser import NO_CHROME, chrome
from rotorsim.report.export.figure_table import figure_csv
from rotorsim.report.export.images import images
from rotorsim.report.pages.html import Drawn, figures_of

KINDS = ("png", "svg", "csv")
"""Kinds of files of a figure."""


def check_kind(kind: str, name: str = "figures") -> None:
    """Raise DataError for a kind of file that is not known, or that nothing here can draw; `name` is the argument's."""
    if kind not in KINDS:
        raise DataError(f"{name}: '{kind}' is not known; {did_you_mean(kind, KINDS)}")
    if kind != "csv" and chrome() is None:
        raise DataError(f"{name}: {NO_CHROME}, or write csv")


def save_figures(page: str | Path, kind: str) -> list[Path]:
    """Write every figure of a written page as a file next to it, named after page and section.

    Parameters
    ----------
    page : path
        HTML page of a report.
    kind : {"png", "svg", "csv"}
        PNG and SVG take a browser of the Chrome family, which opens no window; CSV holds the numbers, a row a point.

    Raises
    ------
    DataError
        For another kind, for a file other than a page, and where no browser can draw.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.write_report(record, "page.html")
    >>> rs.report.save_figures("page.html", "csv")[0].suffix
    '.csv'
    """
    page = Path(page)
    check_kind(kind, "kind")
    found = _figures(page)
    paths = _paths(page, [one.title for one in found], kind)
    figures = [one.figure for one in found]
    if kind == "csv":
        for path, figure in zip(paths, figures, strict=True):
            write_text(path, figure_csv(figure))
        return paths
    try:
        drawn = images(figures, kind) if figures else []
    except DataError as error:
        raise DataError(f"the page {page} is complete, its figures are not drawn: {error}") from error
    for path, content in zip(paths, drawn, strict=True):
        write_bytes(path, content)
    return paths


def figure_paths(page: Path, kind: str) -> list[Path]:
    """Files that `save_figures` writes for a page, there or not; raises DataError for a file other than a page."""
    return _paths(page, [one.title for one in _figures(page)], kind)


def _figures(page: Path) -> list[Drawn]:
    try:
        return figures_of(page.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DataError(f"{page}: cannot be read as the page of a report; name one that a command wrote") from error


def _paths(page: Path, titles: list[str], kind: str) -> list[Path]:
    """One path a title; a number follows a title that stands there twice."""
    names: list[str] = []
    for title in titles:
        name = re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_")[:60] or "figure"
        count = sum(one == name or re.fullmatch(rf"{name}_\d+", one) is not None for one in names)
        names.append(f"{name}_{count + 1}" if count else name)
    return [page.with_name(f"{page.stem}_{name}.{kind}") for name in names]
