"""Rotors as they are built: cones, materials and layers along the shaft, discs on arms, point masses."""

import json

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import iv, jv, kv, yv

import rotorsim as rs
from fe_shaft.elements import deflection
from fe_shaft.modal import oscillations, run_modal
from fe_shaft.response import run_static
from mirror import mirrored
from rotorsim.__main__ import main
from rotorsim.base.errors import MachineFileError
from rotorsim.machine.file_text import with_value
from rotorsim.machine.limits import first_passed, largest_radius
from rotorsim.machine.plausibility import questions
from rotorsim.plant.locations import place_at
from rotorsim.plant.mesh import Mesh
from rotorsim.report.machine_sketch import machine_sketch

STEEL = """
density = "7850 kg/m^3"
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
"""
TITANIUM = """
density = "4430 kg/m^3"
youngs_modulus = "114 GPa"
poisson_ratio = 0.34
"""
ENDS = """
[[bearings]]
kind = "linear"
position = "40 mm"
kxx = "10 MN/m"
kyy = "14 MN/m"
cxx = "300 N*s/m"
[[bearings]]
kind = "linear"
position = "400 mm"
kxx = "12 MN/m"
cxx = "200 N*s/m"
"""
TURBO = f"""
name = "turbo rotor"
[shaft]
max_element_length = "20 mm"
[shaft.material]{STEEL}
[[shaft.sections]]
length = "200 mm"
outer_diameter = "20 mm"
outer_diameter_right = "30 mm"
[[shaft.sections]]
length = "200 mm"
outer_diameter = "30 mm"
inner_diameter = "6 mm"
[shaft.sections.material]{TITANIUM}
[[shaft.sections]]
length = "100 mm"
outer_diameter = "30 mm"
outer_diameter_right = "15 mm"
[[shaft.layers]]
name = "magnets"
position = "230 mm"
length = "100 mm"
inner_diameter = "30 mm"
outer_diameter = "40 mm"
carries = "mass"
[[shaft.layers]]
name = "sleeve"
position = "230 mm"
length = "100 mm"
inner_diameter = "40 mm"
outer_diameter = "44 mm"
[shaft.layers.material]{TITANIUM}
[[discs]]
name = "impeller"
position = "530 mm"
seat = "490 mm"
mass = "0.8 kg"
polar_inertia = "8e-4 kg*m^2"
diametral_inertia = "5e-4 kg*m^2"
[[discs]]
name = "coupling half"
position = "0 mm"
mass = "0.3 kg"
polar_inertia = "1e-4 kg*m^2"
diametral_inertia = "6e-5 kg*m^2"
[[point_masses]]
position = "150 mm"
mass = "50 g"
{ENDS}
[effects.gravity]
acceleration = "9.81 m/s^2"
[effects.unbalance]
me = "5 g*mm"
"""


@pytest.fixture(scope="module")
def turbo():
    return rs.machine.Machine.from_text(TURBO)


def test_a_cone_of_equal_diameters_has_the_bits_of_the_cylinder():
    plain = rs.load_machine("plain_rotor")
    cone = plain.replace("shaft.sections.0.outer_diameter_right", "20 mm")
    cone = cone.replace("shaft.sections.0.inner_diameter_right", "0 mm")
    one, other = Mesh(plain), Mesh(cone)
    for matrix in ("K", "C", "G", "Phi", "participation"):
        assert np.array_equal(getattr(one.reduced, matrix), getattr(other.reduced, matrix))
    assert (one.polar_inertia, plain.mass) == (other.polar_inertia, cone.mass)


def test_frequencies_of_a_cone_converge_with_the_square_of_the_element():
    """A cone of 20 to 60 mm on two springs, against 128 elements; the diameters are exact at every point."""
    text = f"""name = "cone"
    [shaft]
    max_element_length = "1 m"
    [shaft.material]{STEEL}
    [[shaft.sections]]
    length = "320 mm"
    outer_diameter = "20 mm"
    outer_diameter_right = "60 mm"
    [[bearings]]
    kind = "linear"
    position = "0 mm"
    kxx = "20 MN/m"
    [[bearings]]
    kind = "linear"
    position = "320 mm"
    kxx = "20 MN/m"
    """
    cone = rs.machine.Machine.from_text(text)

    def wn(elements):
        return run_modal(Mesh(cone.with_({"shaft.max_element_length": 0.32 / elements})).rotor, 0.0).wn[[0, 2, 4]]

    fine = wn(256)
    sizes = np.array([8, 16, 32])
    errors = np.array([wn(n) / fine - 1 for n in sizes])
    orders = -np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0]
    assert orders == pytest.approx([2.0] * 3, abs=0.15)


def test_mass_inertia_and_weight_are_those_of_frustum_ring_and_disc(turbo):
    """Frustum: pi L (a^2 + a b + b^2) / 12, and rho pi L (a^5 - b^5) / (160 (a - b)) about the axis."""

    def frustum(a, b, L):
        return np.pi * L * (a**2 + a * b + b**2) / 12, np.pi * L * (a**5 - b**5) / (160 * (a - b))

    def ring(inner, outer, L):
        return np.pi * L * (outer**2 - inner**2) / 4, np.pi * L * (outer**4 - inner**4) / 32

    pieces = [
        (7850.0, frustum(0.02, 0.03, 0.2)), (4430.0, ring(0.006, 0.03, 0.2)), (7850.0, frustum(0.03, 0.015, 0.1)),
        (7850.0, ring(0.03, 0.04, 0.1)), (4430.0, ring(0.04, 0.044, 0.1)),
    ]  # fmt: skip
    mass, polar = (sum(rho * values[k] for rho, values in pieces) for k in range(2))
    mesh = Mesh(turbo)
    assert turbo.shaft.mass == pytest.approx(mass, rel=1e-12)
    assert turbo.mass == pytest.approx(mass + 1.15, rel=1e-12)
    assert mesh.polar_inertia == pytest.approx(polar + 9e-4, rel=1e-12)
    assert mesh.rotor.mass == pytest.approx(turbo.mass, rel=1e-9)
    carried = run_static(mesh.rotor, 9.81).bearing_forces
    assert carried[:, 1].sum() == pytest.approx(9.81 * turbo.mass, rel=1e-7)


def test_an_unbalance_at_the_impeller_acts_at_the_end_of_its_arm(turbo):
    """x at the centre of gravity is x + a beta of the seat, y is y - a alpha: force and moment on the shaft."""
    mesh = Mesh(turbo)
    effect = turbo.effects["unbalance"][0]
    assert mesh.place(effect) == pytest.approx(0.53)
    node = mesh.node(0.49)
    x, y, alpha, beta = mesh.reduced.Phi[4 * node : 4 * node + 4]
    assert mesh.influence(effect) == pytest.approx(np.array([x + 0.04 * beta, y - 0.04 * alpha]), rel=1e-12)
    named = rs.analysis.unbalance_response(rs.Plant(turbo), np.linspace(100.0, 800.0, 3))
    assert list(named["place"].values[1:3]) == ["impeller", "coupling half"]


def test_a_film_and_a_probe_under_a_cup_stay_on_the_shaft():
    """The journal's rows change with the centre of gravity as smoothly through the bearing as next to it."""
    text = rs.load_machine("aerostatic_spindle").text

    def mesh(z):
        cup = f"""[[discs]]
position = "{z} mm"
seat = "240 mm"
mass = "0.2 kg"
polar_inertia = "1e-4 kg*m^2"
diametral_inertia = "1e-4 kg*m^2"
[[discs]]"""
        spindle = rs.machine.Machine.from_text(text.replace("[[discs]]", cup, 1))
        return Mesh(spindle.replace("probe.position", "190 mm"))

    over, bearing = mesh(190), 0.19
    on_shaft = over.reduced.shape(over.node(bearing))
    assert np.array_equal(over.between(1), on_shaft)
    assert np.array_equal(over.shape(over.probe), on_shaft)
    sizes = [(mesh(z).between(1) ** 2).sum(axis=1) for z in (190, 190.001)]
    assert sizes[0] == pytest.approx(sizes[1], rel=1e-4)
    effect = over.machine.effects["unbalance"][0]
    assert np.abs(over.influence(effect) - on_shaft).max() > 0.1
    assert over.influence(effect) == pytest.approx(over.shape(bearing, on_disc=True), rel=1e-12)


def test_an_arm_is_as_a_rigid_piece_of_shaft(turbo):
    """A light piece of 750 times the stiffness between seat and disc: the limit, within its own mass and compliance."""
    seat_at_end = TURBO.replace('seat = "490 mm"', 'seat = "500 mm"')
    piece = """[[shaft.sections]]
length = "30 mm"
outer_diameter = "60 mm"
[shaft.sections.material]
density = "1 kg/m^3"
youngs_modulus = "9999 GPa"
poisson_ratio = 0.3
[[shaft.layers]]
name = "magnets"
"""
    solid = TURBO.replace('seat = "490 mm"\n', "").replace('[[shaft.layers]]\nname = "magnets"\n', piece)
    armed, built = (Mesh(rs.machine.Machine.from_text(text)).rotor for text in (seat_at_end, solid))
    for speed in (0.0, 2000.0):
        assert run_modal(armed, speed).wn[:6] == pytest.approx(run_modal(built, speed).wn[:6], rel=2e-4)


def test_a_layer_that_carries_mass_alone_adds_no_stiffness(turbo):
    stiff = turbo.with_({"shaft.layers.0.carries": "mass and stiffness"})
    bare = turbo.with_({"shaft.layers": ()})
    held = turbo.with_({"shaft.layers": turbo.shaft.layers[:1]})
    K = [Mesh(one).free_stiffness for one in (held, turbo, stiff)]
    sizes = [np.trace(matrix) for matrix in K]
    assert sizes[0] < sizes[1] < sizes[2]
    fine = Mesh(bare.with_({"effects": turbo.effects}))
    assert fine.free_stiffness.shape != K[0].shape  # a layer's ends are nodes
    assert Mesh(held).rotor.mass - fine.rotor.mass == pytest.approx(7850 * np.pi / 4 * (0.04**2 - 0.03**2) * 0.1)


def test_between_nodes_a_layered_shaft_deflects_as_a_node_there_would(turbo):
    coarse, fine = (Mesh(turbo.with_({"shaft.max_element_length": size})) for size in (0.05, 0.025))
    load = np.zeros(fine.rotor.ndof)
    load[0] = 1.0
    deflected = np.linalg.solve(fine.rotor.K(), load)
    k = int(np.searchsorted(coarse.nodes, 0.245)) - 1
    rows = deflection(coarse.rotor.spans[k], 0.5 * (coarse.nodes[k + 1] - coarse.nodes[k]))
    ends = [4 * fine.node(coarse.nodes[i]) for i in (k, k + 1)]
    q = np.concatenate([deflected[at : at + 4] for at in ends])
    middle = 4 * fine.node(0.5 * (coarse.nodes[k] + coarse.nodes[k + 1]))
    assert len(coarse.rotor.spans[k]) == 3
    assert rows @ q == pytest.approx(deflected[middle : middle + 2], rel=1e-9, abs=1e-18)


def test_a_built_rotor_that_turns_the_other_way_is_the_mirror_image(turbo):
    one = rs.Plant(turbo).simulate(0.02, speed=500.0, pressure=0.0)
    other = rs.Plant(mirrored(turbo)).simulate(0.02, speed=-500.0, pressure=0.0)
    seen, back = (run["disc"].values for run in (one, other))
    assert np.ptp(seen, axis=0).min() > 1e-7
    assert back == pytest.approx(seen * [-1.0, 1.0], abs=1e-9 * np.abs(seen).max())


def test_the_text_of_a_built_rotor_gives_it_back(turbo):
    assert rs.machine.Machine.from_text(turbo.text) == turbo
    shown = {path for path, _, _ in rs.machine.rows(turbo)}
    assert {"shaft.layers.1.carries", "discs.0.seat", "shaft.sections.0.outer_diameter_right", "point_masses.0.mass",
            "shaft.layers.1.material.density"} <= shown  # fmt: skip


def test_the_sketch_draws_cone_layers_arm_and_mass(turbo):
    figure = machine_sketch(turbo)
    curves = {trace.name: trace for trace in figure.data}
    assert {"shaft", "layer", "arm", "disc", "point mass"} <= set(curves)
    left, right = np.array(curves["shaft"].y[:5], float), np.array(curves["shaft"].x[:5], float)
    assert left[3] < left[2] and right[:2] == pytest.approx([0.0, 200.0])
    assert max(z for z in curves["disc"].x if z is not None) > 530


FAULTS = {
    "shaft.sections.0.length": ("-200 mm", "shaft.sections.0.length"),
    "shaft.sections.1.inner_diameter": ("31 mm", "shaft.sections.1.inner_diameter"),
    "shaft.layers.0.length": ("400 mm", "shaft.layers.0.length"),
    "shaft.layers.0.inner_diameter": ("29 mm", "shaft.layers.0.inner_diameter"),
    "shaft.layers.1.inner_diameter": ("39 mm", "shaft.layers.1.inner_diameter"),
    "shaft.layers.1.carries": ("weight", "shaft.layers.1.carries"),
    "discs.0.seat": ("501 mm", "discs.0.seat"),
    "discs.1.position": ("-1 mm", "discs.1.position"),
    "discs.1.name": ("impeller", "discs.1.name"),
    "point_masses.0.position": ("510 mm", "point_masses.0.position"),
    "bearings.1.position": ("600 mm", "bearings.1.position"),
}


@pytest.mark.parametrize("path", FAULTS)
def test_a_part_that_cannot_be_built_is_refused_at_its_field(turbo, path):
    value, field = FAULTS[path]
    with pytest.raises(MachineFileError) as caught:
        turbo.replace(path, value)
    assert field in {line.partition(": ")[0] for line in caught.value.problems}


def test_all_faults_of_a_built_rotor_are_listed_at_once():
    text, expected = TURBO, set()
    for path, (value, field) in FAULTS.items():
        if path != "shaft.sections.0.length":  # without it nobody can tell where the shaft ends
            text = with_value(text, path, value)
            expected.add(field)
    with pytest.raises(MachineFileError) as caught:
        rs.machine.Machine.from_text(text)
    assert {line.partition(": ")[0] for line in caught.value.problems} == expected


BAD = """name = "mistyped"
[shaft]
[shaft.material]
density = "7850 kg/m^3"
youngs_modulus = "210 GPa"
[[shaft.sections]]
length = "300 mm"
outer_diameter = "40 mm"
[[shaft.sections]]
length = "LENGTH"
outer_diameter = "40 mm"
[[shaft.layers]]
position = "50 mm"
length = "50 mm"
inner_diameter = "40 mm"
outer_diameter = "50 mm"
[[shaft.layers]]
position = "70 mm"
length = "50 mm"
inner_diameter = "45 mm"
outer_diameter = "52 mm"
[[bearings]]
kind = "table"
position = "20 mm"
points = [{speed = "3000 rpm", kxx = "1 MN/m"}, {speed = "1000 rpm", kxx = "2 MN/m"}]
[[bearings]]
kind = "gas_film"
position = "900 mm"
diameter = "40 mm"
length = "40 mm"
clearance = "20 um"
[[bearings.orifices]]
count = 8
"""
ALWAYS = {
    "shaft.material.poisson_ratio", "shaft.layers.1.inner_diameter", "bearings.0.points.1.speed",
    "bearings.1.orifices.0.diameter",
}  # fmt: skip


@pytest.mark.parametrize(
    ("length", "more"),
    [("-100 mm", {"shaft.sections.1.length"}), ("100 mm", {"bearings.1.position", "bearings.1.length"})],
)
def test_a_designers_slips_are_listed_at_once_with_exit_code_2(length, more, tmp_path, capsys):
    """Negative length, no shear modulus, overlapping layers, table out of order, half an orifice row, bearing beyond
    the end (which a negative length leaves open)."""
    path = tmp_path / "bad.toml"
    path.write_text(BAD.replace("LENGTH", length))
    with pytest.raises(SystemExit) as ended:
        main(["machine", "check", str(path)])
    assert ended.value.code == 2
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(": ")[0] for line in lines] == [str(path)] * len(lines)
    assert {line.split(": ")[1] for line in lines} == ALWAYS | more


MANY = (
    BAD.replace("LENGTH", "100 mm")
    + """[[bearings]]
kind = "gas_flim"
position = "200 mm"
[[discs]]
position = "410 mm"
mass = "-2 kg"
polar_inertia = "1e-3 kg*m"
diametral_inertia = "1e-3 kg*m^2"
[[thrust_bearings]]
position = "150 mm"
pushes = "up"
inner_diameter = "60 mm"
outer_diameter = "50 mm"
clearance = "20 um"
[probe]
position = "250"
[effects.unbalance]
me = "5 g"
"""
)
MORE = {
    "bearings.2.kind", "discs.0.position", "discs.0.mass", "discs.0.polar_inertia", "thrust_bearings.0.pushes",
    "thrust_bearings.0.inner_diameter", "probe.position", "effects.unbalance.me",
}  # fmt: skip


def test_no_mistake_hides_another_one():
    """A bearing of no kind, an effect and a disc that cannot be read, next to the slips above."""
    with pytest.raises(MachineFileError) as caught:
        rs.machine.Machine.from_text(MANY)
    assert {line.partition(": ")[0] for line in caught.value.problems} == ALWAYS | MORE | {
        "bearings.1.position", "bearings.1.length",
    }  # fmt: skip


@pytest.mark.parametrize("kind", ["gas_film", "linear"])
def test_a_bearing_of_no_kind_may_be_what_others_need(kind):
    """Injectors and effects that act in a film or in springs are judged once it is known which bearings there are."""
    text = rs.machine.load_machine("dtu_gas_bearing").text + "[effects.ball_bearing]\nbearing = 0\n"
    assert text.count(f'kind = "{kind}"') == 1
    with pytest.raises(MachineFileError) as caught:
        rs.machine.Machine.from_text(text.replace(f'"{kind}"', '"gas_flim"'))
    (line,) = caught.value.problems
    assert line.startswith("bearings.") and ".kind: 'gas_flim'" in line


QUESTIONS = {
    "shaft.layers.0.inner_diameter": "34 mm",
    "discs.0.polar_inertia": "2e-3 kg*m^2",
    "shaft.sections.1.material.density": "7.85 kg/m^3",
    "shaft.layers.1.material.youngs_modulus": "114 kPa",
}


@pytest.mark.parametrize("path", QUESTIONS)
def test_a_part_that_hardly_can_be_meant_is_questioned_at_its_field(turbo, path):
    assert not questions(turbo)
    asked = questions(turbo.replace(path, QUESTIONS[path]))
    assert [one.partition(":")[0] for one in asked] == [path]


def test_the_rim_of_a_layer_limits_the_speed_with_its_own_material(turbo):
    """(3 + nu) / 8 rho v^2 of titanium."""
    plain = turbo.with_({"discs": (), "effects": {}})
    assert largest_radius(plain) == ("shaft.layers.1", pytest.approx(0.022))
    _, sentence = first_passed(plain, np.array([0.0, 600.0 / 0.022]))
    assert "shaft.layers.1" in sentence and f"{(3 + 0.34) / 8 * 4430 * 600**2 / 1e6:.3g} MPa" in sentence


CANTILEVER = f"""name = "double taper"
[shaft]
max_element_length = "125 mm"
[shaft.material]{STEEL}
[[shaft.sections]]
length = "10 m"
outer_diameter = "4 mm"
outer_diameter_right = "1 mm"
[[bearings]]
kind = "linear"
position = "0 mm"
kxx = "1 N/m"
"""
MABIE = [23.289, 73.9, 165.23, 299.7, 478.1]
"""Mabie & Rogers, J. Acoust. Soc. Am. 51 (1972) 1771, both sides taken from 4 to 1, as Code_Aster V2.02.009 quotes it:
w = lambda r sqrt(E / rho) / L^2 with the radius of gyration r at the free end."""


def cone_eigenvalues(guesses):
    """Eigenvalues of a cantilever cone, 4 to 1, by Euler's theory: with x from the apex, v is 1/x times J2, Y2, I2 and
    K2 of 2 sqrt(k x); v and v' vanish at x = 4, v'' and (x^4 v'')' at x = 1 (Kirchhoff 1879)."""

    def determinant(k):
        far, near = 2 * np.sqrt(4 * k), 2 * np.sqrt(k)
        slopes = [-jv(3, far), -yv(3, far), iv(3, far), -kv(3, far)]
        shears = [jv(3, near), yv(3, near), iv(3, near), -kv(3, near)]
        rows = [[one(2, far) for one in (jv, yv, iv, kv)], slopes, [one(4, near) for one in (jv, yv, iv, kv)], shears]
        return np.linalg.det(np.array(rows) / np.array([1.0, 1.0, iv(3, far), kv(3, near)]))

    # lambda = k (L / x1)^2 with the length of three between x = 1 and 4
    return [9 * brentq(determinant, guess / 9 * 0.99, guess / 9 * 1.01, xtol=1e-13) for guess in guesses]


def test_a_double_tapered_cantilever_has_the_eigenvalues_of_mabie_and_rogers():
    """80 elements within 2e-5 of the closed form; the table, integrated in 1972, is up to 3.4e-4 below both."""
    rotor = Mesh(rs.machine.Machine.from_text(CANTILEVER)).rotor
    free = np.arange(4, rotor.ndof)
    M, K = rotor.M()[np.ix_(free, free)], rotor.K()[np.ix_(free, free)]
    wn = np.abs(oscillations(M, np.zeros_like(M), K)[0])[:10:2]
    found = wn / (1e-3 / 4 / 10.0**2 * np.sqrt(210e9 / 7850))
    assert found == pytest.approx(cone_eigenvalues(MABIE), rel=3e-5)
    assert found == pytest.approx(MABIE, rel=3.5e-4)


TAPERED = """name = "tapered"
[shaft]
max_element_length = "31.25 mm"
[shaft.material]
density = "7810 kg/m^3"
youngs_modulus = "211 GPa"
poisson_ratio = 0.2992610837438423
[[shaft.sections]]
length = "1.5 m"
outer_diameter = "25 mm"
outer_diameter_right = "40 mm"
[[discs]]
position = "750 mm"
mass = "15.33489914 kg"
polar_inertia = "0.1198038995 kg*m^2"
diametral_inertia = "0.0619466030 kg*m^2"
"""


def test_the_tapered_shaft_of_friswell_has_the_frequencies_of_ross():
    """Friswell et al. (2010), example 5.9.10, at 3000 rpm; wd of ROSS 2.3.0 with 48 tapered elements [rad/s]. Both
    elements converge with order 2, to within 1e-4 of each other."""
    short = '[[bearings]]\nkind = "linear"\nposition = "{} mm"\nkxx = "10 MN/m"\ncxx = "1 kN*s/m"\n'
    ends = short.format(0) + short.format(1500)
    rotor = Mesh(rs.machine.Machine.from_text(TAPERED + ends)).rotor
    theirs = [87.4524366, 87.6753572, 579.0990082, 703.6676703, 1165.4712107, 1170.5690950]
    assert run_modal(rotor, 100 * np.pi).wd[:6] == pytest.approx(theirs, rel=1e-4)


def test_a_disc_is_named_where_results_name_it(turbo, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "turbo.toml").write_text(TURBO)
    assert place_at(turbo, 0.53).name == "impeller at 530 mm"
    line = ["response", "turbo.toml", "--speeds", "500 rpm:4000 rpm:3", "--unbalance", "10 g*mm", "--json", "--disc"]
    peaks = []
    for disc in ("coupling half", "1", "impeller"):
        with pytest.raises(SystemExit) as ended:
            main([*line, disc, "--out", f"of {disc}"])
        assert not ended.value.code
        peaks.append(json.loads(capsys.readouterr().out)["peaks"]["impeller"]["um"])
    assert peaks[0] == peaks[1] != peaks[2]
    with pytest.raises(SystemExit) as ended:
        main([*line, "propeller"])
    assert ended.value.code == 2


def test_each_mode_of_the_shaft_has_its_own_damping_ratio():
    """At rest on springs without dampers the modes are those of the reduction, pair by pair in both planes."""
    text = rs.load_machine("plain_rotor").text.replace('cxx = "200 N*s/m"', 'cxx = "0 N*s/m"')
    rotor = rs.machine.Machine.from_text(text.replace("[[shaft.sections]]", "[[shaft.modes]]\ndamping_ratio = 0.03\n"
                                         "[[shaft.modes]]\ndamping_ratio = 0.007\n[[shaft.sections]]", 1))  # fmt: skip
    assert rs.Plant(rotor).linearise(0.0, 0.0).zeta[:6] == pytest.approx(np.repeat([0.03, 0.007, 0.002], 2), rel=1e-6)
    assert rs.machine.Machine.from_text(rotor.text) == rotor
    changed = rotor.replace("shaft.modes.1.damping_ratio", 0.01)
    assert rs.Plant(changed).linearise(0.0, 0.0).zeta[2] == pytest.approx(0.01, rel=1e-6)
    with pytest.raises(MachineFileError):
        rotor.replace("shaft.modes.0.damping_ratio", 0.7)
