"""HTML page of a run's report, self-contained: no resources are loaded from elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path

from rotorsim.base import toml_text as tomllib
from rotorsim.experiments.limits import sentences
from rotorsim.report.export.display_units import quantity
from rotorsim.report.export.page_files import write_page
from rotorsim.report.pages import html
from rotorsim.report.pages.figure_lists import Found, found_sections
from rotorsim.report.pages.run import RUNS, Run
from rotorsim.report.text import tables
from rotorsim.report.text.captions import CONVENTION

SIMULATED = "This is a simulation. Numbers of a machine file marked calibrated were fitted; see its comments."
ORDERS = (
    CONVENTION,
    "Amplitudes of orders are least-squares fits over whole revolutions, at least 8 and at least 0.25 s at a time; "
    "a run-up's peaks lag a little behind those of constant speed.",
)
NAMES = {"runup": "run-up", "coastdown": "coast-down", "prbs": "pseudo-random excitation", "impact": "impact test",
         "controlled": "controlled run", "steady": "steady run"}  # fmt: skip


def save_page(run: Run, html_path: str | Path, units: str = "metric", figures: str | None = None) -> None:
    """Write the report of an analysed run, complete or not at all, and its figures; raises WriteError."""
    write_page(lambda: page(run), html_path, units, figures)


def page(run: Run) -> str:
    """The page's text."""
    name, description = machine_title(run)
    found = list(found_sections(run))
    body = (
        f"{_warning(run)}{_key_numbers(run)}"
        f"{html.section('Results', _table(tables.results(run)))}"
        f"{''.join(_figures(run, found))}{_left_out(found)}"
        f'<div class="tables">{_rows("Settings", tables.settings(run))}'
        f"{_rows('Provenance', tables.provenance(run))}</div>"
        f"{_notes(run)}{_machine(run)}"
    )
    kind = kind_of(run)
    return html.document(f"{name}: {kind}", name, f"{kind.capitalize()}. {description}", body)


def machine_title(run: Run) -> tuple[str, str]:
    """Name and description of the machine, as far as its text can be read."""
    try:
        machine = tomllib.loads(str(run.record.attrs.get("machine", "")))
    except tomllib.TOMLDecodeError:
        machine = {}
    return str(machine.get("name", "Unnamed machine")), str(machine.get("description", ""))


def kind_of(run: Run) -> str:
    """Displayed name of the experiment."""
    return NAMES.get(run.kind, run.kind.replace("_", " ") or "record")


def _warning(run: Run) -> str:
    ended = str(run.record.attrs.get("ended", "complete"))
    lines = [] if ended == "complete" else [f"The run did not reach its end: {ended}."]
    lines += [f"Beyond the range in which the model was checked: {text}." for text in sentences(run.record.attrs)]
    return "".join(f'<p class="warning">{escape(line)}</p>' for line in lines)


def _key_numbers(run: Run) -> str:
    """The few numbers one looks for first."""
    s = run.summary
    orbit = s["largest_orbit"]
    cards = []
    if run.speed_known:
        cards.append((f"{max(s['speed_rpm']['max'], -s['speed_rpm']['min']):.0f} rpm", "highest speed"))
    label = "largest orbit, 0-pk" if run.kind in RUNS else "largest distance of the disc from its mean"
    cards.append((f"{quantity(orbit['um'], 'µm')}", label))
    if s["smallest_film"]:
        cards.append((f"{quantity(s['smallest_film']['um'], 'µm')}", "smallest film thickness"))
    if s["contact"]:
        cards.append((f"{s['contact']['samples']}", "samples with contact"))
    if s["mass_flow"]:
        cards.append((f"{quantity(s['mass_flow']['mean_nl_min'], 'Nl/min')}", "mean gas consumption"))
    return html.key_numbers(cards)


def _rows(title: str, rows: tables.Rows) -> str:
    return html.section(title, _table(rows)) if rows else ""


def _table(rows: tables.Rows) -> str:
    return "<table>" + "".join(f"<tr><th>{escape(a)}</th><td>{escape(b)}</td></tr>" for a, b in rows) + "</table>"


def _figures(run: Run, found: list[Found]) -> Iterator[str]:
    for one in found:
        if one.why is not None:
            continue
        caption = one.section.caption(run, one.data)
        yield html.figure_section(one.section.title, caption, one.section.draw(run, one.data))


def _left_out(found: list[Found]) -> str:
    """Figures that a reader would look for, and why they are not there."""
    return _rows("Not shown", [(one.section.title, one.why) for one in found if one.why])


def _notes(run: Run) -> str:
    notes = [SIMULATED] * run.simulated + list(ORDERS) * (run.tracked.sizes["window"] > 0)
    text = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return f"<section><h2>Notes</h2>{text}</section>" if text else ""


def _machine(run: Run) -> str:
    text = str(run.record.attrs.get("machine", ""))
    return f"<details><summary>Machine file</summary><pre>{escape(text)}</pre></details>" if text else ""
