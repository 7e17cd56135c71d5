"""A force that remembers the motion in the plant: a spring behind dry friction, as a discovered law has it."""

import numpy as np
import pytest

from reynolds.jit import inlined
from rotorsim.discrepancy.discovery import LawTerm, ProposedLaw, load, written
from rotorsim.discrepancy.law_terms import LIBRARY, SLIPPING_SPRING
from rotorsim.effects import REGISTRY, Effect, register
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.plant.linearise import rotor_models
from rotorsim.plant.simulation import matrix, rows, stiffness
from rotorsim.plant.synchronous_orbit import start_on_orbit

STIFFNESS, REACH, HERTZ = 2e5, 2e-6, 20.0


@pytest.fixture(scope="module")
def slider():
    """Return the builder of a rotor without losses that stands, with the spring at its disc, and a step [s]."""
    one = LawTerm(SLIPPING_SPRING, (("reach", REACH),), one=True)
    load(
        written(ProposedLaw("disc 0", (one,), np.ones(1), 0, 0, 0, np.zeros(0), np.ones(1)), {"disc 0": 0.3}, "slider")
    )
    rotor = load_machine("plain_rotor").replace("shaft.damping_ratio", 0.0).replace("effects.unbalance.me", "0 g*mm")
    for bearing in (0, 1):
        rotor = rotor.replace(f"bearings.{bearing}.cxx", "0 N*s/m").replace(f"bearings.{bearing}.cyy", "0 N*s/m")

    def build(reach=REACH, step=1e-4, size=STIFFNESS):
        own = rotor.replace("effects.slider.slipping_spring", f"{size!r} N/m").replace(
            "effects.slider.reach", f"{reach!r} m"
        )
        return Plant(own.with_({"solver.sampling_rate": 1 / step, "solver.time_step": step}))

    yield build
    REGISTRY.pop("slider")


def shaken(plant, periods, force):
    """Rows of a plant at standstill that is shaken along x at `HERTZ`, from rest, and the force (n,) [N]."""
    t = np.arange(round(periods / HERTZ / plant.machine.sampling_time)) * plant.machine.sampling_time
    inputs = np.zeros((len(t), 6))
    inputs[:, 4] = force * np.sin(2 * np.pi * HERTZ * t)
    return plant.start().advance(inputs), inputs[:, 4]


def test_a_spring_behind_dry_friction_takes_the_work_of_its_loop_to_second_order_in_the_step(slider):
    """All that a shaking force gives to a rotor without losses: 4 F (a - F / k) a period, F = k times the reach.

    Samples meet the turns of the motion and of the force by chance: the mean square over forces has an order.
    """
    steps, forces = [1e-3, 5e-4, 2.5e-4, 1.25e-4], np.linspace(4.5, 7.0, 6)
    errors = np.zeros((len(steps), len(forces)))
    for i, step in enumerate(steps):
        plant, n = slider(step=step), round(1 / HERTZ / step)
        for j, size in enumerate(forces):
            table, force = shaken(plant, 40, size)
            x = table[-n - 1 :, 0]
            work = np.sum(force[-n - 1 : -1] * np.diff(x))  # the force is held from sample to sample
            errors[i, j] = work / (4 * STIFFNESS * REACH * (np.ptp(x) / 2 - REACH)) - 1
            assert np.ptp(x) > 10 * REACH
    rms = np.sqrt(np.mean(errors**2, axis=1))
    assert rms[-1] < 5e-5 and np.polyfit(np.log(steps), np.log(rms), 1)[0] > 1.5, rms


def test_below_its_reach_it_is_a_spring_of_its_stiffness_about_where_the_shaft_rests(slider):
    """Weight holds the shaft 20 um lower, where the spring is at ease; the linear model has the spring."""
    stuck, free = slider(reach=1.0), slider(size=0.0)
    a, w = free.assembly, free.start().w
    shape = rows(stuck.assembly, stuck.assembly.calls[-1].shape, w)
    assert stuck.equilibrium().disc == pytest.approx(free.equilibrium().disc, abs=1e-15) and w[a.rotor.q :].any()
    more = stiffness(stuck.assembly, stuck.start().w, 0.0) - matrix(a, a.rotor.K, w)
    assert more == pytest.approx(STIFFNESS * shape.T @ shape, rel=1e-6, abs=1e-3)
    table, force = shaken(stuck, 3, 2.0)
    linear, held = free.start(), STIFFNESS * free.equilibrium().disc
    linear.w[a.rotor.K : a.rotor.K + a.rotor.n**2] += (STIFFNESS * shape.T @ shape).ravel()
    # a force that holds what the spring of the shaft would have of the weight
    linear.w[[a.rotor.disc_fx, a.rotor.disc_fy]] = held
    inputs = np.zeros((len(force), 6))
    inputs[:, 4:] = np.column_stack([force, 0 * force]) + held
    # forces of the motion are met to 1e-11 m in a step
    assert table[:, :2] == pytest.approx(linear.advance(inputs)[:, :2], abs=2e-5 * np.ptp(table[:, 0]))


def test_a_stretch_follows_the_motion_from_step_to_step_up_to_the_reach(slider):
    plant = slider()
    run, stretches, places = plant.start(), [], []
    state = plant.assembly.rig.states + plant.assembly.calls[-1].state
    inputs = np.zeros((1, 6))
    for k in range(600):
        inputs[0, 4:] = 6.0 * np.sin(2 * np.pi * HERTZ * k * 1e-4), 2.0 * np.sin(2 * np.pi * 33.0 * k * 1e-4)
        places.append(run.advance(inputs)[0, :2])
        stretches.append(run.w[state : state + 2].copy())
    places.append(run.advance(inputs)[0, :2])
    z = np.zeros(2)
    for moved, found in zip(np.diff(places, axis=0), stretches, strict=True):
        z = np.clip(z + moved, -REACH, REACH)
        assert found == pytest.approx(z, abs=1e-18)
    assert np.abs(stretches).max() == REACH and np.abs(np.array(stretches)[:, 1]).min() < 0.1 * REACH


def test_a_run_that_is_saved_and_continued_has_the_bits_of_one_that_is_not(slider):
    plant = slider()
    inputs = np.zeros((800, 6))
    inputs[:, 0], inputs[:, 4] = 200.0, 6.0 * np.sin(2 * np.pi * HERTZ * 1e-4 * np.arange(800))
    whole, part = plant.start(200.0), plant.start(200.0)
    table = whole.advance(inputs)
    first, saved = part.advance(inputs[:301]), part.save()
    part.advance(inputs[:100])
    again = plant.start(200.0)
    again.restore(saved)
    assert np.concatenate([first, again.advance(inputs[301:])]).tobytes() == table.tobytes()
    assert again.save().tobytes() == whole.save().tobytes()


def test_without_stiffness_no_bit_depends_on_it(slider):
    table, _ = shaken(slider(size=0.0), 2, 6.0)
    machine = slider().machine
    bare = Plant(machine.with_({"effects": {k: own for k, own in machine.effects.items() if k != "slider"}}))
    assert shaken(bare, 2, 6.0)[0].tobytes() == table.tobytes()


@pytest.mark.parametrize("own", [{"states": 1}, {"keep": inlined(lambda w, state, p: None)},
                                 {"states": 1, "keep": inlined(lambda w, state, p: None), "steady": True}])  # fmt: skip
def test_a_force_of_the_motion_with_states_keeps_them_and_is_not_steady(own):
    force = inlined(lambda t, angle, speed, x, y, vx, vy, p: (0.0, 0.0))
    with pytest.raises(ValueError, match="keep"):
        register(type("Wrong", (Effect,), {"name": "wrong", "port": "motion", "kernel": force, **own}))
    assert "wrong" not in REGISTRY


@pytest.mark.usefixtures("slider")
@pytest.mark.parametrize("reach", ["10 mm", "4 um"])
def test_an_orbit_with_the_spring_is_found_whether_it_sticks_or_slips(reach):
    rotor = load_machine("plain_rotor").replace("effects.slider.slipping_spring", f"{STIFFNESS!r} N/m")
    a, speed = Plant(rotor.replace("effects.slider.reach", reach)).assembly, 200.0
    run = start_on_orbit(a, speed, 0.0)
    turn = round(2 * np.pi / speed / a.sampling_time)
    inputs = np.zeros((20 * turn, 6))
    inputs[:, 0] = speed
    table = run.advance(inputs)[:, :2]
    assert run.on_orbit
    assert np.ptp(table[-turn:], axis=0) == pytest.approx(np.ptp(table[:turn], axis=0), rel=1e-4)


def test_the_linear_model_has_the_damping_next_to_a_memory_and_is_made_at_each_speed():
    loss = LawTerm(next(one for one in LIBRARY if one.name == "damping"), (), one=True)
    zeta = []
    for terms in ([LawTerm(SLIPPING_SPRING, (("reach", REACH),), one=True), loss], [loss]):
        size = np.ones(len(terms))
        law = ProposedLaw("disc 0", tuple(terms), size, 0, 0, 0, np.zeros(0), size)
        load(written(law, {"disc 0": 0.3}, "lossy"))
        rotor = load_machine("plain_rotor").replace("effects.lossy.damping", "50 N*s/m")
        rotor = rotor.replace("effects.lossy.slipping_spring", "1e-3 N/m") if len(terms) > 1 else rotor
        plant = Plant(rotor)
        assert rotor_models(plant.assembly) is None
        zeta.append(plant.linearise(200.0).zeta[:2])
        REGISTRY.pop("lossy")
    assert zeta[0] == pytest.approx(zeta[1], rel=1e-6) and zeta[0].min() > 0.01
