"""Mode shape pictures with pyvista: bent shaft and orbits of its nodes, as files or in a window."""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import xarray as xr

from rotorsim.base.constants import TO_MPA, TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.base.files import write_bytes

SIZE = (1400, 700)
REACH = 0.18
"""Largest displacement drawn, as a share of the shaft's length."""
COLOURS = {"forward": "#0072B2", "backward": "#D55E00", "mixed": "#009E73"}
PHASES = 72


def draw_modes(found: xr.Dataset, folder: Path) -> list[Path]:
    """A PNG for each mode; raises DataError where pyvista is missing or cannot draw, or WriteError.

    Examples
    --------
    >>> import rotorsim as rs
    >>> files = rs.report.draw_modes(rs.analysis.mode_shapes(plant, 300.0, 0.5e6), Path("."))  # doctest: +SKIP
    """
    pv = _pyvista()
    paths = []
    for k in range(found.sizes["mode"]):
        path = folder / f"mode_{k + 1}.png"
        try:
            plotter = pv.Plotter(off_screen=True, window_size=SIZE)
            _scene(pv, plotter, found, k)
            picture = plotter.screenshot(return_img=True)
            plotter.close()
        except (RuntimeError, OSError) as error:
            raise DataError(f"{path}: pyvista cannot draw here ({error}); use --no-pictures") from error
        write_bytes(path, _png(picture))
        paths.append(path)
    return paths


def _png(picture: np.ndarray) -> bytes:
    """An image (height, width, 3) of bytes as PNG."""
    from PIL import Image

    content = BytesIO()
    Image.fromarray(picture).save(content, "PNG")
    return content.getvalue()


def show_modes(found: xr.Dataset) -> None:
    """A window with all modes side by side, linked to turn together; raises DataError without a display.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.report.show_modes(rs.analysis.mode_shapes(plant, 300.0, 0.5e6))  # doctest: +SKIP
    """
    pv = _pyvista()
    shown = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or pv.OFF_SCREEN
    if sys.platform.startswith("linux") and not shown:
        raise DataError("modes: there is no display to open a window on; leave --show out, the pictures need none")
    n = found.sizes["mode"]
    columns = int(np.ceil(np.sqrt(n)))
    plotter = pv.Plotter(shape=(-(-n // columns), columns), window_size=SIZE)
    for k in range(n):
        plotter.subplot(k // columns, k % columns)
        _scene(pv, plotter, found, k)
    plotter.link_views()
    plotter.show()


def lacking() -> str:
    """Missing packages for pictures, as a sentence; found without importing them."""
    try:
        there = find_spec("pyvista") is not None
    except ValueError:  # an import that is blocked
        there = False
    return "" if there else "modes: pictures need pyvista; 'pip install pyvista', or --no-pictures"


def _pyvista() -> ModuleType:
    try:
        import pyvista
    except ImportError as error:
        raise DataError(lacking() or f"modes: pyvista cannot be imported ({error}); use --no-pictures") from error
    return pyvista


def _scene(pv: Any, plotter: Any, found: xr.Dataset, mode: int) -> None:
    """The bent shaft, its rest position, the orbits of its nodes, a caption."""
    z, radius = found["z"].values, found["radius"].values
    shape = found["shape_re"].values[mode] + 1j * found["shape_im"].values[mode]
    length = z[-1] - z[0]
    scale = REACH * length
    whirl = str(found["whirl"].values[mode])
    plotter.set_background("white")
    plotter.add_mesh(pv.lines_from_points(line(z, 0 * shape)), color="#8a949e", line_width=2)
    plotter.add_mesh(tube(pv, z, scale * shape.real, 0.8 * radius), color="#c3ccd4", smooth_shading=True)
    for node, r in zip(found["disc_node"].values, found["disc_radius"].values, strict=True):
        plotter.add_mesh(_disc(pv, z, scale * shape.real, int(node), float(r)), color="#9fb0bf", opacity=0.55)
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, PHASES + 1))
    for k in range(len(z)):
        orbit = scale * (shape[k][None, :] * turn[:, None]).real
        points = np.column_stack([np.full(len(orbit), z[k]), orbit])
        plotter.add_mesh(pv.lines_from_points(points), color=COLOURS[whirl], line_width=2)
        head = pv.Sphere(radius=0.006 * length, center=(z[k], *(scale * shape[k].real)))
        plotter.add_mesh(head, color=COLOURS[whirl])
    hz, zeta = float(found["wn"][mode]) / (2 * np.pi), float(found["zeta"][mode])
    rpm, mpa = found.attrs["speed"] * TO_RPM, found.attrs["pressure"] * TO_MPA
    text = f"mode {mode + 1}: {hz:.2f} Hz, damping ratio {zeta:.4f}, {whirl} at the disc   ({rpm:.0f} rpm, {mpa:g} MPa)"
    plotter.add_text(text, font_size=12, color="#24303c")
    eye = (z.mean() + 0.6 * length, -1.25 * length, 0.45 * length)
    plotter.camera_position = [eye, (z.mean(), 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.camera.zoom(1.0)


def _disc(pv: Any, z: np.ndarray, displacement: np.ndarray, node: int, radius: float) -> Any:
    """A flat cylinder across the bent shaft."""
    slope = np.gradient(displacement, z, axis=0)[node]
    return pv.Cylinder(center=(z[node], *displacement[node]), direction=(1.0, *slope), radius=radius,
                       height=0.03 * (z[-1] - z[0]), resolution=72)  # fmt: skip


def line(z: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """Points (n, 3): along the shaft, x, y."""
    return np.column_stack([z, np.real(displacement)])


def tube(pv: Any, z: np.ndarray, displacement: np.ndarray, radius: np.ndarray) -> Any:
    """The surface of a shaft bent by (n, 2) displacements [m], with the radius right of each node."""
    at = np.repeat(np.arange(len(z)), 2)[1:-1]
    r = np.repeat(radius[:-1], 2)
    at, r = np.concatenate([at[:1], at, at[-1:]]), np.concatenate([[0.0], r, [0.0]])
    angle = np.linspace(0, 2 * np.pi, 49)
    x = np.repeat(z[at][:, None], len(angle), axis=1)
    y = displacement[at, 0][:, None] + r[:, None] * np.cos(angle)
    w = displacement[at, 1][:, None] + r[:, None] * np.sin(angle)
    return pv.StructuredGrid(x[..., None], y[..., None], w[..., None]).extract_surface(algorithm="dataset_surface")
