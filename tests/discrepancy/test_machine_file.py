"""Machine file with the identified effects: loads, holds the evidence, keeps existing content."""

import re
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from rotorsim.discrepancy.calibration import DIRECTIONS, FitParameter, ParameterPoint, contributions, setting
from rotorsim.discrepancy.machine_file import (
    FACTORS_OF,
    NOT_IN_FILE,
    IdentifiedEffect,
    difference,
    total_unbalance,
)
from rotorsim.discrepancy.result import Diagnosis, null_sentence
from rotorsim.discrepancy.twin import FACTORS, Twin
from rotorsim.machine import Machine, load_machine, machine_text
from rotorsim.machine.file_text import remarked
from rotorsim.plant import Plant
from rotorsim.plant.linearise import linearise
from rotorsim.plant.simulation import settle


def found(machine, effects, calibration=None):
    """A diagnosis of these effects, made up: only its way into the file is looked at."""
    gap = xr.Dataset({"gap": (("record", "axis", "stage"), np.zeros((0, 2, 4)))}, {"role": ("record", [])})
    evidence = {"chi2_calibrated": 900.0, "chi2_with_effect": 400.0, "numbers": 420.0, "share_gone": 0.99}
    return Diagnosis(
        "named", load_machine(machine), effects, (), calibration or {}, evidence, "d1",
        localisation=(), unknown={}, gap=gap, notes=(),
    )  # fmt: skip


@pytest.mark.parametrize(
    "one",
    [
        IdentifiedEffect(
            "runout",
            "runout.amplitude_2x",
            {"amplitude_2x": 3e-7, "phase_2x": 1.0},
            {"amplitude_2x": 1e-8},
            ("runout.amplitude_2x",),
        ),
        IdentifiedEffect("hysteresis", "hysteresis.weight", {"weight": 4e-7}, {"weight": 1e-8}, ("hysteresis.weight",)),
        IdentifiedEffect(
            "weak_injector",
            "weak_injector.blocked of injector 2",
            {"blocked": 0.1, "injector": 2.0},
            {"blocked": 0.01},
            ("weak_injector.blocked of injector 2",),
        ),
        IdentifiedEffect("sensor_gain", "sensor_gain.x", {"x": 0.04}, {"x": 0.01}, ("sensor_gain.x",)),
        IdentifiedEffect("dead_zone", "dead_zone.half_width", {"half_width": 2e-7}, {}, ("dead_zone.half_width",)),
        IdentifiedEffect(
            "coupling", "coupling.force_2x", {"force_2x": 3.0, "phase_2x": 0.2, "ellipticity": 0.0}, {}, ("a", "b")
        ),
        IdentifiedEffect(
            "unbalance", "unbalance.me", {"me": 1e-6, "phase": 0.3, "position": 0.2366875}, {}, ("unbalance.me",)
        ),
    ],
    ids=lambda f: f.form,
)
def test_every_kind_of_effect_finds_its_place_in_the_file_of_the_rig(one):
    diagnosis = found("dtu_gas_bearing", (one,))
    after = diagnosis.apply()
    table = after.effects[one.effect][-1]
    for name, value in one.parameters.items():
        assert getattr(table, name) == pytest.approx(value, rel=1e-8)
    before = diagnosis.machine
    for name, own in before.effects.items():
        assert len(after.effects[name]) >= len(own)
    assert "% of the flagged excess gone" in after._source
    assert "found by rotorsim diagnose" in difference(before, after)
    assert "DTU gas bearing rig" in after._source and "# by definition" in after._source  # comments stay


def test_the_calibration_is_written_as_what_the_fit_turned():
    calibration = {
        "curtain_discharge": (0.05, 0.01), "shaft_damping": (-0.1, 0.02), "discharge_drift.0.drift": (0.03, 0.01),
        "plenum_volume.0.change": (0.1, 0.05), "unbalance.1.me~phase.c": (1e-6, 1e-8),
        "unbalance.1.me~phase.s": (1e-6, 1e-8), "offset_x": (1e-6, 1e-9), "actuator_x": (0.02, 0.01),
    }  # fmt: skip
    after = found("dtu_gas_bearing", (), calibration).apply()
    assert after.injection.curtain_discharge == pytest.approx(0.9 * 1.05)
    assert after.shaft.damping_ratio == pytest.approx(0.012 * 0.9)
    assert after.effects["discharge_drift"][0].drift == pytest.approx(0.03)
    # the sum of the file's own unbalance and the change stands in the file's own table
    own = load_machine("dtu_gas_bearing").effects["unbalance"][0]
    total = own.me * np.exp(1j * own.phase) + (1 + 1j) * 1e-6
    (one,) = after.effects["unbalance"]
    assert (one.me, one.phase) == pytest.approx((abs(total), np.angle(total)))
    assert f"before {own.me * 1e6:.9g} g*mm" in after._source
    assert "calibration not written: actuator_x = 0.02" in after._source  # two standard deviations are not clear
    assert "actuator_gain" not in after.effects


def test_a_clear_gain_of_the_actuators_is_written_for_each_pin_of_its_axis_and_makes_the_fitted_machine():
    calibration = {"actuator_x": (-0.08, 0.01), "actuator_y": (0.04, 0.01)}
    after = found("dtu_gas_bearing", (), calibration).apply()
    errors = {one.injector: one.error for one in after.effects["actuator_gain"]}
    assert errors == pytest.approx({2: -0.08, 4: -0.08, 1: 0.04, 3: 0.04})
    assert "+- 0.01" in after._source and "calibration not written" not in after._source
    coarse, speed, pressure = {"grid.n_theta": 16, "grid.n_z": 4}, 400.0, 2e5
    fitted = Twin(load_machine("dtu_gas_bearing"), (16, 4), only=()).set({k: v for k, (v, _) in calibration.items()})
    models = [linearise(a, settle(a, speed, pressure), speed) for a in (fitted, Plant(after.with_(coarse)).assembly)]
    driven, written = (one.transfer(2j * np.pi * 60.0)[:, :2] for one in models)
    assert written == pytest.approx(driven, rel=1e-9)


@pytest.mark.parametrize("key", sorted({*DIRECTIONS, *FACTORS} - {*FACTORS_OF}))
def test_a_number_without_a_place_in_the_file_is_a_comment(key):
    """That a simulation of the file does without the shaft's shear, which changes the gap shown, stands there too."""
    after = found("plain_rotor", (), {key: (-0.5, 0.1)}).apply()
    assert after == load_machine("plain_rotor")
    assert f"calibration not written: {key} = -0.5 +- 0.1" in after._source
    assert (NOT_IN_FILE in after._source) == (key == "shaft_shear")


def test_the_bearings_of_a_plain_rotor_take_their_new_stiffness():
    """The fit turns the compliance: a fifth less of it is a quarter more stiffness."""
    after = found("plain_rotor", (), {"bearing.1.ky": (0.2, 0.1), "bearing.1.kx": (-0.25, 0.1)}).apply()
    assert (after.bearings[1].kxx, after.bearings[1].kyy) == pytest.approx((8e6, 12.5e6))
    assert after.bearings[0].kyy is None


def test_a_damping_that_no_record_narrows_stays_that_of_the_file():
    calibration = {"bearing.1.kx": (-2.0, 0.05), "bearing.1.cx": (0.0, 0.45), "bearing.0.cx": (1.0, 0.05)}
    after = found("plain_rotor", (), calibration).apply()
    before = load_machine("plain_rotor").bearings
    assert after.bearings[1].kxx == pytest.approx(before[1].kxx / 3) and after.bearings[1].cxx == before[1].cxx
    assert after.bearings[0].cxx == pytest.approx(2 * before[0].cxx)
    assert after.bearings[0].cyy == before[0].cxx and after.bearings[0].kyy is None
    assert "calibration not written: bearing.1.cx" in after._source


def test_a_calibration_that_makes_records_worse_is_not_written():
    diagnosis = found("plain_rotor", (), {"bearing.1.kx": (-2.0, 0.05), "unbalance.1.me~phase.c": (1e-6, 1e-8)})
    after = replace(diagnosis, worse=("untouched_1",)).apply()
    assert after == diagnosis.machine != diagnosis.apply()
    assert "calibration not written: it makes untouched records worse (untouched_1)" in after._source


def test_a_number_that_was_fitted_again_does_not_keep_the_comment_of_the_old_one(tmp_path):
    """Remarks on the old numbers go with them; what is fitted has its source and scatter instead."""
    fitted = r'^(damping_ratio = 0\.002|kxx = "10 MN/m"|cxx = "200 N\*s/m").*$'
    text, count = re.subn(fitted, r"\1  # by the supplier", machine_text("plain_rotor"), flags=re.M)
    (tmp_path / "own.toml").write_text(text)
    calibration = {"shaft_damping": (0.5, 0.1), "bearing.0.kx": (0.2, 0.08), "bearing.0.cx": (0.5, 0.2)}
    source = found(tmp_path / "own.toml", (), calibration).apply()._source
    lines = [" ".join(line.split()) for line in source.splitlines()]
    assert "damping_ratio = 0.003 # re-calibrated by rotorsim diagnose, +- 0.0002; before 0.002" in lines
    assert 'kxx = "12.5 MN/m" # re-calibrated by rotorsim diagnose, +- 1.2 MN/m; before 10 MN/m' in lines
    assert 'cxx = "468.75 N*s/m" # re-calibrated by rotorsim diagnose, +- 110 N*s/m; before 200 N*s/m' in lines
    assert lines[0].startswith("# Re-calibrated by rotorsim diagnose with data d1: the values marked so; ")
    assert source.count("# by the supplier") == count - 3


INLINE = """
name = "inline"
shaft = {damping_ratio = 0.01, material = {density = "7850 kg/m^3", youngs_modulus = "210 GPa", poisson_ratio = 0.3}, sections = [{length = "600 mm", outer_diameter = "20 mm"}]}
discs = [{position = "300 mm", mass = "4 kg", polar_inertia = "0.01 kg*m^2", diametral_inertia = "0.006 kg*m^2"}]
bearings = [{kind = "linear", position = "0 mm", kxx = "10 MN/m"}, {kind = "linear", position = "600 mm", kxx = "10 MN/m"}]
effects = {gravity = {acceleration = "9.81 m/s^2"}, unbalance = {me = "25 g*mm"}}
"""  # noqa: E501


def test_a_file_of_inline_tables_takes_calibration_and_effects(tmp_path):
    """There is no room for a comment in braces: one there made a file that no reader takes."""
    (tmp_path / "inline.toml").write_text(INLINE)
    calibration = {"shaft_damping": (0.5, 0.1), "bearing.0.kx": (0.2, 0.08), "unbalance.1.me~phase.c": (1e-6, 1e-8)}
    one = IdentifiedEffect("runout", "runout.amplitude_2x", {"amplitude_2x": 3e-7}, {"amplitude_2x": 1e-8}, ())
    after = found(tmp_path / "inline.toml", (one,), calibration).apply()
    assert after.shaft.damping_ratio == pytest.approx(0.015) and after.bearings[0].kxx == pytest.approx(12.5e6)
    assert after.effects["runout"][0].amplitude_2x == pytest.approx(3e-7) and len(after.effects["unbalance"]) == 1
    assert Machine.from_text(remarked(INLINE, ["shaft.damping_ratio", "bearings.1.kxx"], "calibrated")).mass > 4


def on_tables(folder):
    """Machine file of the plain rotor with its bearings as tables, stiffer at speed, the second without yy."""
    file = folder / "tables.toml"
    text = machine_text("plain_rotor")
    before, _, rest = text.partition("[[bearings]]")
    after = rest[rest.index("\n[effects") :]
    for number, (place, along_y) in enumerate((("0 mm", 'kyy = "{} MN/m"\ncyy = "300 N*s/m"\n'), ("600 mm", ""))):
        before += f'[[bearings]]\nkind = "table"\nname = "T{number}"\nposition = "{place}"\n'
        for speed, k in (("0 rpm", 8), ("4000 rpm", 12)):
            before += f'[[bearings.points]]\nspeed = "{speed}"\nkxx = "{k} MN/m"\ncxx = "200 N*s/m"\n'
            before += along_y.format(k + 1)
    file.write_text(before + after)
    return file


@pytest.mark.parametrize(
    ("machine", "speeds"),
    [("plain_rotor", (240.0, 300.0)), (on_tables, (240.0, 300.0)),
     pytest.param("bently_rk4", (150.0, 190.0), marks=pytest.mark.slow)],
)  # fmt: skip
def test_a_simulation_of_the_new_file_is_the_fitted_one(machine, speeds, tmp_path):
    """Through a resonance, where modulus, damping of the shaft alone, supports and unbalance all count."""
    machine = machine(tmp_path) if callable(machine) else machine
    changes = {
        "shaft_damping": 2.0, "shaft_stiffness": -0.1, "bearing.0.kx": 0.3, "bearing.0.cx": -0.4, "bearing.1.ky": -0.2,
        "bearing.1.cy": 0.6, "unbalance.1.me~phase.c": 2e-6, "unbalance.1.me~phase.s": -3e-6,
    }  # fmt: skip
    if machine == "bently_rk4":
        changes["unbalance.2.me~phase.s"] = 4e-6
    diagnosis = found(machine, (), {key: (value, 0.1) for key, value in changes.items()})
    rows = np.zeros((5000, 6))
    rows[:, 0] = np.linspace(*speeds, 5000)
    before, after = (Twin(m, only=()) for m in (diagnosis.machine, diagnosis.apply()))
    point = ParameterPoint({FitParameter(key, 1.0): value for key, value in changes.items()})
    values = setting(before, contributions(point.values, 0.0, 0.0))
    given, fitted, written = (
        (motion := twin.run(own, rows, 0.0)[:, :2]) - motion.mean(axis=0)
        for twin, own in ((before, {}), (before, values), (after, {}))
    )
    assert np.abs(fitted - given).max() > 0.2 * np.abs(fitted).max()
    # the damping ratio is of the natural frequencies, which the fit's damping does not follow
    assert np.abs(written - fitted).max() < 0.03 * np.abs(fitted).max()


@pytest.mark.parametrize("correlation", [0.0, -0.9])
def test_an_unbalance_that_two_planes_share_is_stated_as_their_sum(correlation):
    """Half of 10 g mm more stands at each of two discs, each as uncertain: the sum is known where they are opposed.

    By hand: the sum is 20 g mm, its variance 2 sd^2 (1 + correlation).
    """
    machine = Machine.from_text(machine_text("foil_turbo_rotor")).with_(
        {"effects.unbalance": {"me": "10 g*mm", "phase": "30 deg", "position": "0 mm"}}
    )
    sd, along = 4e-6, {"c": np.cos(np.pi / 6), "s": np.sin(np.pi / 6)}
    calibration = {
        f"unbalance.{k}.me~phase.{part}": (5e-6 * share, sd) for k in (1, 2) for part, share in along.items()
    }
    related = {f"unbalance.1.me~phase.{part}, unbalance.2.me~phase.{part}": correlation for part in "cs"}
    (total,) = total_unbalance(machine, calibration, related)
    assert (total.value, total.before) == pytest.approx((2e-5, 1e-5), rel=1e-9)
    assert total.sd == pytest.approx(sd * np.sqrt(2 * (1 + correlation)), rel=1e-9)
    assert total.moved == (correlation < 0)


@pytest.mark.parametrize(
    ("name", "null", "words"),
    [
        ("foil_turbo_rotor", {"bearing.0.kx": 0.5, "bearing.0.ky": 0.5, "bearing.1.cx": -0.3, "shaft_stiffness": -0.2},
         "a rise of the stiffness of {0} with a fall of the loss c / k^2 of {1} along x and Young's modulus of the "
         "shaft"),
        ("foil_turbo_rotor", {"shaft_shear": 0.9, "unbalance.1.me~phase.s": 0.4},
         "a change of the softening of the shaft by shear and the unbalance of disc 0 at 0 mm along 90 deg"),
        ("dtu_gas_bearing", {"actuator_x": 0.7, "discharge_drift.0.drift": -0.6, "offset_y": 0.3},
         "a rise of the gain of the actuators along x and the zero of the probes along y with a fall of the drift of "
         "discharge drift 1"),
    ],
)  # fmt: skip
def test_numbers_that_records_do_not_tell_apart_have_the_names_of_the_machine(name, null, words):
    """The calibration's `c` is c / k^2: a loss, which at one damping falls with the square of the stiffness."""
    machine = Machine.from_text(machine_text(name))
    assert null_sentence(null, machine).startswith(words.format(*machine.bearings_in_words) + " leaves these records")
