"""Variable names, units and dimensions of an operating map."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.analysis.axes import Field
from rotorsim.analysis.varied import labelled

if TYPE_CHECKING:
    import xarray as xr

VARIABLES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "done": ((), "1", "whether the point was computed"),
    "lifted": ((), "1", "whether the film carries the rotor"),
    "eccentricity_ratio": ((), "1", "eccentricity ratio, the largest of all films"),
    "h_min": ((), "m", "smallest film thickness"),
    "journal": (("axis",), "m", "journal position"),
    "disc": (("axis",), "m", "disc position"),
    "film_force": (("axis",), "N", "film force on the journal"),
    "mass_flow": (("injector",), "kg/s", "mass flow into the film"),
    "wn": (("mode",), "rad/s", "natural frequency"),
    "zeta": (("mode",), "1", "damping ratio"),
    "whirl_ratio": (("mode",), "1", "roundness of the disc's orbit, 1 forward, -1 backward"),
    "proven": ((), "1", "1: no mode is missing among those listed up to the second pair and the speed, 0: not proven"),
    "zeta_least": ((), "1", "least damping ratio of all modes up to the highest speed, and of the first four"),
    "looked": ((), "1", "1: all modes and the critical speeds around the speed were looked for, 0: not all"),
    "static_gain": (("axis", "reference"), "m/V", "static gain from reference to disc"),
    "delay": (("axis",), "s", "delay of the film force behind the reference"),
    "film_frequency": (("at",), "rad/s", "whirl frequency of film stiffness and damping"),
    "film_stiffness": (("at", "axis", "to"), "N/m", "film stiffness K(omega)"),
    "film_damping": (("at", "axis", "to"), "N s/m", "film damping C(omega)"),
}
"""Variables of a point: dimensions, unit, name."""
CRITICAL: dict[str, tuple[str, str]] = {
    "critical_speed": ("rad/s", "speed that a natural frequency equals"),
    "critical_zeta": ("1", "damping ratio at the critical speed"),
    "critical_direction": ("1", "1: the natural frequency rises above the speed, -1: it falls below"),
    "critical_whirl_ratio": ("1", "roundness of the disc's orbit, 1 forward, -1 backward"),
}
"""Variables of a critical speed, in the order of the columns of `safe_region.Surroundings.critical`: unit, name."""
BRANCHES: dict[str, tuple[str, str]] = {
    "branch_wn": ("rad/s", "natural frequency of a mode, followed"),
    "branch_zeta": ("1", "damping ratio of a mode, followed"),
    "branch_whirl_ratio": ("1", "roundness of the disc's orbit, 1 forward, -1 backward"),
}
"""Variables of a branch, in the order of the last axis of `safe_region.Surroundings.branches`: unit, name."""


def coordinates(
    fields: Sequence[Field],
    speeds: np.ndarray,
    pressures: np.ndarray,
    at: Sequence[str],
    films: Sequence[str],
) -> dict[str, tuple[str, Any, dict[str, str]]]:
    """Coordinates of a map, the names of several films among them."""
    found = {f.name: (f.name, list(f.numbers), labelled(f)) for f in fields}
    return found | {
        "pressure": ("pressure", pressures, {"units": "Pa", "long_name": "supply pressure, gauge"}),
        "speed": ("speed", speeds, {"units": "rad/s", "long_name": "speed of the shaft"}),
        "axis": ("axis", ["x", "y"], {}),
        "reference": ("reference", ["x", "y"], {}),
        "to": ("to", ["x", "y"], {}),
        "at": ("at", list(at), {"long_name": "whirl frequency"}),
        "bearing": ("bearing", list(films), {"long_name": "gas bearing"}),
    }


def label(
    tables: dict[str, np.ndarray],
    critical: np.ndarray,
    branches: np.ndarray,
    coords: dict[str, Any],
    fields: Sequence[Field],
    attrs: dict[str, Any],
) -> xr.Dataset:
    """The Dataset of tables (fields..., pressure, speed, ...), of critical speeds (fields..., pressure, k, 4) and of
    branches (fields..., pressure, b, speed, 3)."""
    import xarray as xr

    over = (*(f.name for f in fields), "pressure", "speed")
    variables = {}
    for key in (k for k in VARIABLES if k in tables):
        dims, unit, text = VARIABLES[key]
        if tables[key].ndim > len(over) + len(dims):
            dims = tuple(d for dim in dims for d in (("bearing", dim) if dim == "axis" else (dim,)))
        variables[key] = ((*over, *dims), tables[key], {"units": unit, "long_name": text})
    for known, dims, values in ((CRITICAL, ("critical",), critical), (BRANCHES, ("branch", "speed"), branches)):
        for column, (key, (unit, text)) in enumerate(known.items()):
            variables[key] = ((*over[:-1], *dims), values[..., column], {"units": unit, "long_name": text})
    modes = tables["wn"].shape[-1] if "wn" in tables else 0
    extra = {"mode": ("mode", np.arange(1, modes + 1), {"long_name": "mode, by frequency"})} if modes else {}
    used = {d for dims, *_ in variables.values() for d in dims}
    return xr.Dataset(variables, {k: v for k, v in (coords | extra).items() if k in used}, attrs)


def plain(text: str) -> str:
    """Text that can be a file's name."""
    return re.sub(r"[^\w.-]+", "_", text).strip("_")
