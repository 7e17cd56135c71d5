"""Options of every command that writes an HTML page: its figures as files, and the page opened in the browser."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.base.errors import DataError
from rotorsim.report.export.browser import open_page


@dataclass(frozen=True)
class PageOptions:
    """What is done with a page that a command writes."""

    figures: Annotated[str | None, typer.Option(help="Every figure of the page as a file too: png, svg or csv.")] = None
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in the default browser.")] = False

    def check(self, report: bool = True) -> None:
        """Before anything is computed: raise DataError for figures that cannot be made, or where no page is written."""
        for option, given in (("figures", self.figures is not None), ("open", self.open_page)):
            if given and not report:
                raise DataError(f"--{option}: no page is written; leave --no-report out, or add --report")
        if self.figures is not None:
            from rotorsim.report.export.figure_files import check_kind

            check_kind(self.figures)

    def finish(self, page: str | Path) -> dict[str, str]:
        """Write the figures of a complete page and open it; returns the pattern of their paths for the summary.

        What fails here is a sentence on stderr: the page is complete.
        """
        files: dict[str, str] = {}
        page = Path(page)
        if self.figures is not None:
            from rotorsim.report.export.figure_files import save_figures

            try:
                save_figures(page, self.figures)
                files["figures"] = str(page.with_name(f"{page.stem}_*.{self.figures}"))
            except DataError as error:
                print(error, file=sys.stderr)
        if self.open_page and not open_page(page):
            print(f"--open: there is no browser with a display here; the page is {page.resolve()}", file=sys.stderr)
        return files
