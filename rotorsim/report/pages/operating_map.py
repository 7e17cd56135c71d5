"""Report of an operating map: self-contained page of figures and a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from rotorsim.base import toml_text as tomllib
from rotorsim.base.constants import TO_HZ, TO_MPA, TO_RPM, TO_UM
from rotorsim.report.export.display_units import in_page_units
from rotorsim.report.figures.map_plots import (
    campbell_figure,
    constants,
    contour_figure,
    film_figure,
    has_gains,
    has_onset,
    onset_figure,
    plane,
    varying,
)
from rotorsim.report.pages.study import Block, save_study_page

HEADS = (
    "speed [rpm]",
    "pressure [MPa]",
    "eccentricity ratio",
    "lower mode [Hz]",
    "its damping ratio",
    "upper mode [Hz]",
    "its damping ratio",
)
GAINS = ("gain x by x [µm/V]", "gain y by y [µm/V]")
MOST_ROWS = 400


@in_page_units
def save_map_page(found: xr.Dataset, path: str | Path, units: str = "metric", figures: str | None = None) -> None:
    """Write the page; of further axes the first value is drawn. Raises DataError where it cannot be written.

    `units` and `figures` as for `write_report`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.map_machine(plant, [0.0, 300.0], [0.4e6, 0.5e6], workers=1)
    >>> rs.report.save_map_page(found, "map.html")
    """
    one = plane(found)
    save_study_page(f"{_name(found)}: operating map", _about(found), blocks(one), path, units, figures)


def blocks(one: xr.Dataset) -> list[Block]:
    """Sections that the map allows."""
    margin = 100 * float(one.attrs.get("safe_margin", 0.15))
    least, unknown = float(one.attrs.get("least_amplification", 2.5)), bool(np.isnan(one["safe"].values).any())
    out = []
    if one.sizes["speed"] > 1 and one.sizes["pressure"] > 1 and varying(one):
        shaded = (
            f"Shaded red: not carried by the film, a mode grows, or within {margin:g} % of a critical speed, where the "
            f"speed equals the natural frequency of a mode that amplifies {least:.3g} times or more (looked for beyond "
            "the ends of the map as far as it matters). "
            + ("Shaded grey: not known, because not all modes could be looked for. " if unknown else "")
            + "Whirl ratio: 1 a forward circle, 0 a line, -1 a backward circle. "
            + "".join(f"All over the map: {title} {value:.4g}. " for title, value in constants(one))
        ).strip()
        out.append(Block("Operating map", shaded, figure=contour_figure(one)))
    if one.sizes["speed"] > 1 and np.isfinite(one["branch_wn"]).any():
        text = (
            "The lowest modes, followed over the speed. Triangles up whirl forward at the disc, down backward. "
            "Crosses: orders of the speed meet a mode."
        )
        out.append(Block("Campbell diagram", text, figure=campbell_figure(one)))
    if has_onset(one):
        text = "Whirl onset: right of it a mode grows. Lift-off: below it the film does not carry the rotor."
        out.append(Block("Whirl onset and lift-off", text, figure=onset_figure(one)))
    if one.sizes["pressure"] > 1 and "film_stiffness" in one and np.isfinite(one["film_stiffness"].values).any():
        rpm = float(one["speed"].values[one.sizes["speed"] // 2]) * TO_RPM
        text = f"At {rpm:.0f} rpm, at whirl frequency 0 and those of the two lowest modes unless given otherwise."
        out.append(Block("Film coefficients", text, figure=film_figure(one)))
    missing = _missing(one)
    if missing:
        out.append(Block("Not shown", "", ("figure", "reason"), missing))
    rows = _rows(one)
    text = "" if len(rows) <= MOST_ROWS else f"The first {MOST_ROWS} of {len(rows)} points; all are in the file."
    heads = (*HEADS, *(GAINS if has_gains(one) else ()), "safe")
    return [*out, Block("Point by point", text, heads, rows[:MOST_ROWS])]


def _missing(one: xr.Dataset) -> list[tuple[str, str]]:
    """Results that were asked for and hold no number, with the reason."""
    reasons = {"onset_speed": ("whirl onset", "no mode grows at any pressure up to the highest speed searched"),
               "lift_off_pressure": ("lift-off", "no pressure carries the rotor at any of the speeds")}  # fmt: skip
    if "onset_looked" in one and (one["onset_looked"].values != 1).any():
        reasons["onset_speed"] = "whirl onset", "not known: the number of modes is not proven at every speed"
    return [reason for name, reason in reasons.items() if name in one and not np.isfinite(one[name]).any()]


def _rows(one: xr.Dataset) -> list[tuple[object, ...]]:
    rows: list[tuple[object, ...]] = []
    gains = has_gains(one)
    for i, pressure in enumerate(one["pressure"].values):
        for j, speed in enumerate(one["speed"].values):
            p = one.isel(pressure=i, speed=j)
            if float(p["lifted"]) != 1:
                rows.append(
                    (
                        f"{speed * TO_RPM:.0f}",
                        f"{pressure * TO_MPA:.3g}",
                        "not lifted",
                        *[""] * (6 if gains else 4),
                        "no",
                    )
                )
                continue
            wn, zeta, gain = p["wn"].values * TO_HZ, p["zeta"].values, p["static_gain"].values * TO_UM
            numbers = (float(p["eccentricity_ratio"]), *(float(v) for v in (wn[0], zeta[0], wn[1], zeta[1])))
            own = (float(gain[0, 0]), float(gain[1, 1])) if gains else ()
            safe = {1.0: "yes", 0.0: "no"}.get(float(p["safe"]), "not known")
            rows.append((f"{speed * TO_RPM:.0f}", f"{pressure * TO_MPA:.3g}", *numbers, *own, safe))
    return rows


def _name(found: xr.Dataset) -> str:
    try:
        return str(tomllib.loads(str(found.attrs.get("machine", ""))).get("name", "Unnamed machine"))
    except tomllib.TOMLDecodeError:
        return "Unnamed machine"


def _about(found: xr.Dataset) -> str:
    lifted, points = int(found["lifted"].sum()), int(found["lifted"].size)
    extra = [d for d in found["lifted"].dims if d not in ("pressure", "speed")]
    more = ""
    if extra:
        first = ", ".join(f"{found[d].attrs.get('long_name', d)} = {found[d].values[0]:g} "
                          f"{found[d].attrs.get('units', '')}" for d in extra)  # fmt: skip
        more = f" Drawn at {first}; the file holds all values."
    cut = "" if found.attrs.get("ended") == "complete" else " The map was interrupted and is not complete."
    return (
        f"Linear analysis of film, injectors and rotor together at {points} operating points, {lifted} of them lifted."
        f"{more}{cut} This is a simulation; numbers of a machine file marked calibrated were fitted."
    )
