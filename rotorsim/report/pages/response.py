"""Pages of linear analyses over speed: unbalance response, Campbell diagram with critical speeds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from rotorsim.analysis.campbell import critical_rows, modes_line, searched_line
from rotorsim.analysis.unbalance_response import ENDS, peak_of
from rotorsim.base import toml_text as tomllib
from rotorsim.base.constants import TO_HZ, TO_MPA, TO_RPM, TO_UM
from rotorsim.report.export.display_units import quantity
from rotorsim.report.figures.shaft_plots import critical_speed_map, distinct, response_figure, shaft_campbell
from rotorsim.report.pages.study import Block, save_study_page

ROWS = 60
"""Rows of a table, at most."""


def write_response(found: xr.Dataset, path: str | Path) -> Path:
    """Write the page of an unbalance response; raises WriteError where it cannot be written.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.unbalance_response(plant, [200.0, 300.0, 400.0], 0.5e6)
    >>> page = rs.report.write_response(found, "response.html")
    """
    about = f"Unbalance: {found.attrs['unbalance']}. {at(found)} Linear about the equilibrium of each speed."
    about += warned(found)
    places = distinct(found)
    head = ("speed [rpm]", *(f"{place} [µm 0-pk]" for place in places), "least damping ratio")
    step = -(-found.sizes["speed"] // ROWS)
    rows = [
        (f"{float(one['speed']) * TO_RPM:.0f}", *(float(one["major"].sel(place=p)) * TO_UM for p in places),
         float(one["zeta_least"]))
        for one in (found.isel(speed=k) for k in range(0, found.sizes["speed"], step))
    ]  # fmt: skip
    text = "Amplitudes are 0-pk; the phase of x lags the unbalance."
    blocks = [
        Block("Response over speed", text, figure=response_figure(found)),
        Block("Peaks", "Where no mode grows.", ("place", "speed [rpm]", "size [µm 0-pk]", "may be larger beyond"),
              peaks(found)),
        Block("Speed by speed", "" if step == 1 else "Every speed is in the files.", head, rows),
    ]  # fmt: skip
    save_study_page(f"{name(found)}: unbalance response", about, blocks, Path(path))
    return Path(path)


def write_campbell(found: xr.Dataset, path: str | Path, stiffness: xr.Dataset | None = None) -> Path:
    """Write the page of a Campbell diagram, with a critical speed map over the bearings' stiffness where it is given.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.campbell(rs.Plant("plain_rotor"), [0.0, 100.0, 200.0], modes=4)
    >>> page = rs.report.write_campbell(found, "campbell.html")
    """
    text = (
        "Triangles up whirl forward at the measuring plane, down backward. Rings mark critical speeds. Lines end where "
        "a mode leaves the region that is looked at or the film does not carry."
    )
    orders = ("order", "speed [rpm]", "natural frequency", "damping ratio", "amplification", "whirl", "mode")
    sure = f"Modes: {modes_line(found)}. Critical speeds are searched from {searched_line(found)}."
    ends = ("mode", "speed [rpm]", "frequency [Hz]", "damping ratio", "whirl")
    blocks = [
        Block("Campbell diagram", text, figure=shaft_campbell(found)),
        Block("Critical speeds", sure, orders, criticals(found)),
        Block("Modes at the ends", "", ends, _ends(found)),
    ]
    if stiffness is not None:
        text = "Undamped, of the rotor on bearings of one stiffness each; films are springs here."
        blocks.append(Block("Critical speeds over the bearings' stiffness", text, figure=critical_speed_map(stiffness)))
    save_study_page(
        f"{name(found)}: Campbell diagram",
        f"{at(found)} The lowest modes of the region.{warned(found)}",
        blocks,
        Path(path),
    )
    return Path(path)


def peaks(found: xr.Dataset) -> list[tuple[str, str, float, str]]:
    """Largest response of each place: place, speed [rpm], size [um 0-pk], and where it may be larger beyond."""
    known = [(place, peak_of(found, place)) for place in distinct(found)]
    return [
        (place, f"{one['rpm']:.0f}", one["um"], ENDS.get(one["at_end"], "-")) for place, one in known if one is not None
    ]


def warned(found: xr.Dataset) -> str:
    """Sentences about the speeds at which a result does not hold, after a space; empty without any."""
    return "".join(f" Warning: {sentence}." for sentence in str(found.attrs.get("warnings", "")).splitlines())


def criticals(found: xr.Dataset) -> list[tuple[object, ...]]:
    """Critical speeds: order, speed [rpm], how the natural frequency passes, damping, amplification, whirl, mode."""
    return [
        (f"{order}X", f"{rpm:.0f}", "rises above" if direction == "upward" else "falls below", zeta,
         f"{1 / (2 * zeta):.3g}" if zeta > 0 else "grows", whirl, str(mode))
        for order, rpm, direction, zeta, whirl, mode in critical_rows(found)
    ]  # fmt: skip


def _ends(found: xr.Dataset) -> list[tuple[object, ...]]:
    return [
        (str(int(one["branch"])), f"{float(one['speed']) * TO_RPM:.0f}", float(one["wn"]) * TO_HZ, float(one["zeta"]),
         str(one["whirl"].values))
        for k in range(found.sizes["branch"])
        for one in (found.isel(branch=k, speed=int(end)) for end in np.flatnonzero(found["wn"].notnull()[k])[[0, -1]])
    ]  # fmt: skip


def name(found: xr.Dataset) -> str:
    """Name of the machine of a result."""
    return str(tomllib.loads(str(found.attrs["machine"])).get("name", "Unnamed machine"))


def at(found: xr.Dataset) -> str:
    """Sentence about the supply pressure; empty for a machine without a film."""
    films = "gas_film" in str(found.attrs["machine"])
    return f"Supply pressure {quantity(found.attrs['pressure'] * TO_MPA, 'MPa', '.4g')} gauge." if films else ""
