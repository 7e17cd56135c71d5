"""Report of any experiment: `write_report` turns a record into an HTML page."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import xarray as xr

from rotorsim.base.errors import DataError
from rotorsim.report.export.page_files import check_wanted
from rotorsim.report.pages.page import save_page
from rotorsim.report.pages.run import analyse
from rotorsim.signals.record_blocks import open_record


def write_report(
    record: xr.Dataset | str | Path, html_path: str | Path, units: str = "metric", figures: str | None = None
) -> None:
    """Write the report of a record as one HTML file, complete or not at all.

    The attribute `experiment` chooses the figures; what cannot be made of the record is named with the reason. A record
    without that attribute, or of a rig with nothing but time and displacement, gets all figures that it suffices for.

    Parameters
    ----------
    record : Dataset or path
        Record of the schema (`identification.records.schema`) or its NetCDF file; read in blocks, however long.
    html_path : path
        The page; with plotly.js inside some 6 MB.
    units : {"metric", "imperial"}
        Of its texts, tables and figures: µm, MPa, N or mil, psi, lbf.
    figures : {"png", "svg", "csv"}, optional
        Every figure as a file too, next to the page: see `save_figures`.

    Raises
    ------
    DataError
        If the record cannot be read, has no displacement of the disc, or the page cannot be written; for other units
        and kinds of figures.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.write_report("run.nc", "report.html")
    """
    check_wanted(units, figures)
    if not isinstance(record, (xr.Dataset, str, Path)):
        given = type(record).__name__
        raise DataError(f"report: a {given} is not a record; give a record, e.g. of plant.simulate, or a .nc file")
    with nullcontext(record) if isinstance(record, xr.Dataset) else open_record(record) as opened:
        save_page(analyse(opened), html_path, units, figures)
