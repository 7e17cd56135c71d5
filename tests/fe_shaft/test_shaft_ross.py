"""Rotors of ROSS: every attribute is carried into a matrix, refused or named in a sentence.

The stand-ins have the attributes of ROSS 2.3 and 3.1; where the package is installed, its matrices are the measure.
"""

import warnings
from copy import deepcopy
from types import SimpleNamespace

import numpy as np
import pytest

from fe_shaft import BearingElement, DiskElement, PointMass, Rotor, ShaftElement, ShaftError, steel
from rotorsim.errors import NotCarried

COEFFICIENTS = [kind + axes for kind in "kcm" for axes in ("xx", "yy", "xy", "yx", "zz")]
MATRICES = ("M", "K", "C", "G")
AXIS = np.array([0.0, 200.0, 400.0])


def bearing(n, version=3, speed=None, frequency=None, **more):
    """A BearingElement as ROSS keeps it: coefficients as (nested) lists, axes as arrays."""
    axes = {"frequency": frequency} if version < 3 else {"speed": speed, "frequency": frequency}
    shape = tuple(len(axis) for axis in (speed, frequency) if axis is not None) or (1,)
    given = {"kxx": 1e6, "kyy": 8e5, "cxx": 100.0, "cyy": 100.0} | more
    values = {name: np.broadcast_to(given.pop(name, 0.0), shape).tolist() for name in COEFFICIENTS}
    own = {"interpolation": "pchip", "radial_clearance": None} if version > 2 else {}
    return SimpleNamespace(n=n, n_link=None, tag=f"Bearing {n}", color="#355d7a", scale_factor=1, n_l=n, n_r=n,
                           dof_global_index={}, **own, **axes, **values, **given)  # fmt: skip


def rotor(version=3, bearings=None, **more):
    stuff = SimpleNamespace(name="Steel", rho=7810.0, E=211e9, G_s=81.2e9, Poisson=0.3, color="#525252",
                            specific_heat=434, thermal_conductivity=60.5)  # fmt: skip
    shaft = [
        SimpleNamespace(
            n=n, L=0.25, idl=0.0, odl=0.05, idr=0.0, odr=0.05, material=stuff, axial_force=0, torque=0, alpha=0.0,
            beta=0.0, shear_effects=True, rotary_inertia=True, gyroscopic=True, shear_method_calc="cowper", kappa=0.886,
            phi=0.08, volume=4.9e-4, m=3.8, tag=f"Shaft {n}",
        ) for n in range(4)
    ]  # fmt: skip
    disc = SimpleNamespace(n=2, m=20.0, Id=0.2, Ip=0.35, tag="Disk 0", color="Firebrick", scale_factor=1.0)
    point = SimpleNamespace(n=1, m=None, mx=2.0, my=3.0, mz=0.0, tag="PointMass 0", color="#c4820a")
    own = {"modal_damping_ratio": None, "default_damping_ratio": 0.0, "alpha": 0.0, "beta": 0.0, "motor_element": None}
    return SimpleNamespace(
        shaft_elements=shaft, disk_elements=[disc], point_mass_elements=[point], min_w=None, max_w=None, rated_w=None,
        bearing_elements=bearings or [bearing(0, version), bearing(4, version)], number_dof=6, tag="Rotor 0",
        **(own if version > 2 else {}) | more,
    )  # fmt: skip


def read(foreign):
    """The rotor and the sentences of its conversion."""
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        made = Rotor.from_ross(foreign)
    assert all(issubclass(one.category, NotCarried) for one in seen)
    return made, [str(one.message) for one in seen]


def native(element=None, disc=None, **more):
    shaft = [ShaftElement(0.25, 0.0, 0.05, **element or {}) for _ in range(4)]
    bearings = [BearingElement(n, 1e6, 100.0, 8e5) for n in (0, 4)]
    assert (steel.rho, steel.E, steel.G_s) == (7810.0, 211e9, 81.2e9)
    points = [PointMass(1, mx=2.0, my=3.0, **disc or {}), *more.pop("points", ())]
    return Rotor(shaft, [DiskElement(2, 20.0, 0.2, 0.35, **disc or {})], bearings, points)


def same(a, b, speed=100.0):
    return all(np.array_equal(*(getattr(r, m)(*([speed] if m in "KC" else [])) for r in (a, b))) for m in MATRICES)


def test_axial_force_and_torque_of_elements_are_carried():
    foreign = rotor()
    for element in foreign.shaft_elements:
        element.axial_force, element.torque = 2e4, 300.0
    made, sentences = read(foreign)
    assert same(made, native({"axial_force": 2e4, "torque": 300.0}))
    assert not sentences


def test_tension_raises_the_frequency_as_in_a_pinned_beam():
    """Pinned ends and a tension F: w^2 = w0^2 (1 + F L^2 / (pi^2 E I)) (Blevins); shear and inertia stay below 1e-3."""
    stiff = [bearing(n, kxx=1e12, kyy=1e12, cxx=0.0, cyy=0.0) for n in (0, 4)]
    foreign = rotor(bearings=stiff)
    foreign.disk_elements, foreign.point_mass_elements = [], []
    slender = deepcopy(foreign)
    for one in (*foreign.shaft_elements, *slender.shaft_elements):
        one.odl = one.odr = 0.01
    for one in slender.shaft_elements:
        one.axial_force = 1e3
    plain, pulled = (read(one)[0].run_modal(0.0).wn[0] for one in (foreign, slender))
    moment = np.pi / 64 * 0.01**4
    assert pulled / plain == pytest.approx(np.sqrt(1 + 1e3 / (np.pi**2 * 211e9 * moment)), rel=1e-3)


def test_damping_of_the_whole_rotor_goes_to_every_element_and_mass():
    made, sentences = read(rotor(alpha=3.0, beta=1e-5))
    assert same(made, native({"alpha": 3.0, "beta": 1e-5}, {"alpha": 3.0}))
    assert not sentences
    proportional = 3.0 * made.M() + 1e-5 * native().parts.K
    ends = [bearing(n, kxx=1e6, cxx=0.0, cyy=0.0) for n in (0, 4)]
    undamped, _ = read(rotor(alpha=3.0, beta=1e-5, bearings=ends))
    assert undamped.C() == pytest.approx(proportional, rel=1e-12, abs=1e-9)


def test_masses_of_bearings_act_as_point_masses_without_weight():
    made, sentences = read(rotor(bearings=[bearing(0, mxx=3.0, myy=2.0), bearing(4)]))
    assert same(made, native(points=[PointMass(0, mx=3.0, my=2.0)]))
    assert made.run_static().bearing_forces == pytest.approx(native().run_static().bearing_forces, rel=1e-12)
    assert not sentences


@pytest.mark.parametrize("version", [2, 3])
def test_tables_stand_over_the_axis_that_the_version_of_ross_means(version):
    """Version 2 has one axis, the speed; from 3 on `frequency` is that of the whirl."""
    table = 1e6 + 1e3 * AXIS
    made, sentences = read(rotor(version, [bearing(n, version, frequency=AXIS, kxx=table, kyy=table) for n in (0, 4)]))
    at = made.bearing_elements[0].stiffness_at(100.0, 300.0)[0, 0]
    assert at == pytest.approx(1.1e6 if version == 2 else 1.3e6)
    assert len(sentences) == 1
    if version == 3:
        made, _ = read(rotor(3, [bearing(n, speed=AXIS, kxx=table, kyy=table) for n in (0, 4)]))
        assert made.bearing_elements[0].stiffness_at(100.0, 300.0)[0, 0] == pytest.approx(1.1e6)
        both = 1e6 + 1e3 * AXIS[:, None] + 2e3 * AXIS
        made, _ = read(rotor(3, [bearing(n, speed=AXIS, frequency=AXIS, kxx=both, kyy=both) for n in (0, 4)]))
        assert made.bearing_elements[0].stiffness_at(100.0, 300.0)[0, 0] == pytest.approx(1.7e6)


REFUSED = {
    "modal damping": lambda: rotor(modal_damping_ratio=[0.01, 0.02]),
    "motor": lambda: rotor(motor_element=SimpleNamespace(n=2)),
    "gear train": lambda: rotor(rotors={"driving": None, "driven": None}),
    "coaxial shafts": lambda: rotor(shafts=[1, 2]),
    "mass that couples x with y": lambda: rotor(bearings=[bearing(0, mxy=1.0), bearing(4)]),
    "mass over the table": lambda: rotor(bearings=[bearing(0, speed=AXIS, mxx=[1.0, 2.0, 3.0]), bearing(4)]),
    "another object": object,
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_changes_the_motion_and_has_no_counterpart_is_refused(case):
    with pytest.raises(ShaftError):
        Rotor.from_ross(REFUSED[case]())


def test_a_mass_between_two_nodes_acts_on_their_relative_acceleration():
    foreign = rotor(bearings=[bearing(0, mxx=1.0), bearing(4)])
    foreign.bearing_elements[0].n_link = 1
    added = read(foreign)[0].M() - native().M()
    assert added[np.ix_([0, 4], [0, 4])] == pytest.approx(np.array([[1.0, -1.0], [-1.0, 1.0]]), rel=1e-12)


def test_a_coupling_is_refused():
    foreign = rotor()
    foreign.shaft_elements[1] = SimpleNamespace(n=1, kt_x=1e6, m_l=1.0, m_r=1.0, L=0.2)
    with pytest.raises(ShaftError, match="shaft element 1"):
        Rotor.from_ross(foreign)


DRAWN = {"color", "tag", "scale_factor", "dof_global_index", "n_l", "n_r", "number_dof"}
ALONE = {"default_damping_ratio", "interpolation", "speed", "frequency"}
"""Without modal damping, and with a table of one entry, these say nothing."""
FOLLOWS = {"kappa", "phi", "volume", "Poisson", "specific_heat", "thermal_conductivity", "m", "name"}
LOOSE = [
    *(("rotor", name) for name in vars(rotor())), *(("shaft", name) for name in vars(rotor().shaft_elements[0])),
    *(("material", name) for name in vars(rotor().shaft_elements[0].material)),
    *(("disc", name) for name in vars(rotor().disk_elements[0])),
    *(("point", name) for name in vars(rotor().point_mass_elements[0])),
    *(("bearing", name) for name in vars(bearing(0))),
    *((kind, "later") for kind in ("rotor", "shaft", "disc", "bearing")),
]  # fmt: skip
PATHS = [one for one in LOOSE if one == ("disc", "m") or one[1] not in DRAWN | FOLLOWS | ALONE]


def part(foreign, kind):
    first = foreign.shaft_elements[0]
    return {"rotor": foreign, "shaft": first, "material": first.material, "disc": foreign.disk_elements[0],
            "point": foreign.point_mass_elements[0], "bearing": foreign.bearing_elements[0]}[kind]  # fmt: skip


def changed(value):
    """Another value of an attribute."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, str):
        return value + "x"
    if value is None or isinstance(value, (dict, SimpleNamespace)):
        return 1.0
    if isinstance(value, list):
        return [2.0 * one + 1.0 for one in value] if all(isinstance(one, float) for one in value) else value[:0]
    return 2 * value + 1 if isinstance(value, int) else 1.1 * value + 0.3


@pytest.mark.parametrize(("kind", "name"), PATHS, ids=lambda text: text)
def test_no_attribute_is_lost_without_a_sentence(kind, name):
    """Each attribute by itself gets another value: a matrix changes, or there is an error or a sentence."""
    plain = read(rotor())[0]
    foreign = rotor()
    one = part(foreign, kind)
    setattr(one, name, changed(getattr(one, name, None)))
    try:
        made, sentences = read(foreign)
    except ShaftError:
        return
    assert sentences or not same(made, plain)


@pytest.mark.parametrize("version", [2, 3])
def test_a_rotor_without_anything_special_brings_no_sentence(version):
    made, sentences = read(rotor(version))
    assert same(made, native())
    assert not sentences


def test_many_elements_of_one_kind_share_a_sentence():
    foreign = rotor()
    for element in foreign.shaft_elements:
        element.crack_depth = 0.1
    _, sentences = read(foreign)
    assert len(sentences) == 1
    assert "crack_depth" in sentences[0]


def test_matrices_are_those_of_ross_itself():
    """The package as a witness, where it is installed."""
    ross = pytest.importorskip("ross")
    stuff = ross.Material(name="Steel", rho=7810.0, E=211e9, G_s=81.2e9)
    shaft = [ross.ShaftElement(0.25, 0.0, 0.05, material=stuff, axial_force=2e4, alpha=2.0) for _ in range(4)]
    ends = [ross.BearingElement(n=n, kxx=1e6, cxx=100.0, mxx=3.0) for n in (0, 4)]
    theirs = ross.Rotor(shaft, [ross.DiskElement(n=2, m=20.0, Id=0.2, Ip=0.35)], ends)
    made, _ = read(theirs)
    per = theirs.number_dof
    at = np.concatenate([per * n + np.array([0, 1, per - 3, per - 2] if per == 6 else range(4)) for n in range(5)])
    for name, matrix in (("M", theirs.M(100.0)), ("K", theirs.K(100.0)), ("C", theirs.C(100.0)), ("G", theirs.G())):
        own = getattr(made, name)()
        assert own == pytest.approx(np.asarray(matrix)[np.ix_(at, at)], rel=1e-9, abs=1e-9 * np.abs(own).max())
