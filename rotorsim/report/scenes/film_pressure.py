"""Scene of the gas film: its pressure as a coloured relief on the journal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rotorsim.base.constants import TO_MPA, TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.report.scenes.film import INK, camera, save

RELIEF = 0.7
"""Height of the highest pressure above the journal, as a share of its radius."""
VIEW = 6.5
"""Distance of the view, in radii or half lengths of the journal."""


def film_on_journal(motion: xr.Dataset, path: str | Path) -> Path:
    """Film pressure on the journal over a motion of the shaft, as .gif or .mp4; the first frame alone as .png.

    Parameters
    ----------
    motion : Dataset
        Of `rotorsim.analysis.shaft_motion`.
    path : path
        File to write.

    Raises
    ------
    DataError
        For a machine without a gas film, or where nothing can be drawn.

    Examples
    --------
    >>> import rotorsim as rs
    >>> motion = rs.analysis.shaft_motion(plant, 300.0, 0.5e6)
    >>> rs.report.film_on_journal(motion, "film.png").name
    'film.png'
    """
    if "film_pressure" not in motion:
        raise DataError("film on the journal: the machine has no gas film; take one that has")
    p, theta, z = (motion[name].values for name in ("film_pressure", "theta", "film_z"))
    low, high, radius = float(p.min()), float(p.max()), float(motion.attrs["film_radius"])
    around = np.append(theta, theta[0] + 2 * np.pi)
    rpm, mpa = motion.attrs["speed"] * TO_RPM, motion.attrs["pressure"] * TO_MPA
    title = f"film pressure, absolute; its height above the journal likewise   ({rpm:.0f} rpm, {mpa:g} MPa)"
    bar = {"title": "MPa", "color": INK, "vertical": True, "position_x": 0.9, "position_y": 0.2, "height": 0.6,
           "title_font_size": 18, "label_font_size": 16, "fmt": "%.2f"}  # fmt: skip
    light, length = {"ambient": 0.45, "diffuse": 0.6, "smooth_shading": True}, float(z[-1] - z[0])

    def draw(pv: Any, plotter: Any, k: int) -> None:
        values = np.vstack([p[k], p[k][:1]])
        r = radius * (1.02 + RELIEF * (values - low) / max(high - low, 1e-9 * high))
        grid = _around(pv, z, around, r)
        grid["MPa"] = (values * TO_MPA).ravel(order="F")
        limits = low * TO_MPA, high * TO_MPA
        plotter.add_mesh(grid, scalars="MPa", cmap="viridis", clim=limits, scalar_bar_args=bar, **light)
        shaft = pv.Cylinder(
            center=(z.mean(), 0.0, 0.0), direction=(1.0, 0.0, 0.0), radius=radius, height=1.6 * length, resolution=90
        )
        plotter.add_mesh(shaft, color="#c3ccd4", ambient=0.25, split_sharp_edges=True, smooth_shading=True)
        plotter.add_text(title, font_size=11, color=INK)
        camera(plotter, (z.mean(), 0.0, 0.0), VIEW * max(radius, 0.5 * length), 0.7, 0.45)

    return save(path, draw, len(p))


def _around(pv: Any, z: np.ndarray, theta: np.ndarray, r: np.ndarray) -> Any:
    """A surface of radius r (theta, z) about the shaft's axis."""
    x = np.broadcast_to(z, r.shape)
    y, w = r * np.cos(theta)[:, None], r * np.sin(theta)[:, None]
    return pv.StructuredGrid(x[..., None].copy(), y[..., None], w[..., None])
