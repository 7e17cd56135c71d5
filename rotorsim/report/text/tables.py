"""Tables of a report: settings, results and provenance."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorsim.base.constants import TO_MPA, TO_RPM
from rotorsim.experiments.limits import BEYOND
from rotorsim.report.export.display_units import number, quantity
from rotorsim.report.pages.film_parts import feed_word
from rotorsim.report.pages.run import Run
from rotorsim.report.text.captions import end_of_run
from rotorsim.report.text.parameters import quantities, with_unit
from rotorsim.signals.probes import SHOWN

Rows = list[tuple[str, str]]
SETTINGS = {
    "experiment": ("Experiment", "{}", 1.0),
    "start_speed": ("Start speed", "{:.0f} rpm", TO_RPM),
    "stop_speed": ("Stop speed", "{:.0f} rpm", TO_RPM),
    "rate": ("Rate", "{:.4g} rpm/s", TO_RPM),
    "sample_rate_hz": ("Sample rate", "{:.6g} Hz", 1.0),
    "ended": ("Ended", "{}", 1.0),
}
PROVENANCE = {"machine_hash": "Machine's hash", "seed": "Seed"}


def settings(run: Run) -> Rows:
    """Settings of the run in engineering units."""
    rows = [("Duration", f"{run.summary['duration_s']:.4g} s, {run.summary['samples']} samples")]
    for key, (label, form, scale) in SETTINGS.items():
        if key in run.record.attrs:
            rows.append((label, _shown(run.record.attrs[key], form, scale)))
        if key == "rate" and "pressure" in run.record.attrs:
            rows.append(("Injection pressure", _pressure(run.record.attrs["pressure"])))
    return rows


def _pressure(value: Any) -> str:
    """A gauge pressure [Pa] as a text; what is no number as it is."""
    if not isinstance(value, (int, float, np.number)):
        return str(value)[:300]
    return f"{quantity(float(value) * TO_MPA, 'MPa', '.4g')} gauge"


def provenance(run: Run) -> Rows:
    """Hash, seed, versions and whatever else the record states about itself; parameters of experiments with units."""
    rows, known = [], quantities(run.record.attrs)
    for key, value in run.record.attrs.items():
        if key in SETTINGS or key in ("pressure", "machine", "assumed", BEYOND):
            continue
        label = PROVENANCE.get(key, str(key).replace("_", " ").capitalize())
        number = key in known and isinstance(value, (int, float, np.number))
        rows.append((label, with_unit(value, known[key].unit) if number else _shown(value, "{:.10g}", 1.0)))
    return rows


def _shown(value: Any, form: str, scale: float) -> str:
    if isinstance(value, (int, float, np.number)) and not isinstance(value, bool):
        return form.format(float(value) * scale)
    return str(value)[:300]


def results(run: Run) -> Rows:
    """The numbers of the summary."""
    s = run.summary
    rows = [("Speed", _speed(s["speed_rpm"]) if run.speed_known else "not in the record")]
    if s["start_transient_s"]:
        rows.append(("Start transient, left out below", f"{s['start_transient_s']:.3g} s"))
    for peak in run.peaks if not run.driven else ():
        kind = "peak" if peak["local_maximum"] else "largest" + (end_of_run(peak) if run.swept else "")
        rows.append(
            (
                f"{peak['order']}X, disc {peak['axis']}, {kind}",
                f"{quantity(peak['um'], 'µm')} 0-pk at {peak['rpm']:.0f} rpm",
            )
        )
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
    rows += probe_rows(s.get("probes", {}))
    if run.self_excitable:
        rows.append(("Largest component below 1X", _below(s["sub_synchronous"])))
    return rows + beyond_rows(s)


def beyond_rows(summary: dict[str, Any]) -> Rows:
    """A row for each limit of the checked range that the run exceeds."""
    return [("Beyond the checked range", text) for text in summary.get("beyond_checked_range", ())]


def probe_rows(probes: dict[str, dict[str, Any]]) -> Rows:
    """Peak and rms of every probe's reading about its mean."""
    return [
        (
            f"Probe {name}",
            f"{_reading(p['peak'], p['unit'])} at most from its mean, {_reading(p['rms'], p['unit'])} rms",
        )
        for name, p in probes.items()
    ]


def _reading(value: float, unit: str) -> str:
    """A reading of a probe in its displayed unit."""
    name, factor = SHOWN[unit]
    return quantity(value * factor, name)


def _speed(found: dict[str, float]) -> str:
    first, last = f"{found['first']:.0f}", f"{found['last']:.0f}"
    return f"{first} rpm" if first == last else f"{first} to {last} rpm"


def _where(run: Run, found: dict[str, float]) -> str:
    at = f"{found['rpm']:.0f} rpm, " if run.speed_known else ""
    return f"{quantity(found['um'], 'µm')} at {at}{found['time_s']:.2f} s{end_of_run(found) if run.swept else ''}"


def _contact(found: dict[str, Any]) -> str:
    if not found["samples"]:
        return "none"
    first = f"first at {found['first_time_s']:.2f} s, {found['first_rpm']:.0f} rpm"
    return f"{found['samples']} samples, {first}"


def _flow(found: dict[str, float]) -> str:
    least, mean, most = (found[f"{k}_kg_s"] * 1e6 for k in ("min", "mean", "max"))
    ends = f"{number(least, 'mg/s', '.4g')} to {number(most, 'mg/s', '.4g')}"
    return f"{quantity(mean, 'mg/s', '.4g')} ({ends}), {quantity(found['mean_nl_min'], 'Nl/min')}"


def _below(found: dict[str, float] | None) -> str:
    if found is None:
        return "none above 1 % of the largest line"
    where = f"{abs(found['frequency_hz']):.0f} Hz ({found['ratio']:.2f} X), {found['rpm']:.0f} rpm"
    return f"{quantity(found['um'], 'µm')} at {where}"
