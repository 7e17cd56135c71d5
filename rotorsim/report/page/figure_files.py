"""Figures as files: every figure of a page next to it, or a single one."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import plotly.graph_objects as go

from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import DataError
from rotorsim.base.files import write_bytes, write_text
from rotorsim.report.page.browser import NO_CHROME, chrome, images
from rotorsim.report.page.figure_data import figure_csv

KINDS = ("png", "svg", "csv")
"""Kinds of files of a figure."""
BEGIN, END = '<script type="application/json" id="figures">', "</script>"
"""Marks of the data of all figures in an HTML page."""


def check_kind(kind: str, name: str = "figures") -> None:
    """Raise DataError for a kind of file that is not known, or that nothing here can draw; `name` is the argument's."""
    if kind not in KINDS:
        raise DataError(f"{name}: '{kind}' is not known; {did_you_mean(kind, KINDS)}")
    if kind != "csv" and chrome() is None:
        raise DataError(f"{name}: {NO_CHROME}, or write csv")


def save_png(figure: go.Figure, path: str | Path, width: int = 1400, height: int = 700) -> None:
    """Write a figure as PNG of width x height px; raises DataError without a browser of the Chrome family.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.report.save_png(rs.report.waterfall(runup), "waterfall.png")  # doctest: +SKIP
    """
    try:
        content = images([json.loads(str(figure.to_json()))], "png", width, height, scale=1)[0]
    except DataError as error:
        raise DataError(f"{path}: {error}") from error
    write_bytes(path, content)


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
    check_kind(kind, "kind")
    return write_figures(Path(page), figures_of(Path(page)), kind)


def write_figures(page: Path, figures: Sequence[dict[str, Any]], kind: str) -> list[Path]:
    """Write figures (`title`, `data`, `layout`) of a complete page next to it; raises DataError."""
    paths = _paths(page, figures, kind)
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
    return _paths(page, figures_of(page), kind)


def figures_of(page: Path) -> list[dict[str, Any]]:
    """Figures (`title`, `data`, `layout`) of a page's file in order; raises DataError for a file other than a page."""
    try:
        _, begin, rest = page.read_text(encoding="utf-8").partition(BEGIN)
        if not begin:
            raise ValueError("it holds no figures")
        return list(json.loads(rest.partition(END)[0]))
    except (OSError, ValueError) as error:
        raise DataError(f"{page}: cannot be read as the page of a report; name one that a command wrote") from error


def _paths(page: Path, figures: Sequence[dict[str, Any]], kind: str) -> list[Path]:
    """One path a figure; a number follows a title that stands there twice."""
    names: list[str] = []
    for figure in figures:
        name = re.sub(r"[^a-z0-9]+", "_", figure["title"].lower()).strip("_")[:60] or "figure"
        count = sum(one == name or re.fullmatch(rf"{name}_\d+", one) is not None for one in names)
        names.append(f"{name}_{count + 1}" if count else name)
    return [page.with_name(f"{page.stem}_{name}.{kind}") for name in names]
