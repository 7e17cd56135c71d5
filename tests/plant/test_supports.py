"""Housings under bearings, bearings as tables over the speed, axial force, ball bearings at any place."""

from dataclasses import dataclass

import numpy as np
import pytest

import rotorsim as rs
from fe_shaft.modal import run_modal
from fe_shaft.response import run_unbalance_response
from refusals import refused
from rotorsim.base.errors import MachineFileError
from rotorsim.discrepancy.twin import equip
from rotorsim.effects import REGISTRY, Effect, param
from rotorsim.effects.base import OFF_SHAFT
from rotorsim.plant.locations import acting_places
from rotorsim.plant.mesh import Mesh

ROTOR = """
name = "rotor"
[shaft]
{shaft}
[shaft.material]
density = "7850 kg/m^3"
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[[shaft.sections]]
length = "600 mm"
outer_diameter = "20 mm"
axial_force = "{force} N"
[[discs]]
position = "300 mm"
mass = "4 kg"
polar_inertia = "0.0126 kg*m^2"
diametral_inertia = "0.0065 kg*m^2"
{bearings}
[solver]
modes_per_plane = {modes}
"""
LINEAR = """
[[bearings]]
kind = "linear"
name = "{name}"
position = "{z} mm"
kxx = "10 MN/m"
cxx = "200 N*s/m"
"""
TABLE = """
[[bearings]]
kind = "table"
name = "left"
position = "0 mm"
points = [
    {speed = "0 rad/s", kxx = "10 MN/m", kxy = "1 MN/m", kyx = "-1 MN/m", cxx = "200 N*s/m"},
    {speed = "600 rad/s", kxx = "3 MN/m", kyy = "5 MN/m", cxx = "400 N*s/m"},
]
"""
HOUSING = """
[bearings.support]
mass = "5 kg"
kxx = "20 MN/m"
kyy = "8 MN/m"
cxx = "300 N*s/m"
"""
LEFT, RIGHT = LINEAR.format(name="left", z=0), LINEAR.format(name="right", z=600)
PROBES = "".join(
    f'\n[[probes]]\nname = "{name}"\nangle = "0 deg"\nquantity = "{quantity}"\n{where}\n'
    for name, quantity, where in (
        ("shaft", "absolute_displacement", 'position = "600 mm"'),
        ("gap", "relative_displacement", 'position = "590 mm"\nbearing = "right"'),
        ("rate", "housing_velocity", ""),
        ("shake", "housing_acceleration", 'bearing = "right"'),
    )
)


def machine(bearings, more="", modes=6, force=0, shaft=""):
    return rs.Machine.from_text(ROTOR.format(bearings=bearings, modes=modes, force=force, shaft=shaft) + more)


@pytest.mark.parametrize("speed", [0.0, 250.0, 700.0])
def test_linear_model_has_the_modes_of_the_finite_elements(speed):
    """All modes of the shaft are kept, so that only the eigenvalue solver is left."""
    plant = rs.Plant(machine(TABLE + RIGHT + HOUSING, modes=40))
    expected = np.sort(run_modal(plant.assembly.mesh.rotor, speed).wn)
    assert plant.linearise(speed, 0.0).wn[:8] == pytest.approx(expected[:8], rel=5e-6)


def test_the_few_modes_kept_are_near_them():
    plant = rs.Plant(machine(TABLE + RIGHT + HOUSING))
    expected = np.sort(run_modal(plant.assembly.mesh.rotor, 250.0).wn)
    assert plant.linearise(250.0, 0.0).wn[:6] == pytest.approx(expected[:6], rel=1e-3)


def test_whirl_of_shaft_and_housing_is_that_of_the_finite_elements():
    """Amplitudes 1X of a steady run, read by probes of all kinds, against the solution over frequency."""
    speed, me = 250.0, 1e-4
    more = PROBES + f'\n[effects.unbalance]\nme = "{me} kg*m"\n[effects.gravity]\nacceleration = "9.81 m/s^2"\n'
    damped = (TABLE + RIGHT + HOUSING).replace("MN", "kN").replace('"10 kN', '"900 kN').replace("20 kN", "2 MN")
    plant = rs.Plant(machine(damped.replace("8 kN", "3 MN").replace("00 N*s", "000 N*s"), more, modes=40))
    mesh = plant.assembly.mesh
    whirl = run_unbalance_response(mesh.rotor, mesh.node(0.3), me, 0.0, [speed]).response[:, 0]
    housing = whirl[mesh.rotor.layout.place(len(mesh.nodes))]
    at = mesh.shape_between(0.59)[0] @ np.linalg.pinv(mesh.reduced.Phi) @ whirl[: len(mesh.reduced.Phi)]
    expected = [abs(whirl[4 * mesh.node(0.6)]), abs(at - housing), speed * abs(housing), speed**2 * abs(housing)]
    run = rs.experiments.steady(plant, speed=speed, pressure=0.0, duration=1.5)
    found = [amplitude(run, name) for name in ("shaft", "gap", "rate", "shake")]
    assert found == pytest.approx(expected, rel=2e-3)


def amplitude(run, probe):
    """0-pk of the line at the speed."""
    late = run.isel(time=slice(run.sizes["time"] // 2, None))
    angle = late["angle"].values if "angle" in late else late["rotor_angle"].values
    basis = np.column_stack([np.cos(angle), np.sin(angle), np.ones(len(angle))])
    fit, *_ = np.linalg.lstsq(basis, late["probe_measured"].sel(probe=probe).values, rcond=None)
    return float(np.hypot(*fit[:2]))


def test_a_table_is_the_linear_bearing_of_its_values_at_that_speed():
    """At 300 rad/s, half way, in equilibrium under weight and in its modes."""
    mean = LEFT.replace('kxx = "10 MN/m"', 'kxx = "6.5 MN/m"\nkyy = "7.5 MN/m"\nkxy = "0.5 MN/m"\nkyx = "-0.5 MN/m"')
    mean = mean.replace("200", "300")
    gravity = '\n[effects.gravity]\nacceleration = "9.81 m/s^2"\n'
    plants = [rs.Plant(machine(left + RIGHT, gravity, modes=40)) for left in (TABLE, mean)]
    a, b = (plant.equilibrium(300.0, 0.0).disc for plant in plants)
    assert a == pytest.approx(b, rel=1e-9)
    a, b = (plant.linearise(300.0, 0.0) for plant in plants)
    assert a.wn[:6] == pytest.approx(b.wn[:6], rel=1e-6)
    assert a.zeta[:6] == pytest.approx(b.zeta[:6], rel=1e-4)


def test_a_table_holds_its_ends():
    bearing = machine(TABLE + RIGHT).bearings[0]
    assert np.array_equal(bearing.at(900.0)[0], bearing.at(600.0)[0])
    assert bearing.at(150.0)[0][0, 0] == pytest.approx(8.25e6)


def test_a_film_on_a_housing_is_one_on_a_pedestal():
    """The file's support against the effect of the same resonance: static displacement and first frequencies."""
    rig = rs.load_machine("dtu_gas_bearing")
    mass, frequency = rig.mass / 0.5, 2 * np.pi * 150.0
    housing = rs.machine.Support(
        mass=f"{mass} kg", kxx=f"{mass * frequency**2} N/m", cxx=f"{2 * 0.02 * frequency * mass} N*s/m"
    )
    index = next(i for i, bearing in enumerate(rig.bearings) if hasattr(bearing, "clearance"))
    ours = rs.Plant(rig.with_({f"bearings.{index}.support": housing}))
    pedestal = rs.effects.REGISTRY["pedestal"](mass_ratio=0.5, frequency=frequency, damping_ratio=0.02)
    theirs = rs.Plant(rig.with_({"effects.pedestal": (pedestal,)}))
    a, b = (plant.equilibrium(300.0, 0.4e6) for plant in (ours, theirs))
    assert a.journal == pytest.approx(b.journal, rel=1e-3)
    a, b = (plant.linearise(300.0, 0.4e6) for plant in (ours, theirs))
    assert a.wn[:4] == pytest.approx(b.wn[:4], rel=2e-3)
    assert a.zeta[:4] == pytest.approx(b.zeta[:4], rel=2e-2)


@pytest.mark.parametrize("force", [-1500.0, 5000.0])
def test_an_axial_force_changes_the_frequency_as_that_of_a_beam(force):
    """f = f_0 (1 + P L^2 / (pi^2 E I))^(1/2) of a slender beam on pinned ends, less its small shear and rotation."""
    text = ROTOR.replace("20 mm", "10 mm").format(bearings=LEFT + RIGHT, modes=12, force="{force}", shaft="")
    beam = "\n".join(text[: text.index("[[discs]]")].splitlines()) + (LEFT + RIGHT).replace("10 MN", "100000 MN")
    first, pulled = (
        rs.Plant(rs.Machine.from_text(beam.replace("{force}", str(p)))).linearise(0.0, 0.0).wn[0] for p in (0.0, force)
    )
    inertia = np.pi / 64 * 0.01**4
    assert pulled / first == pytest.approx(np.sqrt(1 + force * 0.6**2 / (np.pi**2 * 210e9 * inertia)), rel=5e-4)


def test_a_shaft_that_buckles_is_refused():
    with refused(MachineFileError, "shaft.sections", -100000):
        rs.Plant(machine(LEFT + RIGHT, force=-100000)).linearise(0.0, 0.0)


def test_thrust_stiffens_a_ball_bearing_by_its_cube_root_wherever_it_is():
    eight = '\n[[effects.ball_bearing]]\nbearing = "right"\nthrust = "800 N"\nrated_thrust = "100 N"\n'
    stiff = RIGHT.replace("10 MN", "20 MN").replace("200", "200")
    a = rs.Plant(machine(LEFT + RIGHT, eight, modes=40)).linearise(100.0, 0.0).wn[:4]
    b = rs.Plant(machine(LEFT + stiff, modes=40)).linearise(100.0, 0.0).wn[:4]
    assert a == pytest.approx(b, rel=1e-4)


def test_clearances_at_both_ends():
    """Two ball bearings with clearance: the rotor hangs by both clearances and the springs."""
    both = "".join(f'\n[[effects.ball_bearing]]\nbearing = "{b}"\nclearance = "20 um"\n' for b in ("left", "right"))
    gravity = '\n[effects.gravity]\nacceleration = "9.81 m/s^2"\n'
    loose, tight = (
        rs.Plant(machine(LEFT + RIGHT, gravity + more, modes=40)).equilibrium(0.0, 0.0).disc for more in (both, "")
    )
    assert tight[1] - loose[1] == pytest.approx(20e-6, rel=1e-3)


def test_a_foundation_that_shakes_shakes_the_housing():
    """At a frequency far above all resonances every mass stays where it is in space."""
    shaken = '\n[effects.base_vibration]\nx = "10 m/s^2"\nfrequency = "50 Hz"\n'
    light = HOUSING.replace("20 MN", "0.001 MN").replace("8 MN", "0.001 MN").replace("300 N", "0 N")
    soft = (LEFT + light + RIGHT + light).replace("10 MN/m", "0.01 MN/m").replace('"200', '"0')
    probes = PROBES.replace('name = "rate"', 'bearing = "right"\nname = "rate"')
    run = rs.experiments.steady(rs.Plant(machine(soft, probes + shaken)), pressure=0.0, duration=2.0)
    motion = run["probe_measured"].sel(probe="shake").values
    # the probe reads the housing in space: much less than the foundation's 10 m/s^2
    assert np.abs(motion).max() < 1.0


WRONG = [
    (TABLE.replace("600 rad/s", "0 rad/s") + RIGHT, r"points\.1\.speed: '0 rpm' is not above the one before"),
    (TABLE.replace('"400 N', '"-400 N') + RIGHT, r"points\.1\.cxx"),
    (TABLE.replace('cxx = "200', 'cxy = "900 N*s/m", cxx = "200') + RIGHT, "the damping is negative in one direction"),
    (TABLE[: TABLE.index('{speed = "600')] + "]\n" + RIGHT, r"points"),
    (LEFT + HOUSING.replace("5 kg", "0 kg") + RIGHT, r"support\.mass"),
    (LEFT + RIGHT + '\n[effects.ball_bearing]\nbearing = "middle"\nclearance = "1 um"\n', "not the name of a bearing"),
    (TABLE + RIGHT + '\n[effects.ball_bearing]\nbearing = "left"\nclearance = "1 um"\n', "not the index of a linear"),
    (LEFT + RIGHT + '\n[effects.ball_bearing]\nthrust = "10 N"\n', "rated_thrust: missing"),
    (
        LEFT + HOUSING + RIGHT + HOUSING + PROBES.replace('bearing = "right"', ""),
        "2 bearings have a housing that moves",
    ),
    (LEFT + RIGHT + PROBES.replace('bearing = "right"', ""), "needs a housing that moves; give its bearing a support"),
]


@pytest.mark.parametrize(("bearings", "sentence"), WRONG)
def test_what_does_not_fit_is_refused(bearings, sentence):
    with pytest.raises(MachineFileError, match=sentence):
        machine(bearings)


def lift(t, angle, speed, acceleration, p):
    return 0.0, p.size


@pytest.mark.parametrize("influence", OFF_SHAFT)
@pytest.mark.parametrize("position", [None, "0 mm", "300 mm"])
def test_an_effect_on_a_housing_is_refused_by_its_name_where_no_housing_moves(monkeypatch, influence, position):
    """The left bearing stands still, the right one has a housing."""

    class Lift(Effect):
        name, port, kernel, place = "lift", "force", lift, "disc"
        size: float = param("N", doc="Size.")
        position: float | None = param("m", default=None, doc="Place.")

    Lift.influence = influence
    monkeypatch.setitem(REGISTRY, "lift", dataclass(frozen=True)(Lift))
    table, at = '\n[effects.lift]\nsize = "1 N"\n', "" if position is None else f'position = "{position}"\n'
    with pytest.raises(MachineFileError) as caught:
        machine(LEFT + RIGHT + HOUSING, table + at)
    [problem] = caught.value.problems
    assert problem.startswith("effects.lift.position: ") and "600 mm" in problem and (position or "") in problem
    held = machine(LEFT + RIGHT + HOUSING, table + 'position = "600 mm"\n')
    assert acting_places(held, held.effects["lift"][0])[0].part == "bearing"
    assert "lift" not in equip(machine(LEFT + RIGHT + HOUSING))[0].effects


@pytest.mark.parametrize("name", ["plain_rotor", "bently_rk4", "pump_on_tables"])
@pytest.mark.parametrize("speed", [0.0, 300.0, -300.0])
def test_a_rotor_without_films_lists_every_oscillation_that_it_keeps(name, speed):
    """Count: the eigenvalues of A of damping ratios below one half, whatever real ones lie far out."""
    found = rs.Plant(rs.load_machine(name)).linearise(speed, 0.0)
    all_of_them = np.linalg.eigvals(found.A)
    size = np.abs(all_of_them)
    kept = np.sort(size[(all_of_them.imag > 1e-6 * size) & (-all_of_them.real < 0.5 * size)])
    assert found.proven and found.wn == pytest.approx(kept, rel=1e-9)


@pytest.mark.parametrize(("length", "stiffness"), [(150, "1 kN/m"), (300, "0.3 kN/m")])
def test_a_stiff_shaft_on_soft_bearings_is_held_whatever_deflections_are_added(length, stiffness):
    """Its lowest mode is that of a rigid body on two springs: sqrt(2 k / m)."""
    stiff = rs.load_machine("plain_rotor").with_(
        {"shaft.sections.0.length": f"{length} mm", "shaft.sections.0.outer_diameter": "40 mm",
         "discs.0.position": f"{length / 2} mm", "bearings.1.position": f"{length} mm",
         "bearings.0.kxx": stiffness, "bearings.1.kxx": stiffness}
    )  # fmt: skip
    rigid = np.sqrt(2e3 * float(stiffness.split()[0]) / stiff.mass)
    for other_bearings in (False, True):
        found = Mesh(stiff, other_bearings).reduced.frequencies
        assert found.min() == pytest.approx(rigid, rel=1e-3)


@pytest.mark.parametrize("other_bearings", [False, True])
def test_a_shaft_on_one_bearing_tilts_and_is_refused(other_bearings):
    with refused(MachineFileError, ""):
        _ = Mesh(machine(LEFT), other_bearings).reduced


RIGID = """
name = "rigid"
[shaft.material]
density = "1000 kg/m^3"
youngs_modulus = "9999 GPa"
poisson_ratio = 0.3
[[shaft.sections]]
length = "400 mm"
outer_diameter = "80 mm"
"""
SPRING = """
[[bearings]]
kind = "linear"
position = "{z} mm"
kxx = "1 MN/m"
mxx = "2 kg"
myy = "3 kg"
"""


def bouncing(text, count):
    """Lowest frequencies [rad/s] in x of the symmetric rotor whose mass moves straight up and down."""
    model = rs.Plant(rs.Machine.from_text(text)).assembly.mesh
    found = run_modal(model.rotor, 0.0)
    straight = [w for w, shape in zip(found.wn, found.shapes.T, strict=True) if even(shape, model)]
    return straight[:count]


def even(shape, mesh):
    """Whether a mode moves both ends alike, in x."""
    a, b = shape[0].real, shape[4 * (len(mesh.nodes) - 1)].real
    return abs(a) > 1e-3 and abs(a - b) < 1e-3 * abs(a)


def test_mass_terms_of_bearings_lower_the_bounce_of_a_rigid_rotor():
    """w^2 = 2 k / (m + 2 m_b): the shaft bends by 1e-4 of the springs' travel."""
    text = RIGID + SPRING.format(z=0) + SPRING.format(z=400)
    mass = rs.Machine.from_text(text).mass
    assert bouncing(text, 1) == pytest.approx([np.sqrt(2e6 / (mass + 4.0))], rel=1e-4)
    assert bouncing(text.replace("mxx", "#"), 1) == pytest.approx([np.sqrt(2e6 / mass)], rel=1e-4)


def test_mass_terms_act_between_shaft_and_housing():
    """Two masses: M = [m/2 + b, -b; -b, h + b], K = [k, -k; -k, k + k_h] of one half of the rotor."""
    support = '[bearings.support]\nmass = "1.5 kg"\nkxx = "3 MN/m"\n'
    text = RIGID + SPRING.format(z=0) + support + SPRING.format(z=400) + support
    half = 0.5 * rs.Machine.from_text(text).mass
    M = np.array([[half + 2.0, -2.0], [-2.0, 3.5]])
    exact = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, np.array([[1e6, -1e6], [-1e6, 4e6]]))))
    assert bouncing(text, 2) == pytest.approx(np.sort(exact), rel=2e-4)


@pytest.mark.parametrize("kind", ["linear", "table"])
def test_mass_terms_reach_the_plant_and_weigh_nothing(kind):
    left = LEFT if kind == "linear" else TABLE
    gravity = '\n[effects.gravity]\nacceleration = "9.81 m/s^2"\n'
    heavy, light = (
        rs.Plant(machine(more + RIGHT, gravity, modes=40))
        for more in (left.replace('name = "left"', 'name = "left"\nmxx = "4 kg"'), left)
    )
    expected = np.sort(run_modal(heavy.assembly.mesh.rotor, 250.0).wn)
    assert heavy.linearise(250.0, 0.0).wn[:6] == pytest.approx(expected[:6], rel=5e-6)
    assert heavy.linearise(250.0, 0.0).wn[0] < light.linearise(250.0, 0.0).wn[0]
    assert heavy.equilibrium(250.0, 0.0).disc == pytest.approx(light.equilibrium(250.0, 0.0).disc, rel=1e-9)
