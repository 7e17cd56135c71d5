"""Pictures and films of the shaft: modes, whirl orbits, the gas film as a relief on the journal; drawn by pyvista.

A picture is a .png, a film a .gif or .mp4 of several frames; none needs a window. A .gif is written by Pillow, which
pyvista needs itself; a .mp4 by a program `ffmpeg`, which is not installed with rotorsim (its licence is that of its
codecs).
"""

import ctypes
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import xarray as xr

from rotorsim.base.errors import DataError
from rotorsim.base.files import write_bytes
from rotorsim.base.interrupt import undoing
from rotorsim.base.units import TO_MPA, TO_RPM, TO_UM

COLOURS = {"forward": "#0072B2", "backward": "#D55E00", "mixed": "#009E73"}
FLAT = 0.02
"""Orbits whose area is below this share of the largest have no sense of whirl."""
REACH = 0.16
"""Largest displacement drawn, as a share of the shaft's length."""
VIEW = 1.45
"""Distance of the view, in lengths of the shaft."""
SIDE = 0.5
"""Angle [rad] of the view about the vertical where it stands still."""


def mode_turntable(found: xr.Dataset, path: str | Path, mode: int = 0, frames: int = 60, cycles: int = 3) -> Path:
    """A mode in motion while the view turns once round the shaft, as .gif or .mp4; the first frame alone as .png.

    Parameters
    ----------
    found : Dataset
        Of `rotorsim.analysis.shaft_motion`.
    path : path
        File to write.
    mode : int
        Its number, from 0.
    frames, cycles : int
        Frames of the film and periods of the mode in it.

    Raises
    ------
    DataError
        For a mode that is not there or where nothing can be drawn.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.mode_shapes(plant, 300.0, 0.5e6)
    >>> rs.report.mode_turntable(found, "mode.gif", frames=3).name
    'mode.gif'
    """
    count = found.sizes["mode"]
    if not 0 <= mode < count:
        raise DataError(f"mode = {mode}: there are {count} modes; give 0 to {count - 1}")
    return save(path, _mode(found, mode, frames, cycles), frames)


def draw_modes(found: xr.Dataset, folder: str | Path, ending: str = "png") -> list[Path]:
    """A picture of each mode, or a film (`ending` gif or mp4), in a folder: mode_1.png and so on.

    Raises
    ------
    DataError
        Where pyvista is missing or cannot draw.
    WriteError
        If a file cannot be written.

    Examples
    --------
    >>> import rotorsim as rs
    >>> files = rs.report.draw_modes(rs.analysis.mode_shapes(plant, 300.0, 0.5e6), ".")
    """
    count = found.sizes["mode"]
    return [mode_turntable(found, Path(folder) / f"mode_{k + 1}.{ending}", k) for k in range(count)]


def show_modes(found: xr.Dataset) -> None:
    """A window with all modes side by side, linked to turn together; raises DataError without a display.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.report.show_modes(rs.analysis.mode_shapes(plant, 300.0, 0.5e6))  # doctest: +SKIP
    """
    pv = pyvista()
    shown = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or pv.OFF_SCREEN
    if sys.platform.startswith("linux") and not shown:
        raise DataError("modes: there is no display to open a window on; draw pictures, which need none")
    n = found.sizes["mode"]
    columns = int(np.ceil(np.sqrt(n)))
    plotter = pv.Plotter(shape=(-(-n // columns), columns), window_size=SIZE)
    for k in range(n):
        plotter.subplot(k // columns, k % columns)
        _mode(found, k, 1, 1)(pv, plotter, 0)
    plotter.link_views()
    plotter.show()


def _mode(found: xr.Dataset, mode: int, frames: int, cycles: int) -> Callable[[Any, Any, int], None]:
    """Function that draws frame k of a mode."""
    shape = found["shape_re"].values[mode] + 1j * found["shape_im"].values[mode]
    z, whirl = found["z"].values, str(found["whirl"].values[mode])
    scale, hz = REACH * (z[-1] - z[0]), float(found["wn"][mode]) / (2 * np.pi)
    zeta = float(found["zeta"][mode])
    text = f"mode {mode + 1}: {hz:.2f} Hz, damping ratio {zeta:.4f}, {whirl} at the disc   ({_point(found)})"
    orbits = scale * (shape[:, None] * np.exp(1j * np.linspace(0, 2 * np.pi, 73))[None, :, None]).real

    def draw(pv: Any, plotter: Any, k: int) -> None:
        now = scale * (shape * np.exp(2j * np.pi * cycles * k / frames)).real
        _shaft(pv, plotter, found, now, orbits, COLOURS[whirl], text)
        camera(plotter, (z.mean(), 0.0, 0.0), VIEW * (z[-1] - z[0]), SIDE + 2 * np.pi * k / frames)

    return draw


def whirl_orbits(motion: xr.Dataset, path: str | Path) -> Path:
    """Orbits of the nodes along the whirling shaft, as .gif or .mp4; the first frame alone as .png.

    Parameters
    ----------
    motion : Dataset
        Of `rotorsim.analysis.shaft_motion`; the mean line is taken away, the rest magnified as the text states.
    path : path
        File to write.

    Raises
    ------
    DataError
        Where nothing moves or nothing can be drawn.

    Examples
    --------
    >>> import rotorsim as rs
    >>> motion = rs.analysis.shaft_motion(plant, 300.0, 0.5e6)
    >>> rs.report.whirl_orbits(motion, "whirl.gif").name
    'whirl.gif'
    """
    moved = motion["displacement"].values
    moved = moved - moved.mean(axis=0)
    largest, z = float(np.abs(moved).max()), motion["z"].values
    if not largest:
        raise DataError("whirl orbits: nothing moves; give the machine an unbalance, effects.unbalance")
    scale = REACH * (z[-1] - z[0]) / largest
    closed = scale * np.concatenate([moved, moved[:1]]).transpose(1, 0, 2)
    sense = whirl_sense(moved, float(motion.attrs["speed"]))
    drawn = f"largest displacement {largest * TO_UM:.3g} um, drawn x {scale:.2g}   ({_point(motion)})"
    text = f"{sense} whirl of the shaft: {drawn}"

    def draw(pv: Any, plotter: Any, k: int) -> None:
        _shaft(pv, plotter, motion, scale * moved[k], closed, COLOURS[sense], text)
        camera(plotter, (z.mean(), 0.0, 0.0), VIEW * (z[-1] - z[0]), SIDE)

    return save(path, draw, len(moved))


def whirl_sense(moved: np.ndarray, speed: float) -> str:
    """Sense of the orbits (time, node, 2) by their signed areas, against that of the shaft's speed [rad/s]."""
    x, y = moved[..., 0], moved[..., 1]
    area = np.sign(speed) * np.sum(x * np.roll(y, -1, axis=0) - np.roll(x, -1, axis=0) * y, axis=0)
    seen = area[np.abs(area) > FLAT * np.abs(area).max()]
    if not seen.size:
        return "mixed"
    return "forward" if seen.min() > 0 else "backward" if seen.max() < 0 else "mixed"


def _point(found: xr.Dataset) -> str:
    return f"{found.attrs['speed'] * TO_RPM:.0f} rpm, {found.attrs['pressure'] * TO_MPA:g} MPa"


def _shaft(
    pv: Any, plotter: Any, found: xr.Dataset, now: np.ndarray, orbits: np.ndarray, colour: str, text: str
) -> None:
    """The shaft bent by `now` (node, 2), its line at rest, discs, orbits (node, points, 2) and a caption."""
    z, radius = found["z"].values, found["radius"].values
    plotter.add_mesh(pv.lines_from_points(line(z, 0 * now)), color="#8a949e", line_width=2)
    plotter.add_mesh(tube(pv, z, now, 0.8 * radius), color="#c3ccd4", smooth_shading=True)
    slope = np.gradient(now, z, axis=0)
    for node, r in zip(found["disc_node"].values, found["disc_radius"].values, strict=True):
        plotter.add_mesh(
            pv.Cylinder(center=(z[node], *now[node]), direction=(1.0, *slope[node]), radius=float(r),
                        height=0.03 * (z[-1] - z[0]), resolution=72), color="#9fb0bf", opacity=0.5,
        )  # fmt: skip
    for k in range(len(z)):
        points = np.column_stack([np.full(orbits.shape[1], z[k]), orbits[k]])
        plotter.add_mesh(pv.lines_from_points(points), color=colour, line_width=2)
    heads = pv.PolyData(np.column_stack([z, now]))
    plotter.add_mesh(heads, color=colour, point_size=9, render_points_as_spheres=True)
    plotter.add_text(text, font_size=11, color=INK)


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


RELIEF = 0.7
"""Height of the highest pressure above the journal, as a share of its radius."""
FILM_VIEW = 6.5
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
        camera(plotter, (z.mean(), 0.0, 0.0), FILM_VIEW * max(radius, 0.5 * length), 0.7, 0.45)

    return save(path, draw, len(p))


def _around(pv: Any, z: np.ndarray, theta: np.ndarray, r: np.ndarray) -> Any:
    """A surface of radius r (theta, z) about the shaft's axis."""
    x = np.broadcast_to(z, r.shape)
    y, w = r * np.cos(theta)[:, None], r * np.sin(theta)[:, None]
    return pv.StructuredGrid(x[..., None].copy(), y[..., None], w[..., None])


SIZE = (1280, 720)
RATE = 24
"""Frames a second."""
ENDINGS = (".png", ".gif", ".mp4")
GRAPHICS = ("libEGL.so.1", "libOSMesa.so.8", "libOSMesa.so.6", "libGL.so.1")
"""Libraries with one of which VTK draws on Linux; without any its process ends in a crash."""
INK = "#24303c"
Draw = Callable[[ModuleType, Any, int], None]
"""Puts frame number k into a plotter: draw(pyvista, plotter, k)."""


def lacking() -> str:
    """Sentence about the software that pictures lack; empty without a lack. Nothing is imported."""
    try:
        there = find_spec("pyvista") is not None
    except ValueError:  # an import that is blocked
        there = False
    if not there:
        return "pictures need pyvista; 'pip install pyvista'"
    if sys.platform == "linux" and not any(map(_loads, GRAPHICS)):
        return "pictures need a graphics library, and there is none on this computer; install libegl1 or libosmesa6"
    return ""


def _loads(library: str) -> bool:
    """True if a shared library is there and can be loaded."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def pyvista() -> ModuleType:
    """The package, silent about a missing display; raises DataError with the way out where it is missing."""
    try:
        import pyvista as found
    except ImportError as error:
        raise DataError(lacking() or f"pyvista cannot be imported: {error}") from error
    if sentence := lacking():
        raise DataError(sentence)
    from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)  # it warns that it draws without a display, as is wanted
    return found


def save(path: str | Path, draw: Draw, frames: int, size: tuple[int, int] = SIZE, rate: int = RATE) -> Path:
    """Draw frames into a file: the first as .png, all as .gif or .mp4.

    Raises
    ------
    DataError
        For another ending or no frame, without pyvista or a way to draw or, for .mp4, without the program ffmpeg.
    WriteError
        If the file cannot be written.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise DataError(f"{path}: ends in neither of {', '.join(ENDINGS)}; name e.g. {path.with_suffix('.gif').name}")
    if frames < 1:
        raise DataError(f"frames = {frames}: a film has 1 or more")
    check_program(path)
    pictures = drawn(draw, 1 if ending == ".png" else frames, size, path)
    make = {".png": _png, ".gif": _gif, ".mp4": _mp4}[ending]
    write_bytes(path, make(pictures, rate))
    return path


def check_program(path: Path) -> None:
    """Refuse a film whose program is not installed."""
    if path.suffix.lower() == ".mp4" and shutil.which("ffmpeg") is None:
        raise DataError(f"{path}: needs the program ffmpeg, which is not installed; name a .gif, or install ffmpeg")


def drawn(draw: Draw, frames: int, size: tuple[int, int], path: Path) -> list[np.ndarray]:
    """Images (height, width, 3) of the frames; raises DataError where nothing can be drawn."""
    pv = pyvista()
    try:
        pictures = []
        for k in range(frames):
            plotter = pv.Plotter(off_screen=True, window_size=size)
            plotter.set_background("white")
            draw(pv, plotter, k)
            pictures.append(np.array(plotter.screenshot(return_img=True)))
            plotter.close()
        return pictures
    except (RuntimeError, OSError) as error:
        raise DataError(
            f"{path}: pyvista cannot draw on this computer ({error}); install its graphics libraries (Mesa), or use "
            "the plotly figures of rotorsim.report, which need none"
        ) from error


def _png(pictures: list[np.ndarray], rate: int) -> bytes:
    from PIL import Image

    content = BytesIO()
    Image.fromarray(pictures[0]).save(content, "PNG")
    return content.getvalue()


def _gif(pictures: list[np.ndarray], rate: int) -> bytes:
    """One palette for all frames, so that the film does not flicker."""
    from PIL import Image

    images = [Image.fromarray(one) for one in pictures]
    palette = images[0].quantize(128)
    frames = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in images]
    content = BytesIO()
    frames[0].save(content, "GIF", save_all=True, append_images=frames[1:], duration=round(1000 / rate), loop=0)
    return content.getvalue()


def _mp4(pictures: list[np.ndarray], rate: int) -> bytes:
    import tempfile

    height, width, _ = pictures[0].shape
    with tempfile.TemporaryDirectory() as folder, undoing():
        target = Path(folder) / "film.mp4"
        command = ["ffmpeg", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"]
        command += ["-r", str(rate), "-i", "-", "-pix_fmt", "yuv420p", "-movflags", "+faststart", str(target)]
        ran = subprocess.run(command, input=b"".join(map(_bytes, pictures)), capture_output=True, check=False)
        if ran.returncode or not target.exists():
            reason = ran.stderr.decode(errors="replace").strip().splitlines()
            raise DataError(f"ffmpeg: {reason[-1] if reason else 'wrote no file'}; name a .gif instead")
        return target.read_bytes()


def _bytes(picture: np.ndarray) -> bytes:
    return np.ascontiguousarray(picture, np.uint8).tobytes()


def camera(plotter: Any, centre: Iterable[float], distance: float, turn: float, height: float = 0.35) -> None:
    """Look at `centre` from `distance` [m], turned by `turn` [rad] about the vertical, y upwards."""
    c = np.array(list(centre))
    eye = c + distance * np.array([np.sin(turn), -np.cos(turn), height])
    plotter.camera_position = [tuple(eye), tuple(c), (0.0, 0.0, 1.0)]
