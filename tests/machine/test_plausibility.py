"""Questions about parts that do not fit each other, against moments of inertia of random bodies and geometry."""

import warnings

import numpy as np
import pytest

from rotorsim.base.errors import Unusual
from rotorsim.machine import load_machine, shipped_machines
from rotorsim.machine.plausibility import implausible, questions


@pytest.fixture(scope="module")
def rig():
    return load_machine("dtu_gas_bearing")


def asked(machine):
    """Paths that are asked about."""
    return [path for path, _ in implausible(machine)]


def with_inertia(rig, polar, diametral, mass=1.5):
    """The rig with another disc."""
    values = {
        "polar_inertia": f"{polar!r} kg*m^2",
        "diametral_inertia": f"{diametral!r} kg*m^2",
        "mass": f"{mass!r} kg",
    }
    for name, value in values.items():
        rig = rig.replace(f"discs.0.{name}", value)
    return rig


def test_no_body_of_random_points_is_asked_about_and_what_none_can_have_is(rig):
    rng = np.random.default_rng(7)
    for flat in (1.0, 0.1, 0.0):
        points = rng.normal(size=(50, 3)) * (0.1, 0.1, 0.1 * flat)
        mass = rng.uniform(0.01, 0.05, 50)
        x, y, z = points.T
        polar = float((mass * (x**2 + y**2)).sum())
        diametral = float((mass * ((x**2 + y**2) / 2 + z**2)).sum())
        assert asked(with_inertia(rig, polar, diametral, float(mass.sum()))) == []
        assert asked(with_inertia(rig, 2.05 * diametral, diametral, float(mass.sum()))) == ["discs.0.polar_inertia"]


def test_a_disc_smaller_than_the_shaft_it_stands_on_is_asked_about(rig):
    radius = 0.0118  # of the shaft there
    for factor, paths in ((0.9, ["discs.0.polar_inertia"]), (1.1, [])):
        polar = 1.5 * (factor * radius) ** 2 / 2
        assert asked(with_inertia(rig, polar, polar)) == paths


@pytest.mark.parametrize(
    ("path", "value", "paths"),
    [
        ("bearings.1.diameter", "50 mm", ["bearings.1.diameter"]),
        ("shaft.sections.1.outer_diameter", "30 mm", ["bearings.1.diameter"]),
        ("bearings.1.diameter", "40.5 mm", []),
        ("bearings.1.position", "200 mm", ["bearings.1.diameter"]),  # half on the thin section
        ("discs.0.position", "217 mm", ["discs.0.position"]),
        ("discs.0.position", "216 mm", []),
    ],
)
def test_a_journal_and_a_sleeve_that_do_not_fit_the_shaft_are_asked_about(rig, path, value, paths):
    assert asked(rig.replace(path, value)) == paths


def test_sleeves_that_stand_in_each_other_are_asked_about():
    rotor = load_machine("grooved_turbo_rotor")
    films = [i for i, bearing in enumerate(rotor.bearings) if hasattr(bearing, "clearance")]
    first, second = (rotor.bearings[i] for i in films)
    room = (first.length + second.length) / 2
    for share, paths in ((0.5, [f"bearings.{films[1]}.position"]), (1.0, [])):
        moved = rotor.replace(f"bearings.{films[1]}.position", f"{first.position + share * room!r} m")
        assert [path for path in asked(moved) if path.startswith("bearings") and "position" in path] == paths


def test_a_film_at_another_bearing_is_asked_about(rig):
    (at,) = (i for i, bearing in enumerate(rig.bearings) if not hasattr(bearing, "clearance"))
    film = rig.films[0]
    for share, paths in ((0.9, ["bearings.1.position"]), (1.1, [])):
        moved = rig.replace(f"bearings.{at}.position", f"{film.position - share * film.length!r} m")
        assert [path for path in asked(moved) if path == "bearings.1.position"] == paths


def test_hollows_of_many_clearances_are_asked_about():
    rotor = load_machine("grooved_turbo_rotor")
    (k, film), *_ = [(i, bearing) for i, bearing in enumerate(rotor.bearings) if hasattr(bearing, "clearance")]
    for times, paths in ((21.0, [f"bearings.{k}.grooves.depth"]), (19.0, [])):
        assert asked(rotor.replace(f"bearings.{k}.grooves.depth", f"{times * film.clearance!r} m")) == paths


def test_a_disc_that_reaches_beyond_the_shaft_is_asked_about(rig):
    for share, paths in ((1.1, ["discs.0.diametral_inertia"]), (0.9, [])):
        assert asked(with_inertia(rig, 3e-3, 1.5 * (share * rig.shaft.length) ** 2)) == paths


def test_a_gas_far_below_what_gases_are_is_asked_about(rig):
    assert any(one.startswith("gas.temperature") for one in questions(rig.replace("gas.temperature", "2 K")))


def test_a_probe_inside_a_sleeve_is_asked_about(rig):
    probe = {"name": "X", "angle": "45 deg", "quantity": "relative_displacement"}
    for place, paths in (("0.22 m", ["probes.0.position"]), ("0.3 m", [])):
        text = "\n".join(["[[probes]]", *(f'{k} = "{v}"' for k, v in (probe | {"position": place}).items())])
        assert asked(type(rig).from_text(f"{rig.text}\n{text}\n")) == paths


def test_what_a_file_names_as_meant_is_not_asked_about(rig, tmp_path):
    wide = rig.replace("bearings.1.diameter", "50 mm")
    assert len(questions(wide)) == 1
    (tmp_path / "wide.toml").write_text(wide.text)
    with pytest.warns(Unusual, match="is not the diameter of the shaft in the bearing, '40 mm'"):
        load_machine(tmp_path / "wide.toml")
    (tmp_path / "meant.toml").write_text('unusual = ["bearings.1.diameter"]\n' + wide.text)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_machine(tmp_path / "meant.toml")


def test_no_shipped_machine_is_asked_about():
    names = shipped_machines()
    assert len(names) > 8
    assert all(not asked(load_machine(name)) for name in names)
