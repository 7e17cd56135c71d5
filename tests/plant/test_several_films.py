"""Machines with several gas films: equilibrium, symmetry, linear model and time steps."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import fsolve

from film_closed_forms import small_eccentricity_stiffness
from rotorsim.analysis import whirl_onset
from rotorsim.base.errors import MachineFileError
from rotorsim.machine import Machine, load_machine, summary
from rotorsim.plant import Plant
from rotorsim.plant.kernels.layout import COLUMNS

FILM = """
[[bearings]]
kind = "gas_film"
position = "{z} mm"
diameter = "40 mm"
length = "40 mm"
clearance = "15 um"
nominal_stiffness = "0.001 N/m"
"""
ORIFICES = """
[[bearings.orifices]]
count = {count}
diameter = "0.2 mm"
offset = "{offset} mm"
"""
SPRING = """
[[bearings]]
kind = "linear"
position = "{z} mm"
kxx = "{k} N/m"
"""


def rigid(films, share, fed=0, extra=""):
    """A rotor hardly bent by its films at `films` [mm], nor held by springs but against tilting; mass times `share`."""
    soft = [f'"bearings.{k}.nominal_stiffness"' for k in range(len(films))]
    parts = [FILM.format(z=z) + (ORIFICES.format(count=fed, offset=0) if fed else "") for z in films]
    parts += [SPRING.format(z=z, k=share) for z in (-110, 110)]
    return Machine.from_text(f"""
name = "rigid"
unusual = ["shaft.material.youngs_modulus", {", ".join(soft)}]
[shaft]
start = "-120 mm"
max_element_length = "60 mm"
[shaft.material]
density = "{5000 * share} kg/m^3"
youngs_modulus = "1000 GPa"
poisson_ratio = 0.3
[[shaft.sections]]
length = "240 mm"
outer_diameter = "60 mm"
[[discs]]
position = "0 mm"
mass = "{share} kg"
polar_inertia = "{4e-4 * share} kg*m^2"
diametral_inertia = "{4e-3 * share} kg*m^2"
{"".join(parts)}
[grid]
n_theta = 16
n_z = 8
[solver]
modes_per_plane = 2
tolerance = 1e-11
[effects.gravity]
acceleration = "9.81 m/s^2"
[effects.unbalance]
me = "{2 * share} g*mm"
{extra}
""")


def moved(machine, force, pressure=0.0, samples=200):
    """Sample table of a run with unbalance in which the disc is pushed along x."""
    simulation = Plant(machine).start(1000.0, pressure)
    rows = np.tile([1000.0, pressure, 0.0, 0.0, 0.0, 0.0], (samples, 1))
    rows[20:30, 4] = force
    return simulation.advance(rows)


@pytest.mark.parametrize(("fed", "pressure"), [pytest.param(0, 0.0, marks=pytest.mark.slow), (4, 0.4e6)])
def test_two_films_moved_alike_are_one_film_with_half_the_rotor(fed, pressure):
    one = moved(rigid((0,), 0.5, fed), 10.0, pressure)
    two = moved(rigid((-60, 60), 1.0, fed), 20.0, pressure)
    assert np.abs(one[:, :4]).max() > 1e-6
    scale = np.abs(one[:, :4]).max()
    # the equilibrium they start from is solved to 3e-10 to 2e-9 of the clearance, by the processor
    np.testing.assert_allclose(two[:, :4], one[:, :4], rtol=0, atol=1e-8 * 15e-6)
    np.testing.assert_allclose(two[100:, :4], one[100:, :4], rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(two[100:, -6:-4], two[100:, 2:4], rtol=0, atol=1e-9 * scale)


def test_two_films_moved_alike_take_the_corrections_of_one():
    """Each film is solved to the tolerance, however many there are: an orbit of 2.4 um."""
    taken = []
    for places, share in (((0,), 0.5), ((-60, 60), 1.0)):
        values = {"solver.tolerance": 5e-6, "effects.unbalance.me": f"{20 * share} g*mm"}
        run = Plant(rigid(places, share, 4).with_(values)).start(1500.0, 0.4e6)
        table = run.advance(np.tile([1500.0, 0.4e6, 0.0, 0.0, 0.0, 0.0], (500, 1)))
        assert np.ptp(table[-100:, 2]) > 4e-6
        taken.append(run.counters["iterations"])
    assert taken[1] == pytest.approx(taken[0], rel=1e-3) and taken[0] > 1.5 * 2 * 500


def test_the_films_carry_the_rotor_together():
    machine = rigid((-60, 30), 1.0, 4)
    rest = Plant(machine).equilibrium(0.0, 0.4e6)
    assert rest.forces[:, 1].sum() == pytest.approx(9.81 * machine.mass, rel=1e-4)
    assert rest.forces[1, 1] > 1.5 * rest.forces[0, 1]  # the near one carries more
    assert rest.mass_flow.shape == (8,)


@pytest.mark.slow
def test_films_with_more_fewer_and_no_orifices_stand_side_by_side():
    text = rigid((-60, 60), 1.0).text
    first, second = text.split("[[bearings]]")[1:3]
    both = text.replace(first, first + ORIFICES.format(count=6, offset=0) + "\n", 1)
    fed = Machine.from_text(both)
    plant = Plant(fed)
    rest = plant.equilibrium(1000.0, 0.4e6)
    assert rest.mass_flow.shape == (6,) and np.all(rest.mass_flow > 0)
    table = plant.start(1000.0, 0.4e6).advance(np.tile([1000.0, 0.4e6, 0, 0, 0, 0], (50, 1)))
    assert np.all(np.isfinite(table))
    more = Machine.from_text(both.replace(second, second + ORIFICES.format(count=2, offset=0) + "\n", 1))
    flows = Plant(more).equilibrium(1000.0, 0.4e6).mass_flow
    assert flows.shape == (8,) and np.all(flows > 0)


def test_the_linear_model_of_two_films_is_that_of_their_motion():
    """A push so small that nothing is nonlinear, by the plant and by the matrix exponential of its linear model."""
    still = rigid((-60, 30), 1.0, 4).replace("effects.unbalance.me", "0 g*mm")
    plant = Plant(still.replace("solver.time_step", "0.02 ms"))
    linear = plant.linearise(1000.0, 0.4e6)
    simulation = plant.start(1000.0, 0.4e6)
    rows = np.tile([1000.0, 0.4e6, 0.0, 0.0, 0.0, 0.0], (60, 1))
    rows[0, 4] = 1e-2
    found = simulation.advance(rows)[:, :2] - plant.equilibrium(1000.0, 0.4e6).disc
    n = len(linear.S)
    held = expm(2e-4 * np.block([[linear.A, linear.B[:, 2:3]], [np.zeros((1, n + 1))]]))
    state, expected = held[:n, n] * 1e-2, []
    for _ in range(59):
        expected.append(linear.C @ state)
        state = held[:n, :n] @ state
    np.testing.assert_allclose(found[1:], expected, rtol=0, atol=2e-3 * np.abs(found).max())


def held(tilt_inertia):
    """The rigid rotor on two films without load, held besides by two springs with dampers 110 mm from its middle."""
    machine = rigid((-60, 60), 1.0).with_({"effects.gravity.acceleration": 0.0, "effects.unbalance.me": 0.0})
    springs = {f"bearings.{k}.{name}": v for k in (2, 3) for name, v in (("kxx", SPRING_K), ("cxx", SPRING_C))}
    return machine.with_(springs | {"discs.0.diametral_inertia": tilt_inertia, "grid.n_theta": 48, "grid.n_z": 16})


SPRING_K, SPRING_C = 1e6, 300.0


def closed_form_onset(machine, mode):
    """Speed and whirl ratio at which two films of small eccentricity leave a forward whirl without damping."""
    rotor = Plant(machine).assembly.mesh.rotor
    z = Plant(machine).assembly.mesh.nodes
    tilt_x, tilt_y = np.zeros((2, 4 * len(z)))
    tilt_x[0::4], tilt_x[3::4], tilt_y[1::4], tilt_y[2::4] = z, 1.0, z, -1.0
    inertia, polar = tilt_x @ rotor.M() @ tilt_x, abs(tilt_y @ rotor.G() @ tilt_x)
    mass, film, spring = (machine.mass, 2.0, 2.0) if mode == "cylindrical" else (inertia, 2 * 0.06**2, 2 * 0.11**2)

    def left(v):
        speed, ratio = v
        w = speed * ratio
        k = film * small_eccentricity_stiffness(0.02, 0.04, 15e-6, speed, ratio) + spring * (
            SPRING_K + 1j * w * SPRING_C
        )
        k -= mass * w**2 - (polar * speed * w if mode == "conical" else 0.0)
        return k.real / 1e6, k.imag / 1e6

    return fsolve(left, (1000.0, 0.47), xtol=1e-12)


@pytest.mark.parametrize(
    ("mode", "tilt_inertia"), [("cylindrical", 4e-3), pytest.param("conical", 0.25, marks=pytest.mark.slow)]
)
def test_the_onset_of_whirl_on_two_films_is_that_of_the_closed_form(mode, tilt_inertia):
    """Half a percent in speed and ratio, and 3 % below and above it a motion that dies away and one that grows."""
    machine = held(tilt_inertia)
    speed, ratio = closed_form_onset(machine, mode)
    found = whirl_onset(Plant(machine), [0.0], highest=1.05 * speed, step=0.05 * speed)
    assert float(found.onset_speed[0]) == pytest.approx(speed, rel=5e-3)
    assert float(found.onset_ratio[0]) == pytest.approx(ratio, rel=5e-3)
    for factor, grows in ((0.97, False), (1.03, True)):
        at = factor * speed
        simulation = Plant(machine.with_({"discs.0.position": 5e-3})).start(at, 0.0)
        rows = np.tile([at, 0.0, 0.0, 0.0, 0.0, 0.0], (2500, 1))
        rows[:5, 4] = 1.0
        size = np.hypot(*simulation.advance(rows)[:, 2:4].T)
        assert (size[2000:].max() > size[1000:1500].max()) == grows


@pytest.mark.slow
def test_a_second_film_beside_that_of_the_rig():
    rig = load_machine("dtu_gas_bearing")
    at = rig.text.index("[gas]")
    text = rig.text[:at] + FILM.format(z=60).replace("15 um", "40 um") + "\n" + rig.text[at:]
    plant = Plant(Machine.from_text(text))
    rest = plant.equilibrium(300.0, 0.5e6)
    assert rest.mass_flow.shape == (4,) and rest.journals.shape == (2, 2)
    record = plant.simulate(0.02, 300.0, 0.5e6, reference=(0.5, 0.0))
    assert record.sizes["injector"] == 4 and record["journals"].dims == ("time", "bearing", "axis")
    np.testing.assert_array_equal(record["journals"][:, 0], record["journal"])
    assert np.all(np.abs(linear := plant.linearise(300.0, 0.5e6).static_gain.diagonal()) > 1e-6), linear


def test_an_effect_names_its_bearing():
    grown = '[effects.clearance_growth]\ngrowth = "1 um"\n{}'
    plain = Plant(rigid((-60, 60), 1.0, 4)).equilibrium(1000.0, 0.4e6)
    both = Plant(rigid((-60, 60), 1.0, 4, grown.format(""))).equilibrium(1000.0, 0.4e6)
    one = Plant(rigid((-60, 60), 1.0, 4, grown.format("bearing = 1"))).equilibrium(1000.0, 0.4e6)
    flows = [rest.mass_flow.reshape(2, 4).sum(axis=1) for rest in (plain, both, one)]
    assert np.all(flows[1] < 0.999 * flows[0])
    assert flows[2][0] == pytest.approx(flows[0][0], rel=1e-2) and flows[2][1] < 0.999 * flows[0][1]


@pytest.mark.slow
def test_laminar_restrictors_let_through_what_the_squared_pressures_make():
    restrictor = 'diameter = "0.2 mm"\nloss_factor = "2e-17 kg/(s*Pa^2)"'
    machine = Machine.from_text(rigid((-60, 60), 1.0, 4).text.replace('diameter = "0.2 mm"', restrictor))
    plant = Plant(machine)
    a, w = plant.assembly, plant.start(1000.0, 0.4e6).w
    plena = np.concatenate([a.film_part(w, k)[a.film.plenum :][:4] for k in (0, 1)])
    supply = 0.4e6 + machine.gas.ambient_pressure
    flows = plant.equilibrium(1000.0, 0.4e6).mass_flow
    assert flows == pytest.approx(2e-17 * (supply**2 - plena**2), rel=1e-7)
    assert machine.gas.ambient_pressure < plena.min() and plena.max() < supply


def test_rows_of_another_law_are_refused():
    restrictor = 'diameter = "0.2 mm"\nloss_factor = "2e-17 kg/(s*Pa^2)"'
    with pytest.raises(MachineFileError, match=r"bearings\.1\.orifices\.0\.loss_factor: missing, unlike before"):
        Machine.from_text(rigid((-60, 60), 1.0, 4).text.replace('diameter = "0.2 mm"', restrictor, 1))


@pytest.mark.parametrize("bearing", [pytest.param(0, marks=pytest.mark.slow), 1])
def test_the_housing_that_a_probe_sees_is_that_of_the_bearing_on_a_pedestal(bearing):
    pedestal = f'[effects.pedestal]\nfrequency = "80 Hz"\nmass_ratio = 0.5\nbearing = {bearing}\n'
    probe = '[[probes]]\nname = "housing"\nquantity = "housing_velocity"\nangle = "0 deg"\n'
    machine = rigid((-60, 60), 1.0, 4, pedestal + probe)
    table = moved(machine, 20.0, 0.4e6)
    column = len(COLUMNS)
    assert np.abs(table[:, column]).max() > 1e-6
    assert "2 gas films" in summary(machine) and "8 orifices" in summary(machine)


@pytest.mark.parametrize(
    ("path", "value", "sentence"),
    [
        ("effects.contact.bearing", 2, "effects.contact.bearing: 2 is not the index of a gas film among the bearings; "
         "write 0 or 1"),
        ("effects.pedestal.frequency", "400 Hz", "effects.pedestal.bearing: missing, and there are several films; "
         "write 0 or 1"),
        ("effects.weak_injector.injector", 5, "effects.weak_injector.injector: 5 is none of the machine's injectors; "
         "write 1 to 4"),
        ("bearings.0.orifices.0.offset", "25 mm", "bearings.0.orifices.0.offset: '25 mm' puts the orifice outside"),
        ("bearings.0.orifices.0.count", 2.5, "bearings.0.orifices.0.count: 2.5 is not a whole number"),
        ("bearings.0.orifices.0.pocket_diameter", "0.1 mm", "'0.1 mm' is below the orifice's '0.2 mm'; widen it"),
        ("bearings.1.position", "-60 mm", "bearings"),
        ("bearings.1.clearance", "5 mm", "bearings.1.clearance: '5 mm'"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_in_a_sentence(path, value, sentence):
    with pytest.raises(MachineFileError) as caught:
        rigid((-60, 60), 1.0, 4).replace(path, value)
    assert sentence in str(caught.value)
