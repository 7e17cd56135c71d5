"""One self-contained HTML page about a run: nothing is fetched from anywhere, so it can be mailed and kept."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Iterator
from html import escape
from importlib.resources import files
from pathlib import Path

import plotly.graph_objects as go
import plotly.io as pio
from plotly.offline import get_plotlyjs

from rotorsim.errors import DataError
from rotorsim.experiments.tracking import open_record
from rotorsim.report import captions, curves, film3d, orbits, overview, tables
from rotorsim.report.run import Run, analyse

POLICY = "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:"
"""Tells the browser to fetch nothing at all."""
NOTES = (
    "This is a simulation. Numbers of a machine file marked calibrated were fitted; see its comments.",
    captions.CONVENTION,
    "Amplitudes of orders are least-squares fits over whole revolutions, at least 8 and at least 0.25 s at a time; "
    "a run-up's peaks lag a little behind those of constant speed.",
)
TOOLS = {"displaylogo": False, "responsive": True, "modeBarButtonsToRemove": ["select2d", "lasso2d"]}
Figure = tuple[str, Callable[[Run], go.Figure], Callable[[Run], str]]
ALWAYS: tuple[Figure, ...] = (
    ("Amplitude and phase of the orders", curves.bode, captions.bode_caption),
    ("Waterfall", curves.waterfall_map, captions.waterfall_caption),
    ("Forward and backward whirl", curves.full_spectrum_map, captions.full_spectrum_caption),
    ("Orbits", orbits.orbits, captions.orbits_caption),
    ("The run against time", overview.overview, captions.overview_caption),
)
WITH_SNAPSHOTS: tuple[Figure, ...] = (
    ("Film pressure, unrolled", film3d.film_maps, captions.film_caption),
    ("Film pressure round the journal", film3d.film_surface, captions.surface_caption),
)


def write_report(record_path: str | Path, html_path: str | Path) -> None:
    """Write the report of a record as one HTML file, complete or not at all.

    Parameters
    ----------
    record_path : path
        NetCDF file of a run; read in blocks.
    html_path : path
        The page; with plotly.js inside some 6 MB.

    Raises
    ------
    DataError
        If the record cannot be read or the page cannot be written.
    """
    with open_record(record_path) as record:
        save_page(analyse(record), html_path)


def save_page(run: Run, html_path: str | Path) -> None:
    """Write the report of an analysed run, complete or not at all; raises DataError where it cannot be written."""
    text = page(run)
    target = Path(html_path)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, target)
    except OSError as error:
        raise DataError(f"report: cannot write {target} ({error.strerror}); choose another place") from error
    finally:
        part.unlink(missing_ok=True)


def page(run: Run) -> str:
    """The page's text."""
    name, description = machine_title(run)
    style = (files("rotorsim.report") / "page.css").read_text(encoding="utf-8")
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        f"<title>{escape(name)}: run</title><style>{style}</style>"
        f"<script>{get_plotlyjs()}</script></head><body>"
        f"<header><h1>{escape(name)}</h1><p>{escape(description)}</p></header>"
        f"{_warning(run)}{_key_numbers(run)}"
        f"<section><h2>Results</h2>{_table(tables.results(run))}</section>"
        f"{''.join(_figures(run))}"
        f'<div class="tables"><section><h2>Settings</h2>{_table(tables.settings(run))}</section>'
        f"<section><h2>Provenance</h2>{_table(tables.provenance(run))}</section></div>"
        f"<section><h2>Notes</h2>{''.join(f'<p>{escape(note)}</p>' for note in NOTES)}</section>"
        f"{_machine(run)}</body></html>\n"
    )


def machine_title(run: Run) -> tuple[str, str]:
    """Name and description of the machine, as far as its text can be read."""
    try:
        told = tomllib.loads(str(run.record.attrs.get("machine", "")))
    except tomllib.TOMLDecodeError:
        told = {}
    return str(told.get("name", "Unnamed machine")), str(told.get("description", ""))


def _warning(run: Run) -> str:
    ended = str(run.record.attrs.get("ended", "complete"))
    return "" if ended == "complete" else f'<p class="warning">The run did not reach its end: {escape(ended)}.</p>'


def _key_numbers(run: Run) -> str:
    """The few numbers one looks for first."""
    s = run.summary
    orbit = s["largest_orbit"]
    cards = [(f"{max(s['speed_rpm']['max'], -s['speed_rpm']['min']):.0f} rpm", "highest speed")]
    cards.append((f"{orbit['um']:.3g} µm", "largest orbit, 0-pk"))
    if s["smallest_film"]:
        cards.append((f"{s['smallest_film']['um']:.3g} µm", "smallest film thickness"))
    if s["contact"]:
        cards.append((f"{s['contact']['samples']}", "samples with contact"))
    if s["mass_flow"]:
        cards.append((f"{s['mass_flow']['mean_nl_min']:.3g} Nl/min", "mean gas consumption"))
    return f'<div class="key">{"".join(f"<div><b>{a}</b><span>{b}</span></div>" for a, b in cards)}</div>'


def _table(rows: tables.Rows) -> str:
    return "<table>" + "".join(f"<tr><th>{escape(a)}</th><td>{escape(b)}</td></tr>" for a, b in rows) + "</table>"


def _figures(run: Run) -> Iterator[str]:
    for title, figure, caption in (*ALWAYS, *(WITH_SNAPSHOTS if run.has_snapshots else ())):
        drawn = pio.to_html(figure(run), full_html=False, include_plotlyjs=False, config=TOOLS)
        yield f"<section><h2>{title}</h2><p>{escape(caption(run))}</p>{drawn}</section>"


def _machine(run: Run) -> str:
    text = str(run.record.attrs.get("machine", ""))
    return f"<details><summary>Machine file</summary><pre>{escape(text)}</pre></details>" if text else ""
