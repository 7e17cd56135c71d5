"""Page of a record: its sections in order, with tables of settings, results and provenance."""

import re
from collections.abc import Iterator, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rotorsim.base.display import listing
from rotorsim.base.errors import DataError
from rotorsim.base.quantity import Quantity
from rotorsim.base.units import TO_MPA, TO_RPM, TO_UM, show, split
from rotorsim.experiments.experiment import EXPERIMENTS, parameters
from rotorsim.experiments.running import BEYOND, FAST, sentences
from rotorsim.report import film, orbit, orders, responses, time_history
from rotorsim.report.film import feed_word
from rotorsim.report.page import Block, Page, check_wanted, machine_entry, page_of, write_page
from rotorsim.report.run import RUNS, SECTIONS, AnalysedRun, RecordSection, VectorRun, analyse, end_of_run
from rotorsim.report.units import number, quantity
from rotorsim.signals.orders import mean_order
from rotorsim.signals.record_blocks import SHOWN, MissingError, open_record

CHAPTERS = (orders, orbit, responses, time_history, film)
"""Modules that register sections."""
POSSIBLE = ("static_gain", "hysteresis_loops", "ring_down", "response_to_force", "response_to_reference", "excitation",
            "spectra", "filtered_orbits", "polar", "cascade", "centreline")  # fmt: skip
"""Sections that are added, if they can be made, for a record that does not name its experiment."""
MEASURED = ("orbits", "filtered_orbits", "polar", "bode", "spectra", "full_spectrum", "waterfall", "cascade",
            "centreline", "against_time")  # fmt: skip
"""Sections of a record that was measured: each is shown, or left out with the reason."""
ADDED = ("probe_orbits", "probe_readings", "sensor_noise", "film_pressure", "film_surface",
         "friction_curve")  # fmt: skip
"""Sections that are added if they can be made, whatever the experiment."""
NOTES = (
    orders.CONVENTION,
    "Amplitudes of orders are least-squares fits over whole revolutions, at least 8 and at least 0.25 s at a time; "
    "a run-up's peaks lag a little behind those of constant speed.",
)
"""Notes of a page with orders."""
SIMULATED = "This is a simulation. Numbers of a machine file marked calibrated were fitted; see its comments."
NAMES = {"runup": "run-up", "coastdown": "coast-down", "prbs": "pseudo-random excitation", "impact": "impact test",
         "shock": "shock of the base", "controlled": "controlled run", "steady": "steady run"}  # fmt: skip
LEAVING = {
    "lift_off": ("lift-off", "no contact for a revolution from there"),
    "touch_down": ("touch-down", "the first contact after a revolution without any"),
}
"""Words for what `rotorsim.experiments.summary.lift_off` finds, and their rules."""
Rows = list[tuple[str, str]]
SETTINGS = {
    "experiment": ("Experiment", "{}", 1.0),
    "start_speed": ("Start speed", "{:.0f} rpm", TO_RPM),
    "stop_speed": ("Stop speed", "{:.0f} rpm", TO_RPM),
    "rate": ("Rate", "{:.4g} rpm/s", TO_RPM),
    "sample_rate_hz": ("Sample rate", "{:.6g} Hz", 1.0),
    "ended": ("Ended", "{}", 1.0),
}
PROVENANCE = {"machine_hash": "Machine's hash", "seed": "Seed", "source_sha256": "Source's SHA-256"}
TEXTS = {"machine": "Machine file", "mapping": "Mapping"}
"""Attributes that are files of many lines, and the headings under which a page folds them away."""
EXCITATION = re.compile(r"(excitation_\d+_)experiment")
"""Attribute with the name of an excitation in a closed loop; its parameters begin with the same words."""
HARMONIC = re.compile(r"harmonic_\d+_[xy](_phase)?")
"""Attributes of harmonics of the speed next to a law."""
MAGNITUDE = Quantity("V", "Magnitude of a harmonic of the speed next to the law.")
PHASE = Quantity("rad", "Its phase.")
CENTRE = Quantity("m", "Position that asks the built-in law for no reference.")


def write_report(
    record: xr.Dataset | str | Path, html_path: str | Path, units: str = "metric", figures: str | None = None
) -> None:
    """Write the report of a record as one HTML file, complete or not at all.

    The attribute `experiment` chooses the figures; what cannot be made of the record is named with the reason. A record
    without that attribute, or of a rig with nothing but time and displacement, gets all figures that it suffices for;
    so do run-up vectors, and records of a lone probe.

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
        If the record cannot be read, has no displacement, or the page cannot be written; for other units
        and kinds of figures.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.write_report("run.nc", "report.html")
    """
    check_wanted(units, figures)
    if not isinstance(record, (xr.Dataset, str, Path)):
        given = type(record).__name__
        raise DataError(
            f"report: a {given} is not a record; give a record, e.g. of plant.simulate, or a .nc file",
            argument="report",
            value=given,
        )
    with nullcontext(record) if isinstance(record, xr.Dataset) else open_record(record) as opened:
        write_page(lambda: record_page(opened), html_path, units, figures)


@page_of(xr.Dataset)
def record_page(record: xr.Dataset) -> Page:
    """Page of an open record; raises DataError for one without a displacement of the disc."""
    return run_page(analyse(record))


def run_page(run: AnalysedRun) -> Page:
    """Page of an analysed run."""
    name = machine_entry(run.record.attrs, missing=str(run.record.attrs.get("source", "Unnamed machine")))
    description = machine_entry(run.record.attrs, "description", "")
    made = list(made_sections(run))
    vectors = isinstance(run, VectorRun)
    blocks: list[Block | tuple[Block, ...]] = [Block("Results", rows=peaks(run) if vectors else results(run))]
    blocks += [
        Block(one.section.title, one.section.caption(run, one.data), figure=one.section.draw(run, one.data))
        for one in made if one.why is None
    ]  # fmt: skip
    if left_out := [(one.section.title, one.why) for one in made if one.why]:
        blocks.append(Block("Not shown", rows=left_out))
    tables = Block("Settings", rows=[] if vectors else settings(run)), Block("Provenance", rows=provenance(run))
    blocks.append(tuple(table for table in tables if table.rows))
    if notes := [SIMULATED] * run.simulated + list(NOTES) * (run.tracked.sizes["window"] > 0):
        blocks.append(Block("Notes", texts=notes))
    for attribute, title in TEXTS.items():
        if text := str(run.record.attrs.get(attribute, "")):
            blocks.append(Block(title, code=text, folded=True))
    kind = NAMES.get(run.kind, run.kind.replace("_", " ") or ("record" if run.simulated else "measured record"))
    return Page(
        name,
        f"{kind.capitalize()}. {description}".strip(),
        blocks,
        [] if vectors else _key_numbers(run),
        _warnings(run),
        f"{name}: {kind}",
    )


def _warnings(run: AnalysedRun) -> list[str]:
    ended = str(run.record.attrs.get("ended", "complete"))
    lines = [] if ended == "complete" else [f"The run did not reach its end: {ended}."]
    if run.lone and run.others:
        lines.append(
            f"Probe {run.lone} alone is analysed; {listing(run.others)} are left out: x and y need the angle of each "
            "probe. State angle under [probes] of the mapping."
        )
    lines += [f"Passed too fast: {text}." for text in [str(run.record.attrs.get(FAST, ""))] if text]
    return lines + [f"Beyond the range in which the model was checked: {text}." for text in sentences(run.record.attrs)]


def _key_numbers(run: AnalysedRun) -> list[tuple[str, str]]:
    """Numbers that an engineer looks for first."""
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
    if s["mass_flow"] and s["mass_flow"]["mean_nl_min"] > 0:
        cards.append((f"{quantity(s['mass_flow']['mean_nl_min'], 'Nl/min')}", "mean gas consumption"))
    return cards


@dataclass(frozen=True)
class MadeSection:
    """A section with what it shows, or with `why` it is left out; empty where nobody would expect it."""

    section: RecordSection
    data: Any = None
    why: str | None = None


def made_sections(run: AnalysedRun) -> Iterator[MadeSection]:
    """Sections of a run's page in order; those that its experiment expects are left out with the reason."""
    expected = EXPERIMENTS[run.kind if run.kind in EXPERIMENTS else "runup"].figures if run.simulated else MEASURED
    possible = () if run.kind in EXPERIMENTS else tuple(name for name in POSSIBLE if name not in expected)
    vectors = isinstance(run, VectorRun)
    levels = False
    for name in expected if vectors else (*expected, *possible, *ADDED):
        if name == "response_to_reference" and levels and name in possible:
            continue
        section = SECTIONS[name]
        try:
            yield MadeSection(section, section.find(run))
            levels |= name == "static_gain"
        except MissingError as missing:
            yield MadeSection(section, why=str(missing) if name in expected else "")


def settings(run: AnalysedRun) -> Rows:
    """Settings of the run in engineering units."""
    rows = [("Duration", f"{run.summary['duration_s']:.4g} s, {run.summary['samples']} samples")]
    for key, (label, form, scale) in SETTINGS.items():
        if key in run.record.attrs:
            rows.append((label, _shown(run.record.attrs[key], form, scale)))
        if key == "rate" and "pressure" in run.record.attrs:
            rows.append(("Injection pressure", _pressure(run.record.attrs["pressure"])))
    return rows


def _pressure(value: Any) -> str:
    """A gauge pressure [Pa] as a text; a text stays as it is."""
    if not isinstance(value, (int, float, np.number)):
        return str(value)[:300]
    return f"{quantity(float(value) * TO_MPA, 'MPa', '.4g')} gauge"


def provenance(run: AnalysedRun) -> Rows:
    """Hash, seed, versions and whatever else the record states about itself; parameters of experiments with units."""
    rows, known = [], quantities(run.record.attrs)
    for key, value in run.record.attrs.items():
        if key in SETTINGS or key in TEXTS or key in ("pressure", "assumed", BEYOND):
            continue
        label = PROVENANCE.get(key, str(key).replace("_", " ").capitalize())
        if str(key).endswith("_angles"):  # of probes [rad]
            rows.append((label, ", ".join(f"{angle:.6g} deg" for angle in np.rad2deg(np.atleast_1d(value)))))
            continue
        number = key in known and isinstance(value, (int, float, np.number))
        rows.append((label, with_unit(value, known[key].unit) if number else _shown(value, "{:.10g}", 1.0)))
    return rows


def _shown(value: Any, form: str, scale: float) -> str:
    if isinstance(value, (int, float, np.number)) and not isinstance(value, bool):
        return form.format(float(value) * scale)
    if isinstance(value, (list, tuple, np.ndarray)):
        return "; ".join(_shown(entry, form, scale) for entry in value)[:300]
    return str(value)[:300]


def quantities(attrs: Mapping[Any, Any]) -> dict[str, Quantity]:
    """Quantity of every attribute that is a parameter of the experiment, its excitations, harmonics or built-in law."""
    found = _of(EXPERIMENTS.get(str(attrs.get("experiment"))))
    if attrs.get("controller") == "ProportionalLaw":
        from rotorsim.experiments.laws import ProportionalLaw

        found |= _of(ProportionalLaw) | dict.fromkeys(("centre_x", "centre_y"), CENTRE)
    for key in map(str, attrs):
        if named := EXCITATION.fullmatch(key):
            own = _of(EXPERIMENTS.get(str(attrs[key])))
            found |= {f"{named[1]}{name}": quantity for name, quantity in own.items()}
        elif harmonic := HARMONIC.fullmatch(key):
            found[key] = PHASE if harmonic[1] else MAGNITUDE
    return found


def _of(kind: Any) -> dict[str, Quantity]:
    if kind is None:
        return {}
    return {known.attribute or entry.name: known for entry, known in parameters(kind)}


def with_unit(value: float, unit: str) -> str:
    """A number in SI as a text of six digits in a unit of engineers."""
    text, shown = split(show(float(value), unit))
    return quantity(float(text), shown, ".6g").strip()


def results(run: AnalysedRun) -> Rows:
    """The numbers of the summary."""
    s = run.summary
    rows = [("Speed", _speed(s["speed_rpm"]) if run.speed_known else "not in the record")]
    if s["start_transient_s"]:
        more = "" if s["start_settled"] else ", not over by then: run longer"
        rows.append(("Start transient, left out below", f"{s['start_transient_s']:.3g} s{more}"))
    rows += peaks(run) if not run.driven else []
    rows.append(("Largest distance of the disc from its mean", _where(run, s["largest_orbit"])))
    if s["smallest_film"]:
        rows.append(("Smallest film thickness", _where(run, s["smallest_film"])))
    rows += [
        (f"Smallest film thickness, {name}", f"{quantity(f['smallest_um'], 'µm')}")
        for name, f in s.get("films", {}).items()
    ]
    if s["contact"]:
        rows.append(("Contact", _contact(s["contact"])))
    word = feed_word(run.machine)
    if s["mass_flow"] and word:
        rows.append((f"Mass flow of all {word}", _flow(s["mass_flow"])))
        rows += [
            (f"Mass flow, {name}", f"{quantity(1e6 * f['flow_kg_s'], 'mg/s')}")
            for name, f in s.get("films", {}).items()
        ]
    for name, p in s.get("probes", {}).items():
        unit, factor = SHOWN[p["unit"]]
        most, rms = (quantity(p[key] * factor, unit) for key in ("peak", "rms"))
        rows.append((f"Probe {name}", f"{most} at most from its mean, {rms} rms"))
    if run.self_excitable:
        rows.append(("Largest component below 1X", _below(s["sub_synchronous"])))
    return rows + [("Beyond the checked range", text) for text in s.get("beyond_checked_range", ())]


def peaks(run: AnalysedRun) -> Rows:
    """Peaks of the orders."""
    rows = []
    for peak in run.peaks:
        kind = "peak" if peak["local_maximum"] else "largest" + (end_of_run(peak) if run.swept else "")
        size = f"{quantity(peak['um'], 'µm')} 0-pk at {peak['rpm']:.0f} rpm"
        if not run.swept:
            mean, error = mean_order(run.tracked, peak["order"], peak["axis"])
            scatter = f", standard error {quantity(error * TO_UM, 'µm')}" if np.isfinite(error) else ""
            size += f"; mean vector {quantity(mean * TO_UM, 'µm')}{scatter}"
        rows.append((f"{peak['order']}X, {run.axes.get(peak['axis'], peak['axis'])}, {kind}", size))
    return rows


def _speed(found: dict[str, float]) -> str:
    first, last = (str(round(found[end])) for end in ("first", "last"))
    return f"{first} rpm" if first == last else f"{first} to {last} rpm"


def _where(run: AnalysedRun, found: dict[str, float]) -> str:
    at = f"{round(found['rpm'])} rpm, " if run.speed_known else ""
    return f"{quantity(found['um'], 'µm')} at {at}{found['time_s']:.2f} s{end_of_run(found) if run.swept else ''}"


def _contact(found: dict[str, Any]) -> str:
    if not found["samples"]:
        return "none"
    first = f"first at {found['first_time_s']:.2f} s, {found['first_rpm']:.0f} rpm"
    more = "".join(
        f"; {word} at {found[name]['time_s']:.3g} s, {found[name]['rpm']:.0f} rpm: {rule}"
        for name, (word, rule) in LEAVING.items()
        if name in found
    )
    return f"{found['samples']} samples, {first}{more}"


def _flow(found: dict[str, float]) -> str:
    least, mean, most = (found[f"{k}_kg_s"] * 1e6 for k in ("min", "mean", "max"))
    ends = f"{number(least, 'mg/s', '.4g')} to {number(most, 'mg/s', '.4g')}"
    return f"{quantity(mean, 'mg/s', '.4g')} ({ends}), {quantity(found['mean_nl_min'], 'Nl/min')}"


def _below(found: dict[str, float] | None) -> str:
    if found is None:
        return "none above 1 % of the largest line"
    where = f"{abs(found['frequency_hz']):.0f} Hz ({found['ratio']:.2f} X), {found['rpm']:.0f} rpm"
    return f"{quantity(found['um'], 'µm')} at {where}"
