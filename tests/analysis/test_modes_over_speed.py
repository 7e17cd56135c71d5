"""Modes and critical speeds over the speed against a direct search at every speed, on seeded and shipped machines."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

import rotorsim as rs
from compare_modes import SHIPPED, agrees as all_equal, compared
from direct_search import all_eigenvalues, counted, crossings
from mirror import mirrored
from random_machines import COUNT, random_machine
from rotorsim.analysis import campbell, map_machine, mode_shapes
from rotorsim.analysis.calibrate import figures
from rotorsim.analysis.campbell import highest_speed, modes_line, searched_line
from rotorsim.analysis.modes_over_speed import at_whirl, modes_over_speed
from rotorsim.analysis.whirl_onset import onset_beyond, stability_limit, why_open
from rotorsim.machine import shipped_machines
from rotorsim.plant import Plant
from rotorsim.plant.film_response import FilmResponse
from rotorsim.plant.linearise import LinearPlant, linearise, region_up_to, rotor_models
from rotorsim.plant.simulation import settle

RPM = np.pi / 30
QUICK = (33, 45, 53, 7, 141)
"""Machines on tables: criticals up and down, soft at rest and unstable, crossing stiffnesses, a pair between nodes."""
EXACT = 1e-6


def found_criticals(plant, low, high, count=20, modes=8, pressure=0.0):
    """Rows (speed, damping ratio, direction) of 1X between two speeds, and the number of unproven speeds."""
    found = campbell(plant, np.linspace(low, high, count), pressure, modes)
    return of_order(found, 1, low, high), found


def of_order(found, order, low, high):
    """Rows of one order between two speeds."""
    columns = ("critical_speed", "critical_zeta", "critical_direction")
    rows = np.column_stack([found[name].values[found["critical_order"].values == order] for name in columns])
    inside = (np.abs(rows[:, 0]) >= min(abs(low), abs(high))) & (np.abs(rows[:, 0]) <= max(abs(low), abs(high)))
    return rows[inside]


def agrees(rows, direct):
    """The same crossings to 1e-6; those at the ends of the range or of the region may be in one of the two alone."""
    assert len(rows) == len(direct), (rows, direct)
    order = np.argsort(rows[:, 0]), np.argsort(direct[:, 0])
    assert rows[order[0], 0] == pytest.approx(direct[order[1], 0], rel=EXACT)
    assert rows[order[0], 1] == pytest.approx(direct[order[1], 1], abs=1e-5)
    assert (rows[order[0], 2] == direct[order[1], 2]).all()


def check_against_direct_search(number, orders=(1,)):
    machine, top = random_machine(number)
    plant = Plant(machine)
    low = top / 20
    rows, found = found_criticals(plant, low, top)
    for order in orders:
        direct = crossings(lambda speed: all_eigenvalues(plant, speed), low, top, order)
        agrees(of_order(found, order, low, top), direct)
    assert found.attrs["nodes_proven"] == found.attrs["nodes"] and not len(found.attrs["not_certain"])
    refused = np.reshape(found.attrs["not_looked_at"], (-1, 2))
    for speed, missing in zip(found["speed"].values, found["missing"].values, strict=True):
        assert missing == 0 or (np.isnan(missing) and any(a <= speed <= b for a, b in refused))
    return machine, plant, low, top, rows


@pytest.mark.parametrize("number", QUICK)
def test_critical_speeds_are_those_of_a_direct_search(number):
    check_against_direct_search(number, orders=(1, 2) if number == QUICK[0] else (1,))


@pytest.mark.slow
def test_critical_speeds_of_a_self_acting_rotor_are_roots_and_their_number_is_that_of_a_count_at_the_ends():
    """All eigenvalues at each critical speed, and at both ends, where no mode is near the border of the region."""
    machine, top = random_machine(2)
    plant, low = Plant(machine), top / 2
    found = campbell(plant, [low, top], modes=4)
    assert found.attrs["nodes_proven"] == found.attrs["nodes"] and not len(found.attrs["not_certain"])
    rows = of_order(found, 1, low, top)
    for speed in rows[:, 0]:
        assert np.abs(np.abs(all_eigenvalues(plant, speed)) / speed - 1).min() < EXACT
    spectra = [(v, all_eigenvalues(plant, v)) for v in (low, top)]
    below = [np.sum((np.abs(s) < v) & (-s.real < 0.5 * np.abs(s))) for v, s in spectra]
    assert -rows[:, 2].sum() == below[1] - below[0]


@pytest.mark.slow
def test_the_degree_of_the_determinant_tells_a_critical_speed_that_is_left_out():
    machine, top = random_machine(2)
    plant = Plant(machine)
    rows, _ = found_criticals(plant, top / 20, top)
    rows = rows[(rows[:, 0] > top / 20) & (rows[:, 0] < top)]
    assert counted(plant, top / 20, top, rows) == []
    for k in range(len(rows)):
        assert len(counted(plant, top / 20, top, np.delete(rows, k, axis=0))) == 1


def test_the_seeded_machines_hold_what_is_hard():
    """Speeds at which a natural frequency rises above the speed, and falls below it; damping lost."""
    rows = np.concatenate([found_criticals(Plant(m), top / 20, top)[0] for m, top in map(random_machine, QUICK)])
    assert (rows[:, 2] == 1).sum() >= 3 and (rows[:, 2] == -1).sum() >= 8 and (rows[:, 1] < 0).any()


@pytest.mark.parametrize("number", QUICK[:2])
def test_critical_speeds_do_not_depend_on_what_is_shown_or_on_the_grid(number):
    machine, top = random_machine(number)
    plant = Plant(machine)
    rows, _ = found_criticals(plant, top / 20, top)
    for count, modes in ((10, 8), (80, 8), (20, 4), (20, 16)):
        other, _ = found_criticals(plant, top / 20, top, count, modes)
        assert other == pytest.approx(rows, rel=EXACT)


@pytest.mark.parametrize("number", QUICK[:2])
def test_critical_speeds_of_the_mirror_image_are_mirrored(number):
    machine, top = random_machine(number)
    rows, found = found_criticals(Plant(machine), top / 20, top)
    other, back = found_criticals(Plant(mirrored(machine)), -top, -top / 20)
    assert np.sort(-other[:, 0]) == pytest.approx(np.sort(rows[:, 0]), rel=EXACT)
    by_speed, by_mirror = np.argsort(rows[:, 0]), np.argsort(-other[:, 0])
    assert (rows[by_speed, 2] == other[by_mirror, 2]).all()
    one, two = (f["critical_whirl"].values[f["critical_order"].values == 1] for f in (found, back))
    assert sorted(one) == sorted(two)


@pytest.mark.nightly
@pytest.mark.parametrize("number", range(COUNT))
def test_every_seeded_machine_has_the_critical_speeds_of_a_direct_search(number):
    """Also for 4 and 16 modes, 10 and 80 speeds, and for the mirror image."""
    machine, top = random_machine(number)
    row = compared(machine, top / 20, top)
    assert all_equal(row), row


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
def test_critical_speeds_of_shipped_machines_are_those_of_a_direct_search(name):
    pressure, low, high = SHIPPED[name]
    row = compared(name, low * RPM, high * RPM, pressure, cells=32)
    assert all_equal(row), row


STEP = """
name = "stiffened between 3000 and 4000 rpm"
[shaft]
start = "0 mm"
damping_ratio = 0.01
[shaft.material]
density = "7850 kg/m^3"
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[[shaft.sections]]
length = "400 mm"
outer_diameter = "30 mm"
[[discs]]
position = "200 mm"
mass = "20 kg"
polar_inertia = "0.1 kg*m^2"
diametral_inertia = "0.05 kg*m^2"
"""
TABLE = """
[[bearings]]
kind = "table"
position = "{z} mm"
points = [
    {{speed = "0 rpm", kxx = "0.4 MN/m", cxx = "100 N*s/m"}},
    {{speed = "3000 rpm", kxx = "0.4 MN/m", cxx = "100 N*s/m"}},
    {{speed = "4000 rpm", kxx = "20 MN/m", cxx = "100 N*s/m"}},
    {{speed = "9000 rpm", kxx = "20 MN/m", cxx = "100 N*s/m"}},
]
"""


@pytest.fixture(scope="module")
def stiffened():
    return Plant(rs.machine.Machine.from_text(STEP + TABLE.format(z=0) + TABLE.format(z=400)))


def test_a_bearing_that_stiffens_makes_critical_speeds_in_both_directions_and_none_is_safe(stiffened):
    """A map that ends below the crossings beyond its range, and one with a single speed, know of them too."""
    rows, _ = found_criticals(stiffened, 500 * RPM, 8000 * RPM)
    assert set(rows[:, 2]) == {-1.0, 1.0} and len(rows) >= 3
    for speed in rows[rows[:, 1] < 0.2, 0]:
        for grid in ([0.99 * speed], [0.5 * speed, 0.87 * speed], [1.1 * speed, 1.2 * speed]):
            safe = map_machine(stiffened, grid, [0.0], workers=1)["safe"].values[0]
            assert safe[np.abs(np.array(grid) / speed - 1) < 0.149].max() == 0


def test_the_floor_of_the_region_lies_below_every_searched_order_line_whatever_is_shown(stiffened):
    """Speeds of 1 to 10 rad/s, of modes up to 20,000 rad/s."""
    floors = {campbell(stiffened, [1.0, 5.0, 10.0], modes=count).attrs["region_floor"] for count in (1, 16)}
    assert len(floors) == 1 and max(floors) < 1.0 / 1.15
    from_rest = campbell(stiffened, [0.0, 1000.0])
    assert from_rest.attrs["searched_from"] == from_rest.attrs["region_floor"]


def test_a_mode_that_grows_is_said_however_few_are_shown():
    """The second mode of the machine grows."""
    machine, top = random_machine(141)
    found = [campbell(Plant(machine), np.linspace(top / 20, top, 9), modes=count) for count in (1, 8)]
    assert found[0]["zeta"].min() > 0 > found[1]["zeta"].min()
    assert found[0].attrs["warnings"] == found[1].attrs["warnings"] and "grows" in found[0].attrs["warnings"]


def test_speeds_within_15_percent_of_the_critical_speeds_of_the_file_are_not_safe():
    """Bently's RK4 amplifies 2.9 and 3.0 times at 4004 and 4066 rpm, its third and fourth crossing."""
    found = map_machine(Plant("bently_rk4"), np.array([3000, 4000, 4250, 5000]) * RPM, [0.0], workers=1)
    assert found["safe"].values.tolist() == [[1, 0, 0, 1]]
    assert found["critical_speed"].values[0] / RPM == pytest.approx([4003.9, 4066.3], rel=1e-4)


@pytest.mark.slow
def test_the_grooved_rotor_is_not_safe_one_percent_from_its_mode():
    """At 80,000 rpm, between the critical speeds of 78,774 and 89,145 rpm."""
    found = map_machine(Plant("grooved_turbo_rotor"), [70e3 * RPM, 80e3 * RPM], [0.0], workers=1)
    assert found["safe"].values[0, 1] == 0


def test_what_carries_on_a_part_of_the_margin_alone_is_not_known():
    """A self-acting rotor just above the speed that lifts it."""
    plant = Plant("rigid_rotor_self_acting", n_theta=24, n_z=8)
    known = modes_over_speed(plant, [10.0, 60.0], 0.0, orders=(1,)).refused
    edge = max(high for _, high in known)
    safe = map_machine(plant, [1.05 * edge, 2 * edge], [0.0], workers=1)["safe"].values[0]
    assert np.isnan(safe[0]) and safe[1] == 1


def test_what_is_not_among_the_listed_modes_is_named(rig):
    """Every eigenvalue of the region is listed, or its frequency is in `not_listed`."""
    plant = rig()
    found = mode_shapes(plant, 300.0, 0.5e6)
    region = region_up_to(plant.assembly.mesh.reduced.frequencies, highest_speed(plant))
    s = all_eigenvalues(plant, 300.0, 0.5e6)
    s = s[region.holds(s)]
    listed = found["wn"].values[found["zeta"].values < 0.5]
    listed = listed[listed < region.reach]
    assert np.sort([*listed, *found.attrs["not_listed"]]) == pytest.approx(np.sort(np.abs(s)), rel=1e-6)
    assert found.attrs["zeta_least"] == pytest.approx((-s.real / np.abs(s)).min(), rel=1e-6)


@pytest.mark.parametrize(
    ("name", "n_theta", "pressure"), [("dtu_gas_bearing", 32, 0.5e6), ("rigid_rotor_self_acting", 24, 0.0)]
)
def test_a_linear_model_lists_every_mode_of_its_region_and_states_that_it_does(name, n_theta, pressure):
    """Seven and more of them, some far from the first natural frequency."""
    plant, rpm = Plant(name, n_theta=n_theta, n_z=8), 60e3
    model = plant.linearise(rpm * RPM, pressure)
    s = all_eigenvalues(plant, rpm * RPM, pressure)
    s = s[model.region.holds(s)]
    assert model.proven and len(s) >= 7
    listed = model.eigenvalues[model.region.holds(model.eigenvalues)]
    assert np.sort_complex(listed) == pytest.approx(np.sort_complex(s), rel=1e-6)


def test_modes_that_are_not_counted_are_no_figures_of_a_calibration(rig, monkeypatch):
    plant = rig()
    assert np.isfinite(figures(plant, 300.0, 0.5e6)["wn_x"])
    monkeypatch.setattr(LinearPlant, "proven", False)
    found = figures(plant, 300.0, 0.5e6)
    assert np.isnan([found[f"{what}_{axis}"] for what in ("wn", "zeta") for axis in "xy"]).all()
    assert np.isfinite(found["gain_xx"])


def test_the_whirl_of_equal_frequencies_at_rest_is_mixed_in_every_answer():
    """A round rotor at rest: any orbit in the plane is a mode, whichever the eigenvalue solver returns."""
    plant = Plant("plain_rotor")
    found = campbell(plant, [0.0, 100.0], modes=4)
    assert set(found["whirl"].values[:, 0]) == {"mixed"} == set(plant.linearise(0.0).whirl[:4])
    assert sorted(found["whirl"].values[:, 1]) == ["backward", "backward", "forward", "forward"]


def test_fewer_modes_than_asked_for_and_no_critical_speed_are_stated():
    found = campbell(Plant("plain_rotor"), [0.0, 6.0], modes=60)
    assert found.sizes["branch"] < 60 and "fewer than the 60 asked for" in modes_line(found)
    assert found.sizes["critical"] == 0 and "no critical speed" in searched_line(found)
    damped = int(np.nanmax(found["damped"].values))
    assert (f"at least {damped}" in modes_line(found)) == (damped > 0)


@pytest.mark.parametrize("number", [0, 8], ids=["plain", "foil"])
def test_the_factors_of_a_film_are_those_of_its_whole_matrix(number):
    """Solutions to round-off; the determinant over its diagonal, and the stiffness that its elimination leaves."""
    machine, top = random_machine(number)
    film = Plant(machine).linearise(0.5 * top, 0.0).film
    response, rng, whole = FilmResponse(film), np.random.default_rng(0), film.J.toarray()
    at, logs = top * np.array([0.0, 0.3j, 0.4j - 0.2, 0.1, 0.5j]), []
    together, b = response.factors(at), rng.standard_normal((2, len(whole), len(at)))
    columns = b[0] + 1j * b[1]
    for k, s in enumerate(at):
        A, alone = whole + s * np.diag(film.S), response.factors(at[[k]])
        for adjoint, matrix in ((False, A), (True, A.conj().T)):
            x = alone.solve(columns, adjoint)
            np.testing.assert_allclose(matrix @ x, columns, atol=1e-9 * np.abs(matrix).max() * np.abs(x).max())
            np.testing.assert_allclose(together.solve(columns, adjoint)[:, k], x[:, k], atol=1e-12 * np.abs(x).max())
        phase, size = np.linalg.slogdet(A)
        own = np.log(np.abs(np.diag(whole)) + s * film.S + 0j).sum()
        logs.append(alone.log[0] + own - (size + 1j * np.angle(phase)))
        Z = film.F_y @ np.linalg.solve(A, film.J_X + s * film.S_X)
        for found in (alone.Z[0], together.Z[k]):
            np.testing.assert_allclose(found, Z, atol=1e-9 * np.abs(Z).max())
    apart = np.array(logs) - logs[0]
    assert np.abs(np.exp(apart) - 1).max() < 1e-6


def test_zeros_and_parts_that_a_matrix_of_a_film_holds_do_not_change_its_determinant():
    """A zero that is stored in every corner, and each term as two halves."""
    machine, top = random_machine(0)
    film = Plant(machine).linearise(0.5 * top, 0.0).film
    J, s = film.J.tocoo(), np.array([0.3j * top])
    n = J.shape[0] - 1
    data = np.concatenate([0.5 * J.data, 0.5 * J.data, np.zeros(4)])
    rows, columns = np.concatenate([J.row, J.row, [0, 0, n, n]]), np.concatenate([J.col, J.col, [0, n, 0, n]])
    order, starts = np.argsort(rows, kind="stable"), np.append(0, np.bincount(rows).cumsum())
    stored = sparse.csr_matrix((data[order], columns[order], starts), J.shape)
    found, own = (FilmResponse(replace(film, J=J)).factors(s) for J in (stored, film.J))
    np.testing.assert_array_equal(found.log, own.log)
    np.testing.assert_array_equal(found.Z, own.Z)


SPRING = 4e6
"""Stiffness of each bearing at rest [N/m]."""
FREQUENCIES = 2 * np.pi * np.union1d(np.geomspace(0.5, 400.0, 60), np.linspace(40.0, 47.0, 300))
"""Whirl frequencies [rad/s] of its table, dense about the first pair of modes."""


def on_maxwell(k1: float, tau: float):
    """The shipped rotor on springs with a Maxwell element each, k1 s tau / (1 + s tau), as tables over the whirl."""
    machine = rs.load_machine("plain_rotor")
    wt = (FREQUENCIES * tau) ** 2
    K, C = SPRING + k1 * wt / (1 + wt), k1 * tau / (1 + wt)
    points = [
        {"speed": "0 rpm", "whirl_frequency": f"{w} rad/s", "kxx": f"{k} N/m", "cxx": f"{c} N*s/m"}
        for w, k, c in zip(FREQUENCIES, K, C, strict=True)
    ]
    tables = [
        rs.machine.TableBearing(kind="table", position=f"{b.position} m", points=points) for b in machine.bearings
    ]
    changes = {f"bearings.{k}": one for k, one in enumerate(tables)} | {"shaft.damping_ratio": 0.0}
    return Plant(machine.with_(changes))


def augmented(plant, speed: float, k1: float, tau: float) -> np.ndarray:
    """Eigenvalues of the rotor with a state for the force of each Maxwell element: f + tau f' = k1 tau v."""
    model, mesh = plant.linearise(speed, 0.0), plant.assembly.mesh
    rotor, m = model.rotor, len(model.rotor.stiffness)
    rows = np.vstack([mesh.between(k) for k in mesh.whirling])
    K, C = rotor.stiffness.copy(), rotor.damping.copy()
    for k, table in mesh.whirling.items():
        own = mesh.between(k)
        (held, lost), spring = table.at(speed), SPRING * np.eye(2)
        K, C = K + own.T @ (spring - held) @ own, C - own.T @ lost @ own
    eye, none = np.eye(m), np.zeros((m, len(rows)))
    A = np.block([[0 * eye, eye, none], [-K, -C, -rows.T], [none.T, k1 * rows, -np.eye(len(rows)) / tau]])
    s = np.linalg.eigvals(A)
    return s[s.imag > 1e-6 * np.abs(s)]


def test_modes_on_maxwell_elements_are_those_of_the_augmented_system_to_second_order_in_their_damping():
    """The first pair at 250 rad/s of a shaft without damping, damped by .2 % at most: coefficients of a steady whirl
    hold for one that decays up to zeta^2, times a number near 1."""
    errors, damping = [], []
    for k1 in (0.8e6, 0.4e6, 0.2e6):
        plant = on_maxwell(k1, 5e-3)
        found = rs.analysis.campbell(plant, [0.0, 250.0], modes=2).isel(speed=1)
        exact, zeta = augmented(plant, 250.0, k1, 5e-3), found["zeta"].values
        own = found["wn"].values * (-zeta + 1j * np.sqrt(1 - zeta**2))
        errors.append([np.abs(exact - s).min() / abs(s) for s in own])
        damping.append(zeta)
    orders = np.diff(np.log(errors), axis=0) / np.diff(np.log(damping), axis=0)
    assert orders == pytest.approx(2.0, abs=0.02)
    assert np.max(errors / np.square(damping)) < 2.0 and np.max(damping) < 2e-3


def on_both_axes(last: float = 1000.0):
    """The shipped rotor on tables K = K0 + a v + b w + c v w over two speeds v and whirl frequencies w to the last."""
    machine = rs.load_machine("plain_rotor")
    points = [
        {"speed": f"{v} rad/s", "whirl_frequency": f"{w} rad/s", "kxx": f"{1e6 + 1e3 * v + 2e3 * w + 10 * v * w} N/m",
         "kxy": f"{1e4 + 5 * v * w} N/m", "cxx": f"{10 + 0.01 * v * w} N*s/m"}
        for v in (100.0, 500.0) for w in (50.0, 300.0, last)
    ]  # fmt: skip
    tables = [
        rs.machine.TableBearing(kind="table", position=f"{b.position} m", points=points) for b in machine.bearings
    ]
    return Plant(machine.with_({f"bearings.{k}": one for k, one in enumerate(tables)}))


@pytest.mark.parametrize("speed", [200.0, 400.0, 800.0, -400.0])
def test_tables_over_speed_and_whirl_frequency_hold_at_both(speed):
    """At their own frequency to rounding, between speeds and above the last one too; at 1X by chords of c v^2."""
    plant = on_both_axes()
    mesh, model = plant.assembly.mesh, plant.linearise(speed, 0.0)
    for frequency in (150.0, 700.0):
        found = at_whirl(plant, model, frequency).rotor.stiffness - mesh.reduced.K
        rows = {k: mesh.between(k) for k in mesh.whirling}
        exact = sum(rows[k].T @ t.at(speed, frequency)[0] @ rows[k] for k, t in mesh.whirling.items())
        assert found == pytest.approx(exact, abs=1e-9 * np.abs(exact).max())
    (table, *_) = mesh.whirling.values()
    widest = np.diff(table.speeds[table.speeds <= 500.0]).max()
    off = np.abs(mesh.tables.at(0, speed)[0] - table.at(speed)[0]).max()
    assert off <= 1.001 * 10 * widest**2 / 4


OVER_SPEED = {"whirl": lambda: on_maxwell(1.6e6, 5e-3), "both": on_both_axes, "both, far": lambda: on_both_axes(4e3)}
OVER_SPEED |= {name: lambda name=name: Plant(name) for name in shipped_machines() if not rs.load_machine(name).films}


@pytest.mark.parametrize("name", list(OVER_SPEED))
def test_a_model_between_those_of_two_speeds_is_the_direct_one(name):
    """On the kinks of the tables, between and beyond them: to rounding."""
    plant = OVER_SPEED[name]()
    a, kinks = plant.assembly, np.unique([0.0, *plant.assembly.mesh.tables.speeds, 1e3])
    assert rotor_models(a) is not None
    for speed in (*kinks, *(0.37 * kinks[:-1] + 0.63 * kinks[1:]), *(kinks[-1] * np.array([1.2, 2.3, 7.0]))):
        model, direct = plant.linearise(speed), linearise(a, settle(a, speed, 0.0), speed)
        for one in ("stiffness", "damping"):
            found, own = getattr(model.rotor, one), getattr(direct.rotor, one)
            np.testing.assert_allclose(found, own, rtol=1e-12, atol=1e-12 * np.abs(own).max())


def test_an_onset_on_a_table_over_the_whirl_frequency_is_stated_not_to_be_looked_for():
    """Along the synchronous line no mode grows, which is not the answer: a mode has a damping at its own frequency."""
    plant = on_both_axes()
    onset, _, looked = stability_limit(plant, 0.0, 500.0)
    assert np.isnan(onset) and not looked
    assert onset_beyond(plant, 100.0, [0.0]).endswith(why_open(plant))
    assert why_open(plant) != why_open(Plant("plain_rotor"))


def test_a_table_over_the_whirl_frequency_has_the_critical_speeds_and_the_response_of_its_synchronous_one():
    """At 1X both are the same machine: K(w) and C(w) at w = the speed are a table over the speed."""
    plant = on_maxwell(1.6e6, 5e-3)
    (table, *_) = plant.assembly.mesh.whirling.values()
    points = [
        {"speed": f"{v} rad/s", "kxx": f"{K[0, 0]} N/m", "cxx": f"{C[0, 0]} N*s/m"}
        for v, (K, C) in ((v, table.at(v)) for v in table.speeds)
    ]
    same = [
        rs.machine.TableBearing(kind="table", position=f"{b.position} m", points=points) for b in plant.machine.bearings
    ]
    other = Plant(plant.machine.with_({f"bearings.{k}": one for k, one in enumerate(same)}))
    speeds = np.linspace(100.0, 400.0, 5)
    a, b = (rs.analysis.unbalance_response(one, speeds, 0.0)["major"].values for one in (plant, other))
    assert a == pytest.approx(b, rel=1e-9)
    a, b = (rs.analysis.critical_speeds(one, [0.0], (1,), 400.0)["critical_speed"].values for one in (plant, other))
    assert a == pytest.approx(b, rel=1e-9, nan_ok=True) and np.isfinite(a).any()
