"""Settings of the live rig: same effect on the plant as in a machine file; none ends the rig."""

import re
from dataclasses import replace

import numpy as np
import pytest
import tomlkit

from coarse_rig import RPM, coarse, make_rig
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.live.laws import read_laws
from rotorsim.live.rig import SCATTER, Rig
from rotorsim.live.settings import equip, update_derived, with_value
from rotorsim.machine import Machine
from rotorsim.plant import Plant
from rotorsim.plant.assemble import assemble
from rotorsim.plant.kernels.injectors import TABLE
from rotorsim.plant.kernels.layout import AT
from rotorsim.plant.simulation import Simulation


def fresh(changes=()):
    """Rows of a plant that was built with these values from the start: 0.1 s at 3 krpm and 0.3 MPa."""
    machine = equip(coarse())
    for path, value in changes:
        machine = machine.replace(path, value)
    inputs = np.zeros((500, 6))
    inputs[:, 0], inputs[:, 1] = 3000 * RPM, 0.3e6
    return Plant(machine).start(3000 * RPM, 0.3e6).advance(inputs)


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("unbalance.me", 12e-6, "12 g*mm"),
        ("clearance_growth.growth", -2e-6, "-2 um"),
        ("plenum_volume.change", 1.5, 1.5),
        ("noise.sigma", 1e-6, "1 um"),
        *(
            pytest.param(*more, marks=pytest.mark.slow)
            for more in (
                ("pedestal.mass_ratio", 0.3, 0.3),
                ("gas_heating.rise", 20.0, "20 K"),
                ("journal_tilt.x", 1e-4, "1e-4 rad"),
                ("broadband_force.density", 0.01, "0.01 N^2/Hz"),
                ("speed_wander.sd", 0.01, 0.01),
            )
        ),
    ],
)
def test_a_slider_does_what_the_machine_file_would_do_bit_for_bit(key, value, text):
    rig = make_rig(speed=3000 * RPM)
    rig.set(key, value)
    rig.reset()
    rows = np.concatenate([rig.advance(200), rig.advance(300)])
    assert rows[:, :-6].tobytes() == fresh([(f"effects.{key}", text)]).tobytes()


@pytest.mark.parametrize("bearing", [1, 2])
def test_a_slower_amplifier_is_that_of_a_plant_built_with_it_whichever_film_its_pin_feeds(bearing):
    """Weights of the amplifiers' lag: pins of a second film have their numbers behind those of the first."""
    text = tomlkit.parse(coarse().text)
    if bearing == 2:
        text["bearings"].insert(1, text["bearings"][1].unwrap() | {"position": "60 mm"})
    text["injection"]["bearing"] = bearing
    text["effects"] = {"gravity": {"acceleration": "9.81 m/s^2"}, "amplifier_lag": {"injector": 2}}
    machine = Machine.from_text(tomlkit.dumps(text))
    built = assemble(machine.with_({"effects.amplifier_lag.change": 3.0}))
    tables = []
    for a in (assemble(machine), built):
        simulation = Simulation.at_equilibrium(a, 0.0, 0.3e6)
        at = slice(a.rig.table, a.rig.table + TABLE * a.rig.n_inj)
        tables.append((a, simulation.w, at, simulation.w[at].copy()))
    (a, w, at, before), (_, _, _, wanted) = tables
    a.record["amplifier_lag_0"]["change"] = 3.0
    update_derived(a, w)
    assert w[at] == pytest.approx(wanted, rel=1e-14, abs=0)
    assert np.flatnonzero(wanted != before).tolist() == [TABLE * (a.film.n_inj * (bearing - 1) + 1) + k for k in (0, 1)]


def test_the_set_speed_stays_where_it_is_while_the_shaft_wanders_about_it():
    """However the samples are cut into frames: the ramp goes on from the set speed, not from the shaft's."""
    rig = make_rig(speed=3000 * RPM)
    rig.set("speed_wander.sd", 0.01)
    rig.set("speed_wander.time", 0.05)
    rows = np.concatenate([rig.advance(samples) for samples in (100, 7, 200, 193)])
    assert np.all(rows[:, -6] == 3000 * RPM)
    assert 0.003 < np.abs(rows[1:, AT["speed"]] / (3000 * RPM) - 1).max() < 0.04
    assert np.abs(np.diff(rows[1:, AT["speed"]])).max() < 5 * 0.01 * 3000 * RPM * 2e-4 / 0.05


def test_a_slider_that_is_put_back_leaves_every_bit_as_it_was():
    rig = make_rig(speed=3000 * RPM)
    for key, value in (("pedestal.mass_ratio", 0.5), ("plenum_volume.change", 3.0), ("rub.stiffness", 1e6)):
        rig.set(key, value)
        rig.set(key, 0.0)
    rig.reset()
    assert rig.advance(500)[:, :-6].tobytes() == fresh().tobytes()


def test_every_number_of_every_effect_reaches_the_parameter_record():
    rig = make_rig()
    for key, control in rig.settings.sliders.items():
        before, message = rig.in_force()[key], rig.sentences
        value = control.value(0.05)
        rig.set(key, value)
        taken = rig.in_force()[key]
        assert taken == rig.settings.numbers[key] or rig.sentences > message
        rig.set(key, before)
        assert rig.in_force()[key] == before


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("pressure", 9e6, "pressure: 9 MPa is beyond 0 MPa to 1 MPa, set to 1 MPa"),
        ("speed", "fast", "speed: 'fast' is not a number"),
        ("speed", float("nan"), "is not a number"),
        ("warp", 1.0, "'warp': is not a setting of this rig"),
        ("pace", "9x", "pace: '9x' is none of its positions"),
        ("controller", "unknown", "controller: 'unknown' is none of its positions; they are off, P, hinf"),
        ("journal_tilt.x", 2e-3, "the film is closed|closes|gap|clearance"),
        ("weak_injector.injector", 60.0, "injector: 60 is beyond 1 to 4, set to 4"),
    ],
)
def test_what_cannot_be_set_is_reported_and_the_plant_runs_on(key, value, sentence):

    rig = make_rig()
    rig.set(key, value)
    assert re.search(sentence, rig.messages[-1][1]), rig.messages[-1]
    assert len(rig.advance(20)) == 20


@pytest.mark.parametrize(("sense", "sign"), [("forward", 1.0), ("backward", -1.0)])
def test_a_torque_accelerates_the_rotor_by_newtons_law(sense, sign):
    rig = make_rig(drive="torque", torque=2.0, pressure=0.6e6, sense=sense)
    rig.advance(2500)
    P = rig.assembly.P
    asked = (2.0 - P.dry_drag) / P.inertia * 0.5
    assert rig.speed == pytest.approx(sign * asked, rel=0.02)
    rig.set("drive", "coast")
    before = sign * rig.speed
    rig.advance(500)
    assert 0 < sign * rig.speed < before


def test_the_sense_turns_the_rotor_backward():
    rig = make_rig(speed=1000 * RPM, sense="backward")
    assert rig.speed == pytest.approx(-1000 * RPM)
    assert len(rig.advance(100)) == 100


@pytest.mark.slow
def test_without_air_the_journal_touches_and_the_lamp_lights_and_air_lifts_it_again():
    fine = coarse().with_({"grid.n_theta": 32, "grid.n_z": 16})
    rig = Rig(fine, read_laws([]))  # on 16 x 8 some states of a film of .25 um in contact have no solution
    rig.set("pressure", 0.0)
    for _ in range(50):
        rig.advance(50)
    assert rig.history.last(100)[:, AT["contact"]].max() == 1.0
    rig.set("pressure", 0.6e6)
    for _ in range(100):
        rig.advance(50)
    assert not rig.stopped and rig.history.last(100)[:, AT["contact"]].max() == 0.0


def test_a_step_without_solution_stops_the_plant_and_a_reset_brings_it_back():
    rig = make_rig()
    rig.set("impulse", 0.2)
    rig.settings.numbers["impulse"] = 1e7
    rig.strike(1)
    for _ in range(20):
        rig.advance(50)
    assert rig.stopped and "reset" in rig.messages[-1][1]
    assert len(rig.advance(50)) == 0
    rig.reset()
    assert not rig.stopped and len(rig.advance(50)) == 50


def test_noise_off_silences_the_sensors_and_keeps_the_setting():
    rig = make_rig(noise="off")
    assert all(rig.in_force()[key] == 0.0 for key in SCATTER)
    rig.set("noise", "on")
    assert rig.in_force()["noise.sigma"] == rig.settings.numbers["noise.sigma"] > 0


@pytest.mark.parametrize("turned", [False, True])
def test_values_that_fit_only_together_are_set_in_any_order(turned):
    values = {"gravity.acceleration": 0.0, "crack.loss": 0.0}
    rig = make_rig(**{"crack.loss": 1e6})
    rig.put_all(dict(sorted(values.items(), reverse=turned)))
    assert not rig.messages
    assert (rig.in_force()["gravity.acceleration"], rig.in_force()["crack.loss"]) == (0.0, 0.0)


def test_values_that_a_machine_file_refuses_together_are_refused_here():
    rig = make_rig(**{"crack.loss": 1e6})
    rig.put_all({"gravity.acceleration": 0.0, "rub.friction": 0.2})
    assert len(rig.messages) == 1
    assert rig.messages[0][1].startswith("crack: the weight opens and closes a crack, but there is none")
    assert (rig.in_force()["gravity.acceleration"], rig.in_force()["rub.friction"]) == (9.81, 0.2)
    assert len(rig.advance(20)) == 20


def test_a_machine_file_with_an_error_names_the_field(tmp_path):
    with pytest.raises(MachineFileError, match=r"effects\.unbalance\.me"):
        coarse().replace("effects.unbalance.me", "20 g")


def test_a_value_that_does_not_fit_is_one_sentence_with_the_sliders_name():
    machine = equip(coarse())
    with pytest.raises(DataError, match=r"^unbalance\.me: .* is above the limit; write at most '10000 g\*mm'$"):
        with_value(machine, "unbalance.me", 1e9)
    cracked = machine.with_({"effects.crack": (replace(machine.effects["crack"][0], loss=1e6),) * 2})
    with pytest.raises(DataError, match=r"^crack: the weight opens and closes a crack, but there is none[^\n]+$"):
        with_value(cracked, "gravity.acceleration", 0.0)
