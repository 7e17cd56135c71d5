"""Options of every command that writes an HTML page: units, figures as files, the page opened in the browser."""

from __future__ import annotations

import sys
from contextlib import suppress
from dataclasses import dataclass
from glob import escape
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.base.errors import DataError
from rotorsim.commands.results import refuse_replacing
from rotorsim.report.page.browser import open_page
from rotorsim.report.page.units import check_units, use_units


@dataclass(frozen=True)
class PageOptions:
    """What is done with a page that a command writes."""

    units: Annotated[str, typer.Option(help="Units of the page: metric or imperial.")] = "metric"
    figures: Annotated[str | None, typer.Option(help="Every figure of the page as a file too: png, svg or csv.")] = None
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in the default browser.")] = False

    def check(self, report: bool = True) -> None:
        """Before anything is computed: raise DataError for figures that cannot be made, or where no page is written."""
        for option, given in (("figures", self.figures is not None), ("open", self.open_page)):
            if given and not report:
                raise DataError(f"--{option}: no page is written; leave --no-report out, or add --report")
        check_units(self.units)
        use_units("metric")
        if self.figures is not None:
            from rotorsim.report.page.figure_files import check_kind

            check_kind(self.figures)

    def begin(self, page: Path, force: bool | None = False) -> None:
        """In the locked folder: refuse figures that would replace files; with `force` remove those of the older page.

        `force` is None for a command without that option. From here on pages are made in the units that are asked for.
        Raises DataError.
        """
        use_units(self.units)
        if self.figures is None:
            return
        from rotorsim.report.page.figure_files import figure_paths

        refuse_replacing(sorted(page.parent.glob(f"{escape(page.stem)}_*.{self.figures}")), force)
        if page.is_file():
            with suppress(DataError):  # a page without figures
                for path in figure_paths(page, self.figures):
                    path.unlink(missing_ok=True)

    def finish(self, page: str | Path) -> dict[str, str]:
        """Write the figures of a complete page and open it; pages after it are metric again.

        Returns the pattern of the paths of figures for the summary.

        What fails here is a sentence on stderr: the page is complete.
        """
        files: dict[str, str] = {}
        page = Path(page)
        use_units("metric")
        if self.figures is not None:
            from rotorsim.report.page.figure_files import save_figures

            try:
                save_figures(page, self.figures)
                files["figures"] = str(page.with_name(f"{page.stem}_*.{self.figures}"))
            except DataError as error:
                print(f"--figures: {error}", file=sys.stderr)
        if self.open_page and not open_page(page):
            print(f"--open: there is no browser with a display here; the page is {page.resolve()}", file=sys.stderr)
        return files
