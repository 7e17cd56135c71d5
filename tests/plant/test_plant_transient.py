"""Time integration against the linear model, its order of convergence, and the cost of a step."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from reynolds.film import thickness
from reynolds.grid import cells
from reynolds.injector import nozzle, nozzle_table
from reynolds.newton import LEFT, chord_flows
from reynolds.transient import GAMMA, MASSES, STAGE, TO_MID, gas_spring
from rotorsim.base.errors import MachineFileError
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.plant.kernels import modal_rotor
from rotorsim.plant.kernels.layout import AT, AT_JOURNAL

RPM = np.pi / 30
SAMPLE = 2e-4


def oscillation(y, start=0.03, stop=0.09, apart=5):
    """Natural frequency [rad/s] and damping ratio of a decaying sinusoid, by linear prediction from samples 1 ms apart.

    The window begins when the next modes (412 Hz, damping ratio .12) have died out.
    """
    y = y[round(start / SAMPLE) : round(stop / SAMPLE)]
    past = np.column_stack([y[apart:-apart], y[: -2 * apart]])
    a, b = np.linalg.lstsq(past, y[2 * apart :], rcond=None)[0]
    roots = np.roots([1, -a, -b])
    s = np.log(roots[roots.imag > 0][0]) / (apart * SAMPLE)
    return abs(s), -s.real / abs(s)


@pytest.mark.parametrize("axis", [0, 1])
def test_free_decay_has_frequency_and_damping_of_the_eigenvalue(rig, held, axis):
    """A blow of 1 N for one sample moves the disc by .14 um, small enough to be linear.

    f within .1 % and zeta within 3e-4 at a step of .2 ms; measured .09-.097 % and 9e-5, all of it the step's, which a
    step of .1 ms divides by four.
    """
    speed, pressure = 0.0, 0.5e6
    for dt, share in ((2e-4, 1.0), (1e-4, 0.3)):
        plant = rig(n_z=16, dt=dt)
        inputs = held(500, speed, pressure)
        inputs[0, 4 + axis] = 1.0
        disc = plant.start(speed, pressure).advance(inputs)[:, axis]
        wn, zeta = oscillation(disc - plant.equilibrium(speed, pressure).disc[axis])
        model = plant.linearise(speed, pressure)  # standing still the lower mode is x, the higher y
        assert wn == pytest.approx(model.wn[axis], rel=1e-3 * share)
        assert zeta == pytest.approx(model.zeta[axis], abs=3e-4 * share)


def set_in(rig, name, inputs):
    """Machine and inputs of something that sets in with a jump."""
    if name == "force":
        inputs[:, 4:] = 10.0, 5.0
        return {}
    if name == "force at speed":
        inputs[5:15, 4:] = 30.0, 20.0
        return {}
    return {"effects.unbalance.me": "6.7 g*mm"}


@pytest.mark.parametrize("jump", ["force", "force at speed", "unbalance"])
def test_trajectories_are_of_second_order_in_time_also_where_forces_jump(rig, held, jump):
    """Steps of .2, .1, .05 ms against .00625 ms: 2.0 +- .15 in the largest error of disc and journal over 40 ms.

    The reference's own error is 1/64 of the finest's; Newton's tolerance 1e-10 is far below all of them.
    """
    speed, pressure = (0.0 if jump == "force" else 628.0), 0.5e6
    inputs = held(200, speed, pressure)
    values = set_in(rig, jump, inputs) | {"solver.tolerance": 1e-10}

    def run(dt):
        return rig(values, dt=dt).start(speed, pressure).advance(inputs)[:, :4]

    exact = run(6.25e-6)
    steps = [2e-4, 1e-4, 5e-5]
    errors = [np.abs(run(dt) - exact).max() for dt in steps]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.15)
    # .6 % of the largest motion is lost at .2 ms
    assert errors[0] < 7e-3 * np.ptp(exact, axis=0).max()


def test_whirl_sets_in_where_an_eigenvalue_crosses_and_the_transient_agrees(rig, held):
    """At .3 MPa: 14.93 krpm here, 14.86 on 128 x 32; the independent calculation has 14.7, and whirl at .47-.49 of it.

    The growth of 0.1 N of push is the eigenvalue's within 1 %: the time step's share of it is .4 %.
    """
    plant, pressure = rig(n_z=16), 0.3e6

    def rightmost(rpm):
        values = plant.linearise(rpm * RPM, pressure).eigenvalues
        return values[values.real.argmax()]

    low, high = 13000.0, 17000.0
    assert rightmost(low).real < 0 < rightmost(high).real
    for _ in range(9):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if rightmost(middle).real < 0 else (low, middle)
    assert low == pytest.approx(14700, rel=0.025)
    assert 0.47 < abs(rightmost(low)) / (low * RPM) < 0.49
    for share in (0.95, 1.05):
        speed = share * low * RPM
        inputs = held(5000, speed, pressure)
        inputs[0, 4:] = 0.1
        away = plant.start(speed, pressure).advance(inputs)[:, :2] - plant.equilibrium(speed, pressure).disc
        peaks = np.hypot(*away.T).reshape(10, 500).max(axis=1)[2:]
        growth = np.polyfit(500 * SAMPLE * np.arange(8), np.log(peaks), 1)[0]
        assert np.sign(growth) == np.sign(share - 1)
        assert growth == pytest.approx(rightmost(share * low).real, rel=0.01)


def test_a_step_on_an_eleven_micron_orbit_is_cheap_and_accurate(rig, held):
    """Gates that no computer's speed enters, at .3 MPa, 6 krpm and steps of .2 ms over a second.

    At most 2.5 Newton iterations a step (measured 2.2), 20 factorisations in 1000 steps (measured none after the
    first) and 5 nm from the trajectory of tolerance 1e-9 (measured .1 nm).
    """
    speed, pressure, samples = 200 * np.pi, 0.3e6, 5000
    inputs = held(samples, speed, pressure)
    tables, counters = [], []
    for tolerance in (5e-6, 1e-9):
        values = {"effects.unbalance.me": "6.7 g*mm", "solver.tolerance": tolerance}
        run = rig(values, n_z=16).start(speed, pressure)
        tables.append(run.advance(inputs)[:, :4])
        counters.append(run.counters)
    assert 10e-6 < 0.5 * np.ptp(tables[0][-500:, 0]) < 12e-6
    assert counters[0]["iterations"] <= 2.5 * samples
    assert counters[0]["factorisations"] <= 20 * samples / 1000
    assert np.abs(tables[0] - tables[1]).max() < 5e-9


@pytest.mark.parametrize(("unbalance", "speed", "pressure"), [(None, 2200.0, 0.3e6), (300, 700.0, 0.1e6)])
def test_stages_far_from_their_starting_values_take_few_corrections_and_factors(rig, held, unbalance, speed, pressure):
    """A whirl and a rub of the rig, steps of .1 ms: at most 3.5 corrections and .7 factorisations a stage.

    Measured 3.1 and 3.0 with .6 each; 3.2 and 3.5 with 1.1 where pressures are extrapolated in place of masses and rows
    are scaled by h^3.
    """
    samples = 1000
    run = rig({"effects.unbalance.me": f"{unbalance} g*mm"} if unbalance else {}, n_z=16, dt=1e-4).start(
        speed, pressure
    )
    inputs = held(samples, speed, pressure)
    inputs[:10, 4] = 20.0  # off an equilibrium that it would not leave
    run.advance(inputs)
    before = run.counters
    table = run.advance(held(samples, speed, pressure))
    assert np.ptp(table[:, 2]) > 40e-6
    assert run.counters["iterations"] - before["iterations"] <= 3.5 * 4 * samples
    assert run.counters["factorisations"] - before["factorisations"] <= 0.7 * 4 * samples


def test_a_rub_at_a_tolerance_of_one_millionth_is_that_of_a_sharp_one(held):
    """Journals of the shipped rig over 100 samples within .05 nm of those at 1e-10: measured .005.

    .65 nm where a correction by a steep chord of an injector's flow, small whatever is left, may end a stage.
    """
    machine = load_machine("dtu_gas_bearing").replace("effects.unbalance.me", "300 g*mm")
    journal, sharp = (
        Plant(machine.replace("solver.tolerance", tolerance), n_theta=32, n_z=16, dt=1e-4)
        .start(700.0, 0.1e6)
        .advance(held(100, 700.0, 0.1e6))[:, 2:4]
        for tolerance in (1e-6, 1e-10)
    )
    assert np.abs(journal - sharp).max() <= 0.05e-9


def test_a_foil_driven_into_its_stop_is_that_of_a_sharp_tolerance(held):
    """800 N for 2 ms press the journal 20 um into the foil's stop: within 1 nm of a run at 1e-8, measured .2.

    120 nm, and twice the corrections, where a contact agrees once its journal rests, though the foil still bends.
    """
    machine = load_machine("foil_turbo_rotor")
    inputs, runs = held(50, 1500.0, 0.0), []
    inputs[20:40, 4] = 800.0
    for tolerance in (1e-5, 1e-8):
        run = Plant(machine.replace("solver.tolerance", tolerance), n_theta=60, n_z=8).start(1500.0, 0.0)
        table = run.advance(inputs)
        assert table[:, AT["h_min"]].min() < -15e-6 and run.counters["substeps"] > 100
        runs.append(table[:, AT_JOURNAL : AT_JOURNAL + 2])
    assert np.abs(runs[0] - runs[1]).max() < 1e-9


def test_a_bounded_step_notes_the_force_by_which_a_foils_contact_is_missed(held):
    """In one sample of a foil driven into its stop the journal moves by less than the tolerance, its foil by more."""
    machine = load_machine("foil_turbo_rotor")
    whole, fast = (
        Plant(machine.with_({"solver.corrections": most}), n_theta=60, n_z=8).start(1500.0, 0.0) for most in (None, 30)
    )
    inputs, left, noted = held(34, 1500.0, 0.0), fast.assembly.film.convergence + LEFT, []
    inputs[20:, 4] = 800.0
    for row in inputs:
        fast.restore(whole.save())
        fast.w[left] = 0.0
        for run in (whole, fast):
            run.advance(row[None])
        noted.append(fast.w[left])
    assert 1.2 * machine.solver.tolerance < min(one for one in noted if one > 0.0) < 1e-4


@pytest.mark.parametrize("most", [20, 50])
def test_a_foil_driven_into_its_stop_in_bounded_steps_stays_physical_and_comes_back(held, most):
    """800 N for 2 ms: .12 s later the orbit is within 5 % and .05 um of one without a bound, measured 2.3 % and .03.

    The journal ran to 1e289 m where foils kept the deflection of corrections that had run away, and to .1 m by friction
    where films are held. Phases differ: contact brakes the shaft.
    """
    machine, inputs, orbits = load_machine("foil_turbo_rotor"), held(1500, 1500.0, 0.0), []
    inputs[:20, 4] = 800.0
    for bound in (None, most):
        run = Plant(machine.with_({"solver.corrections": bound}), n_theta=60, n_z=8).start(1500.0, 0.0)
        pushed = []
        for row in inputs[:300]:
            pushed.append(run.advance(row[None])[0, AT["h_min"]])
            assert min(run.film_pressure(k).min() for k in range(2)) > 0.0
        assert -50e-6 < min(pushed) < -10e-6
        overruns = run.counters["overruns"]
        orbits.append(run.advance(inputs[300:])[-300:, AT_JOURNAL : AT_JOURNAL + 2])
        assert run.counters["overruns"] == overruns and (overruns > 20) == (bound is not None)
    exact, bounded = orbits
    assert np.ptp(bounded, axis=0) == pytest.approx(np.ptp(exact, axis=0), rel=0.05)
    assert bounded.mean(axis=0) == pytest.approx(exact.mean(axis=0), abs=0.05e-6)


def test_masses_are_carried_on_as_parabolas_in_time():
    """Weights of the two stages against a parabola through the masses that a step has: exact to round-off."""
    weights = np.reshape(MASSES, (2, 3, 3))
    for stage, (target, nodes) in enumerate([(GAMMA, (0.0, GAMMA - 1.0, -1.0)), (1.0, (GAMMA, 0.0, -1.0))]):
        for order in range(3):
            powers = np.power.outer(np.array(nodes), np.arange(order + 1.0))
            assert weights[stage, order] @ powers == pytest.approx(target ** np.arange(order + 1.0), abs=1e-14)


def test_the_gas_spring_is_the_slope_of_the_force_at_a_fixed_mass(rig):
    """Against central differences of 1 nm of the force of p h / h(X), on a journal at .4 of the clearance."""
    a = (run := rig(n_z=16).start(300.0, 0.3e6)).assembly
    L, w, F = a.film, run.w.copy(), a.parameters["film_0"]
    w[L.journal : L.journal + 2] = 8e-6, -6e-6
    thickness(w, F, L)
    k = cells(L)
    mass, spring = w[L.p + k] * w[L.h + k], np.array(gas_spring(w, F, L)).reshape(2, 2)
    for axis in range(2):
        forces = []
        for nudge in (1e-9, -1e-9):
            w[L.journal : L.journal + 2] = 8e-6, -6e-6
            w[L.journal + axis] += nudge
            thickness(w, F, L)
            p = mass / w[L.h + k]
            forces.append([(w[side + k] * p).sum() for side in (L.force_x, L.force_y)])
        assert np.subtract(*forces) / 2e-9 == pytest.approx(spring[axis], rel=1e-6)


def test_chords_of_the_flows_lead_to_plena_that_balance_what_they_take_and_give(rig, held):
    """Each chord begins where the last one leads; against a bisection, for films at .98 of what plena had.

    A tangent ends 1.4e-5 of the pressure away and more: the flow goes with the root of the pressures' difference, whose
    slope changes on the way.
    """
    (run := rig(n_z=16).start(300.0, 0.3e6)).advance(held(1, 300.0, 0.3e6))
    L, w, iadt = run.assembly.film, run.w.copy(), 1.0 / (STAGE * run.assembly.parameters["dt"])
    plena, films = (w[at : at + L.n_inj].copy() for at in (L.plenum, L.local_p))
    w[L.border_reader : L.border_reader + L.n_inj * L.n_border] = 0.0
    risen = 0.98 * plena
    w[L.reading : L.reading + L.n_inj] = risen**2 - films**2

    def led():
        return plena - w[L.shift : L.shift + L.n_inj] - w[L.pull_q : L.pull_q + L.n_inj] * (risen**2 - films**2)

    def missing(plenum, i):
        area = w[L.curtain + i] * w[L.local_h + i]
        stored = w[L.capacity + i] * iadt * (plenum - w[L.plenum_rhs + i])
        given = w[L.pin_flow + i] + w[L.pin_p + i] * (plenum - plena[i])
        return stored - given + area * nozzle(plenum, risen[i], nozzle_table(w, L.nozzle))[0]

    balanced = np.array([brentq(missing, 0.5 * p, 2.0 * p, (i,), xtol=1e-9) for i, p in enumerate(plena)])
    assert np.abs(led() / balanced - 1.0).min() > 1e-5
    for _ in range(30):
        chord_flows.py_func(w, L, iadt, L.small, 0.0, 0.0)
    assert led() == pytest.approx(balanced, rel=1e-9)


def one_step(K, C, start, dt):
    """A step of a free rotor of two modes by the kernel's own parts: the state that it reaches, and its error."""
    places = ("q_old", "v_old", "a_old", "q_mid", "v_mid", "q_rhs", "v_rhs", "f", "free", "v", "q", "T", "TK")
    R = SimpleNamespace(n=2, **{name: 2 * k for k, name in enumerate(places[:-1])}, TK=26)
    w, adt = np.zeros(30), STAGE * dt
    T = np.linalg.inv(np.eye(2) + adt * C + adt**2 * K)
    w[R.T : R.TK], w[R.TK :] = T.T.ravel(), adt * (T @ K).T.ravel()
    w[:6] = *start, *(-K @ start[:2] - C @ start[2:])
    for stage in range(2):
        modal_rotor.rotor_rhs.py_func(w, R, stage, adt)
        modal_rotor.free_velocity.py_func(w, R, adt)
        w[R.v : R.q] = w[R.free : R.v]
        w[R.q : R.T] = w[R.q_rhs : R.v_rhs] + adt * w[R.v : R.q]
        if stage == TO_MID:
            modal_rotor.end_rotor_stage.py_func(w, R, stage, adt)
    reached = np.concatenate([w[R.q : R.T], w[R.v : R.q]])
    modal_rotor.embedded_error.py_func(w, R, dt, adt)
    return reached, w[R.f : R.v]


def test_the_error_that_a_step_finds_is_its_own_to_one_order_more():
    """Two damped modes against the matrix exponential: the step's error is of order 3, what it finds misses it by 4."""
    K, C = np.array([[4.0, 1.0], [1.0, 9.0]]), np.array([[0.3, 0.1], [-0.1, 0.2]])
    A, start = np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -C]]), np.array([1.0, -0.5, 0.3, 0.8])
    steps, true, missed = [0.1, 0.05, 0.025], [], []
    for dt in steps:
        reached, found = one_step(K, C, start, dt)
        error = reached - expm(A * dt) @ start
        true.append(np.abs(error).max())
        missed.append(np.abs(found - error).max())
    assert np.polyfit(np.log(steps), np.log(true), 1)[0] == pytest.approx(3.0, abs=0.25)
    assert np.polyfit(np.log(steps), np.log(missed), 1)[0] == pytest.approx(4.0, abs=0.1)
    assert missed[0] < 0.02 * true[0]


def violent(n):
    """Return rows of inputs in which references jump between their limits, the supply jumps, and the disc is hit."""
    rng, t = np.random.default_rng(0), np.arange(n) * 2e-4
    rows = np.zeros((n, 6))
    rows[:, 0] = 600.0
    rows[:, 1] = rng.uniform(0.1e6, 0.7e6, n // 25 + 1).repeat(25)[:n]
    rows[:, 2:4] = 5.0 * np.sign(rng.standard_normal((n // 10 + 1, 2))).repeat(10, 0)[:n]
    rows[:, 4:] = 150.0 * np.stack([np.cos(700 * t), np.sin(700 * t)], axis=1)
    rows[:, 4] += np.where(rng.random(n) < 0.01, 1500.0, 0.0)
    return rows


def bounded(machine, corrections):
    return Plant(machine.with_({"solver.corrections": corrections}), n_theta=16, n_z=8, dt=2e-4)


@pytest.mark.parametrize("most", [20, 30, 50, 100, 1000])
def test_bounded_steps_never_do_more_and_stay_finite(most):
    simulation = bounded(load_machine("dtu_gas_bearing"), most).start(600.0, 0.3e6)
    worst, rows = 0.0, violent(1500)
    rows[:, 4] *= np.where(rows[:, 4] > 1000.0, 5 / 3, 1.0)
    for row in rows:
        before = simulation.counters
        assert np.isfinite(simulation.advance(row[None])).all()
        done = {name: value - before[name] for name, value in simulation.counters.items()}
        worst = max(worst, done["iterations"] + 10 * done["factorisations"])
        assert done["substeps"] == 0
    assert worst == most if most <= 50 else 50 < worst <= most  # it is needed, and kept
    assert simulation.counters["overruns"] > 0


def test_a_bounded_step_whose_corrections_are_no_numbers_holds_the_films_and_the_next_is_solved():
    simulation = bounded(load_machine("dtu_gas_bearing"), 50).start(600.0, 0.3e6)
    layout, rows = simulation.assembly.film, np.tile([600.0, 0.3e6, 0.0, 0.0, 5.0, 0.0], (20, 1))
    simulation.advance(rows)
    simulation.w[layout.h_frozen : layout.h_frozen + layout.length] = np.nan
    assert np.isfinite(simulation.advance(rows[:2])).all()
    assert simulation.counters["overruns"] == 1
    simulation.advance(rows)
    assert simulation.counters["overruns"] == 1


def test_a_bound_that_new_factors_alone_would_reach_is_refused():
    with pytest.raises(MachineFileError, match="corrections"):
        bounded(load_machine("dtu_gas_bearing"), 19)


def test_a_bound_that_no_step_reaches_changes_no_bit():
    rows = violent(300)
    rows[:, 1] += 0.2e6
    rows[:, 2:] *= [0.2, 0.2, 0.0, 0.0]  # far from contact, where steps would become smaller
    machine = load_machine("dtu_gas_bearing")
    tables = [bounded(machine, most).start(600.0, 0.3e6).advance(rows) for most in (None, 1000)]
    assert np.array_equal(*tables)


def test_a_step_cut_short_is_near_the_exact_one():
    machine = load_machine("dtu_gas_bearing")
    exact, fast = (bounded(machine, most).start(600.0, 0.3e6) for most in (None, 30))
    layout, worst = fast.assembly.film, 0.0
    for row in violent(1500):
        fast.restore(exact.save())
        exact.advance(row[None])
        fast.advance(row[None])
        journals = [s.w[layout.journal : layout.journal + 2] for s in (exact, fast)]
        worst = max(worst, float(np.abs(np.subtract(*journals)).max()) / machine.films[0].clearance)
    assert worst < 0.1
