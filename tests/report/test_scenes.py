"""Three-dimensional pictures and films without a window."""

import sys

import numpy as np
import pytest

import rotorsim as rs
from rotorsim.base.errors import DataError
from rotorsim.report import scenes
from rotorsim.report.scenes import whirl_sense

SIZE = (320, 180)


@pytest.fixture(scope="module")
def plant():
    return rs.Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)


@pytest.fixture(scope="module")
def motion(plant):
    return rs.analysis.shaft_motion(plant, 500.0, 0.5e6, settle=0.1, frames=6)


@pytest.fixture
def small(monkeypatch):
    """Small pictures, where pyvista draws on this computer at all."""
    if missing := scenes.lacking():
        pytest.skip(missing)
    monkeypatch.setattr(scenes, "SIZE", SIZE)
    monkeypatch.setattr(scenes.save, "__defaults__", (SIZE, 24))


def test_the_disc_of_a_motion_is_that_of_the_simulation(plant, motion):
    """The shapes of the nodes carry modal displacements exactly."""
    disc = plant.simulate(0.12, 500.0, 0.5e6)["disc"].values
    node = int(motion["disc_node"].values[-1])
    at = round(0.1 / 2e-4) + np.round(motion["time"].values / 2e-4).astype(int)
    np.testing.assert_allclose(motion["displacement"].values[:, node], disc[at], atol=1e-12)


def test_the_pressure_of_a_motion_is_that_of_the_film(plant, motion):
    p = motion["film_pressure"]
    assert p.dims == ("time", "theta", "film_z") and float(p.min()) > 0.9e5 and float(p.max()) < 0.7e6


@pytest.mark.parametrize(
    "given", [{"speed": 0.0}, {"revolutions": 0.0}, {"frames": 0}, {"settle": -1.0}], ids=lambda one: next(iter(one))
)
def test_a_motion_of_no_length_is_refused(plant, given):
    with pytest.raises(DataError, match="give a turning shaft, lengths above 0"):
        rs.analysis.shaft_motion(plant, **({"speed": 500.0, "pressure": 0.5e6} | given))


def test_pictures_show_something_and_films_have_their_frames(plant, motion, small, tmp_path):
    from PIL import Image

    modes = rs.analysis.mode_shapes(plant, 500.0, 0.5e6)
    for path in (
        rs.report.mode_turntable(modes, tmp_path / "mode.gif", frames=4),
        rs.report.whirl_orbits(motion, tmp_path / "whirl.gif"),
        rs.report.film_on_journal(motion, tmp_path / "film.png"),
    ):
        picture = Image.open(path)
        assert picture.size == SIZE and getattr(picture, "n_frames", 1) == {"mode": 4, "whirl": 6, "film": 1}[path.stem]
        assert np.asarray(picture.convert("RGB")).std() > 10


@pytest.mark.parametrize("name", ["mode.bmp", "mode"])
def test_another_ending_is_refused_before_anything_is_drawn(name, tmp_path):
    with pytest.raises(DataError, match=r"ends in neither of \.png, \.gif, \.mp4; name e\.g\. mode\.gif"):
        scenes.save(tmp_path / name, None, 1)


def test_a_film_without_ffmpeg_names_the_gif(monkeypatch, tmp_path):
    monkeypatch.setattr(scenes.shutil, "which", lambda name: None)
    with pytest.raises(DataError, match=r"film\.mp4: needs the program ffmpeg, .* name a \.gif"):
        scenes.save(tmp_path / "film.mp4", None, 1)


def test_without_pyvista_one_sentence_names_it(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(DataError, match=r"need pyvista; 'pip install pyvista'"):
        scenes.save(tmp_path / "film.png", None, 1)


def test_a_computer_without_a_graphics_library_is_named_before_anything_is_drawn(monkeypatch, tmp_path):
    pytest.importorskip("pyvista")
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr(scenes, "GRAPHICS", ("libnone.so.1",))
    with pytest.raises(DataError, match="there is none on this computer; install libegl1 or libosmesa6"):
        scenes.save(tmp_path / "film.png", None, 1)


def test_a_computer_that_cannot_draw_gets_the_way_out(monkeypatch, tmp_path):
    pv = pytest.importorskip("pyvista")
    monkeypatch.setattr(scenes, "lacking", str)

    def refuse(**settings):
        raise RuntimeError("no OpenGL")

    monkeypatch.setattr(pv, "Plotter", refuse)
    with pytest.raises(DataError, match=r"cannot draw on this computer \(no OpenGL\); install its graphics libraries"):
        scenes.save(tmp_path / "film.png", None, 1)


def test_a_mode_or_film_that_is_not_there_is_refused(plant, motion, tmp_path):
    modes = rs.analysis.mode_shapes(plant, 500.0, 0.5e6)
    with pytest.raises(DataError, match=r"mode = 99: there are \d+ modes"):
        rs.report.mode_turntable(modes, tmp_path / "x.png", mode=99)
    with pytest.raises(DataError, match="the machine has no gas film"):
        rs.report.film_on_journal(motion.drop_vars("film_pressure"), tmp_path / "x.png")


def test_a_film_without_frames_is_refused(plant, tmp_path):
    modes = rs.analysis.mode_shapes(plant, 500.0, 0.5e6)
    with pytest.raises(DataError, match="frames = 0: a film has 1 or more"):
        rs.report.mode_turntable(modes, tmp_path / "x.gif", frames=0)


@pytest.mark.parametrize(
    ("turns", "speed", "sense"),
    [
        ((1, 1), 300.0, "forward"),
        ((1, 1), -300.0, "backward"),
        ((-1, -1), 300.0, "backward"),
        ((1, -1), 300.0, "mixed"),
    ],
)
def test_the_sense_of_a_whirl_is_that_of_its_orbits(turns, speed, sense):
    """Ellipses of two nodes, from x to y or back; a third node moves along a line."""
    t = 2 * np.pi * np.arange(24) / 24
    orbits = [np.column_stack([2 * np.cos(t), np.sin(k * t)]) for k in turns] + [np.column_stack([np.cos(t), 0 * t])]
    assert whirl_sense(1e-6 * np.stack(orbits, axis=1), speed) == sense
