"""Captions of run-up figures, written from the numbers of the run."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorsim.base.constants import TO_MPA, TO_RPM, TO_UM
from rotorsim.report.export.display_units import displacement, number, quantity
from rotorsim.report.figures.film3d import snapshots
from rotorsim.report.figures.orbit_plots import TURNS, instants
from rotorsim.report.pages.film_parts import feed_word
from rotorsim.report.pages.run import Run

CONVENTION = (
    "Displacements are Re(A exp(i n α)) with the shaft angle α; amplitudes are 0-pk and a positive phase lag means "
    "that the maximum comes after the mark. On a round forward orbit y lags x by 90 degrees."
)


def bode_caption(run: Run) -> str:
    """Where the orders peak."""
    if not run.summary["peaks"]:
        return "The shaft did not turn long enough for whole revolutions to be tracked."
    return " ".join(
        [*(_order_sentence(run, int(n)) for n in run.tracked["order"].values), start_text(run.summary)]
    ).strip()


def _order_sentence(run: Run, order: int) -> str:
    peaks = [p for p in run.peaks if p["order"] == order]
    if not peaks:
        return f"{order}X is not resolved, or stays below a thousandth of the largest order."
    resonant = [p for p in peaks if p["local_maximum"]]
    if resonant:
        return f"{order}X peaks at " + " and ".join(_place(p) for p in _first_of_each_axis(resonant)) + "."
    where = " and ".join(_place(p) + (end_of_run(p) if run.swept else "") for p in peaks)
    if not run.swept:
        return f"{order}X is at most {where}."
    return f"{order}X passes no resonance; it is largest at {where}."


def end_of_run(extreme: dict[str, Any]) -> str:
    """Rest of a sentence about an extreme that lies at an end of its run, where it may be larger beyond; else empty."""
    return f", at the {extreme['at_end']} of the run" if extreme["at_end"] else ""


def start_text(summary: dict[str, Any]) -> str:
    """A sentence about the start transient that the numbers leave out; empty without one."""
    begin = summary["start_transient_s"]
    if not begin:
        return ""
    return f"The first {begin:.3g} s, in which the rotor swings from rest onto its orbit, are left out of the numbers."


def _first_of_each_axis(peaks: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [next(p for p in peaks if p["axis"] == axis) for axis in sorted({p["axis"] for p in peaks})]


def _place(peak: dict[str, Any]) -> str:
    return f"{peak['rpm']:.0f} rpm ({peak['axis']}: {quantity(peak['um'], 'µm')})"


def waterfall_caption(run: Run) -> str:
    """The strongest line, and whether anything below 1X stands out."""
    size = run.spectra["amplitude"]
    line, k, axis = (int(v) for v in np.unravel_index(int(size.values.argmax()), size.shape))
    frequency, rpm = float(run.spectra["frequency"][k]), float(run.spectra["speed"][line]) * TO_RPM
    where = f"{frequency:.0f} Hz (disc {'xy'[axis]}" + (f", {rpm:.0f} rpm)" if run.speed_known else ")")
    text = f"The strongest line is {displacement(float(size.max()))} at {where}."
    return f"{text} {sub_synchronous_text(run)}" if run.self_excitable else text


def sub_synchronous_text(run: Run) -> str:
    """A sentence on motion below 1X."""
    found = run.summary["sub_synchronous"]
    if found is None:
        return "Below 1X nothing stands out of the spectra: no sub-synchronous whirl."
    turn = "forward" if found["frequency_hz"] > 0 else "backward"
    return (
        f"Below 1X the largest component is {quantity(found['um'], 'µm')} at {abs(found['frequency_hz']):.0f} Hz, "
        f"{turn}, {found['ratio']:.2f} times the shaft speed, at {found['rpm']:.0f} rpm."
    )


def full_spectrum_caption(run: Run) -> str:
    """How much of the motion turns forward at the fastest tracked window."""
    if run.tracked.sizes["window"] == 0:
        return "Spectrum of x + i y."
    i = int(np.abs(run.tracked["speed"].values).argmax())
    rpm = float(run.tracked["speed"][i]) * TO_RPM
    f, b = (abs(complex(run.tracked[k].sel(order=1).values[i])) * TO_UM for k in ("forward", "backward"))
    return (
        f"Spectrum of x + i y. At {rpm:.0f} rpm the 1X orbit is made of {quantity(f, 'µm')} forward and "
        f"{quantity(b, 'µm')} backward: semi-axes {number(f + b, 'µm')} and {quantity(abs(f - b), 'µm')}."
    )


def orbits_caption(run: Run) -> str:
    """Meaning of the dots, and the largest orbit."""
    largest, count = run.summary["largest_orbit"], len(instants(run))
    text = (
        f"{TURNS} revolutions at {count} instant{'s' * (count > 1)}, the disc about its middle; dots mark whole turns "
        "of the shaft. The largest distance of the disc from its mean is "
        f"{quantity(largest['um'], 'µm')} at {largest['rpm']:.0f} rpm{end_of_run(largest)}."
    )
    if "journal" in run.record and run.machine and run.machine.film:
        gaps = dict.fromkeys(displacement(film.clearance) for film in run.machine.films)
        text += f" The dashed line is where a journal touches; the clearance is {' and '.join(gaps)}"
        text += ", without what bends the foil." if any(film.foil for film in run.machine.films) else "."
    return text


def planes_caption(run: Run, planes: list[tuple[str, ...]]) -> str:
    """Which probes make the orbit of each row."""
    rows = "; ".join(f"{', '.join(plane)} at {_place_of(run, plane[0])}" for plane in planes)
    return f"x and y of each plane from its probes at their angles: {rows}. {TURNS} revolutions, dots at whole turns."


def _place_of(run: Run, probe: str) -> str:
    known = [str(name) for name in run.record["probe"].values]
    return f"z = {quantity(1e3 * float(run.record['probe_position'].values[known.index(probe)]), 'mm', '.6g')}"


def readings_caption(run: Run) -> str:
    """Direction and quantity of each probe."""
    columns = (run.record[name].values for name in ("probe", "probe_quantity", "probe_angle"))
    if not {"probe_quantity", "probe_angle"} <= set(run.record.coords):
        return "Bands span the least and the largest value of each stretch of time."
    rows = "; ".join(
        f"{name} {str(q).replace('_', ' ')} at {np.degrees(a):.4g}°" for name, q, a in zip(*columns, strict=True)
    )
    return f"Bands span the least and the largest value of each stretch of time. {rows}."


def overview_caption(run: Run) -> str:
    """Film thickness, contact and flow in a sentence each."""
    film, contact, flow = (run.summary[k] for k in ("smallest_film", "contact", "mass_flow"))
    sentences = ["Bands span the least and the largest value of each stretch of time."]
    if film:
        films = run.summary.get("films", {})
        where = f" in the bearing {min(films, key=lambda name: films[name]['smallest_um'])}" if films else ""
        at = f"{film['time_s']:.2f} s, {film['rpm']:.0f} rpm"
        sentences.append(f"The film is thinnest{where} at {at}{end_of_run(film)}, with {quantity(film['um'], 'µm')}.")
    if contact:
        sentences.append(contact_text(contact))
    word = feed_word(run.machine)
    if flow and word:
        sentences.append(f"The {word} take {quantity(flow['mean_nl_min'], 'normal litres per minute')} on average.")
    return " ".join(sentences)


def contact_text(contact: dict[str, Any]) -> str:
    """Whether and when a journal touched its sleeve."""
    if not contact["samples"]:
        return "The journal never touches the sleeve."
    return (
        f"The journal touches the sleeve in {contact['samples']} samples, first at {contact['first_time_s']:.2f} s, "
        f"{contact['first_rpm']:.0f} rpm."
    )


def film_caption(run: Run) -> str:
    """Range of the pressure over the snapshots and where it is highest."""
    p = run.record["film_pressure"].isel(snapshot=snapshots(run))
    at, word = p.isel(p.argmax(...)), feed_word(run.machine)
    where = f" in the bearing {at['bearing'].item()}" if "bearing" in p.dims else ""
    circles = f"Circles are the {word}; colours" if word else "Colours"
    low, high = number(float(p.min()) * TO_MPA, "MPa"), quantity(float(p.max()) * TO_MPA, "MPa")
    return (
        f"Pressures range from {low} to {high} absolute, highest at {float(np.degrees(at['theta'])):.0f} deg{where}. "
        f"{circles} run smoothly between the {p.sizes['theta']} × {p.sizes['z']} cells of the grid."
    )


def surface_caption(run: Run) -> str:
    """Exaggeration of the surface in the picture."""
    p = run.record["film_pressure"].isel(snapshot=-1)
    rpm = float(run.record["snapshot_speed"][-1]) * TO_RPM
    spread = float(p.max() - p.min()) * TO_MPA
    film, its = ("films", "their") if "bearing" in p.dims else ("film", "its")
    return (
        f"The {film} at {rpm:.0f} rpm round the shaft; {its} height, much exaggerated, is the pressure, which differs "
        f"by {quantity(spread, 'MPa')}. Drag to turn."
    )
