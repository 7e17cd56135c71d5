"""Pictures and films of pyvista scenes: one .png, or .gif and .mp4 of several frames, without a window.

A .gif is written by Pillow, which pyvista needs itself; a .mp4 by a program `ffmpeg`, which is not installed with
rotorsim (its licence is that of its codecs).
"""

from __future__ import annotations

import ctypes
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

from rotorsim.base.errors import DataError
from rotorsim.base.files import write_bytes
from rotorsim.base.interrupt import undoing

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
