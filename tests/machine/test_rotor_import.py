"""Models of ROSS as machines and back, and tables of bearings out of CSV files."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

import rotorsim as rs
from fe_shaft import BearingElement, DiskElement, PointMass, Rotor, ShaftElement
from fe_shaft.modal import run_modal
from fe_shaft.shaft import ShaftError
from mirror import mirrored
from refusals import refused
from rotorsim.base.errors import MachineFileError, NotCarried
from rotorsim.machine import bearing_points, from_ross
from rotorsim.machine.rotor_import import machine_of, with_points
from tests.fe_shaft.test_shaft_lalanne import PUBLISHED, three_discs
from tests.fe_shaft.test_shaft_rotorinsa import DRIVEN, OVER_SPEED, driven, over_speed

COMPRESSOR = Path(__file__).parents[1] / "fe_shaft" / "ross_compressor.json"
"""The example `ross.compressor_example()` of ROSS 2.3.0 (Apache licence 2.0): a compressor of Timbo & Ritto, J. Braz.
Soc. Mech. Sci. Eng. 41 (2019) 165, with 91 shaft elements on 55 spans, 7 discs, 2 bearings and 12 seals."""
SPEED = 837.7580409572781
"""A speed [rad/s] at which every table of the compressor has an entry."""
ROSS = {
    1044.9488946973183: 0.26537122539978175, 1047.0486053909626: 0.12857576700773513,
    1900.3750539194807: 0.5225421063460506, 1934.2878654904669: 0.6599965728400224,
    1950.98108443846: 0.5323718606405184, 1966.907414927137: 0.6591917031589757,
    2211.5605551296144: 0.1266808083580105, 2320.201415355276: 0.10571375633486221,
}  # fmt: skip
"""Natural frequencies [rad/s] and damping ratios at that speed, computed by ROSS with the entries of the tables as
coefficients (studies/benchmarks/compare_ross.py); its splines pass by them by 8e-6."""


@pytest.fixture(scope="module")
def compressor():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotCarried)
        return from_ross(COMPRESSOR)


def test_the_compressor_of_ross_has_its_modes_and_dampings(compressor):
    """Both codes have the same element; 6e-8 is the 7 kPa of 36 layers that carry mass alone here."""
    assert (len(compressor.shaft.sections), len(compressor.shaft.layers)) == (55, 36)
    found = run_modal(rs.plant.shaft_rotor(compressor), SPEED)
    assert found.wn[:8] == pytest.approx(list(ROSS), rel=1e-7)
    assert found.damping_ratio[:8] == pytest.approx(list(ROSS.values()), rel=1e-6)


def test_the_machine_of_a_model_is_a_file_that_gives_it_back(compressor):
    assert rs.Machine.from_text(compressor.text) == compressor
    again = machine_of(rs.plant.shaft_rotor(compressor), compressor.name)
    assert again == compressor


def test_the_plant_has_the_modes_of_the_model(compressor):
    """20 modes a plane are kept of 112; those damped by less than one half, which the plant lists."""
    plant = rs.Plant(compressor.with_({"solver.modes_per_plane": 20}))
    light = [wn for wn, zeta in ROSS.items() if zeta < 0.5]
    assert plant.linearise(SPEED, 0.0).wn[: len(light)] == pytest.approx(light, rel=1e-3)


def housed():
    """A rotor with every part that a machine has: cone, layer of mass, disc on an arm, masses, a housing, a table."""
    shaft = [ShaftElement(0.1, 0.0, 0.03, odr=0.05, n=0), ShaftElement(0.1, 0.01, 0.05, n=1, axial_force=500.0),
             ShaftElement(0.1, 0.05, 0.07, n=1, stiff=False), ShaftElement(0.15, 0.0, 0.04, n=2)]  # fmt: skip
    table = [1e7, 2e7]
    bearings = [BearingElement(0, 1e7, 200.0, n_link=4, mxx=0.5, myy=0.25), BearingElement(4, 3e7, 10.0, kyy=2e7),
                BearingElement(2, table, [90.0, 80.0], kxy=table, frequency=[0.0, 500.0])]  # fmt: skip
    return Rotor(
        shaft, [DiskElement(3, 2.0, 0.01, 0.02, offset=0.03)], bearings, [PointMass(1, 0.2), PointMass(4, 4.0)]
    )


def test_a_model_with_every_part_comes_back_with_its_matrices():
    model = housed()
    back = rs.plant.shaft_rotor(machine_of(model, "housed"))
    for name in ("M", "G"):
        assert getattr(back, name)() == pytest.approx(getattr(model, name)(), rel=1e-9, abs=1e-12)
    for name in ("K", "C"):
        theirs = getattr(model, name)(250.0)
        assert getattr(back, name)(250.0) == pytest.approx(theirs, rel=1e-9, abs=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize(("rpm", "sense"), [(0, 1), (60000, 1), (60000, -1)])
def test_rotorinsas_overhung_discs_as_a_machine_have_the_published_modes_in_either_sense(rpm, sense):
    """Code_Aster V2.02.125, its models A and B (negative speed and cross terms of the opposite sign have the same
    numbers): frequencies within .12 %, damping within .001. All modes of the shaft are kept."""
    machine = machine_of(driven(), "driven").with_({"solver.modes_per_plane": 26})
    frequency, damping = DRIVEN[rpm]
    plant = rs.Plant(machine if sense > 0 else mirrored(machine))
    found = plant.linearise(sense * rpm * np.pi / 30, 0.0)
    wd = found.wn * np.sqrt(1 - found.zeta**2)
    order = np.argsort(wd)[:4]
    assert wd[order] / (2 * np.pi) == pytest.approx(frequency, rel=1.2e-3)
    assert found.zeta[order] == pytest.approx(damping, abs=1e-3)


@pytest.mark.parametrize("rpm", OVER_SPEED)
def test_rotorinsas_hollow_rotor_as_a_machine_has_the_published_modes_on_its_tables(rpm):
    """Code_Aster V2.02.129, its direct elements: within .15 % and .001; the tables are held beyond 14000 rpm."""
    modes = run_modal(rs.plant.shaft_rotor(machine_of(over_speed(), "over speed")), rpm * np.pi / 30)
    frequency, damping = OVER_SPEED[rpm][1]
    order = np.argsort(modes.wd)[: len(frequency)]
    assert modes.wd[order] / (2 * np.pi) == pytest.approx(frequency, rel=1.5e-3)
    assert modes.damping_ratio[order] == pytest.approx(damping, abs=1e-3)


def test_lalanne_and_ferraris_rotor_as_a_machine_has_the_published_frequencies():
    """Rotordynamics Prediction in Engineering (1998), at 25000 rpm: within .1 %."""
    machine = machine_of(three_discs(), "three discs").with_({"solver.modes_per_plane": 28})
    found = rs.Plant(machine).linearise(25000 * np.pi / 30, 0.0)
    assert np.sort(found.wn)[:7] / (2 * np.pi) == pytest.approx(PUBLISHED, rel=1e-3)


SUPPORT = {"bearing_elements": [BearingElement(0, 1e6, 0.0)]}
UNSAYABLE = {
    "clamp": lambda r: Rotor(r.shaft_elements, clamped=[0]),
    "torque": lambda r: Rotor([ShaftElement(0.1, 0.0, 0.03, torque=5.0)], **SUPPORT),
    "switch": lambda r: Rotor([ShaftElement(0.1, 0.0, 0.03, gyroscopic=False)], **SUPPORT),
    "two masses": lambda r: Rotor(r.shaft_elements, point_mass_elements=[PointMass(0, mx=1.0, my=2.0)]),
    "between nodes": lambda r: Rotor(r.shaft_elements, bearing_elements=[BearingElement(0, 1e6, 0.0, n_link=2)]),
}  # fmt: skip


@pytest.mark.parametrize("case", UNSAYABLE)
def test_what_a_machine_has_no_field_for_is_refused(case):
    with pytest.raises(MachineFileError) as caught:
        machine_of(UNSAYABLE[case](housed()), "bad")
    assert caught.value.problems[0].startswith("rotor: ")


def test_damping_that_is_left_out_is_named():
    rotor = Rotor(
        [ShaftElement(0.1, 0.0, 0.03, beta=1e-5)], bearing_elements=[BearingElement(n, 1e6, 9.0) for n in (0, 1)]
    )
    with pytest.warns(NotCarried, match="beta"):
        machine_of(rotor, "damped")


def test_a_file_of_another_kind_is_refused(tmp_path):
    for name, text in (("a.toml", "x = 1"), ("a.json", "[1]"), ("b.json", "{"), ("c.toml", "= 2")):
        (tmp_path / name).write_text(text)
        with pytest.raises(rs.errors.RotorsimError, match=name):
            from_ross(tmp_path / name)
    with pytest.raises(rs.errors.RotorsimError, match=r"none\.toml"):
        from_ross(tmp_path / "none.toml")
    held = json.loads(COMPRESSOR.read_text()) | {"CouplingElement_0": {"n": 3}}
    (tmp_path / "coupled.json").write_text(json.dumps(held))
    with pytest.raises(rs.errors.RotorsimError, match="CouplingElement_0"):
        from_ross(tmp_path / "coupled.json")


@pytest.mark.parametrize(
    ("place", "damage"),
    [
        ("ShaftElement_0", 5),
        ("ShaftElement_0.material", {"L": 0.1, "material": "steel"}),
        ("ross_version", "x"),
        ("parameters", 3),
    ],
)
def test_a_damaged_file_is_refused_with_its_path_and_place(tmp_path, place, damage):
    path = tmp_path / "damaged.json"
    path.write_text(json.dumps({"ShaftElement_0": {}} | {place.split(".")[0]: damage}))
    with pytest.raises(ShaftError, match=f"damaged.json: {place}"):
        from_ross(path)


TABLES = {
    "comma": "speed [rpm],kxx [MN/m],kyy [MN/m],cxx [kN*s/m]\n0,10,12,1\n3000,20,22,0.5\n",
    "order and semicolon": "cxx (N*s/m);kyy (N/m);kxx (N/m);Speed (Hz)\n1000,0;12e6;10e6;0,0\n500;22e6;2,0e7;50\n",
    "tab, with a remark": (
        "# maker's data\nspeed rad/s\tkxx N/um\tkyy N/um\tcxx N*s/mm\n"
        "0\t10\t12\t1\n314.1592653589793\t20\t22\t0.5\n"
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", TABLES)
def test_a_bearing_table_is_read_by_heading_and_unit(tmp_path, name):
    (tmp_path / "b.csv").write_text(TABLES[name])
    first, last = bearing_points(tmp_path / "b.csv")
    assert (first.speed, first.kxx, first.kyy, first.cxx) == pytest.approx((0.0, 1e7, 1.2e7, 1000.0))
    assert (last.speed, last.kxx, last.kyy, last.cxx) == pytest.approx((100 * np.pi, 2e7, 2.2e7, 500.0))
    machine = with_points(rs.load_machine("plain_rotor"), 1, (first, last))
    assert machine.bearings[1].position == pytest.approx(0.6)
    assert machine.bearings[1].at(50 * np.pi)[0][0, 0] == pytest.approx(1.5e7)


def test_all_faults_of_a_bearing_table_are_listed_at_once(tmp_path):
    path = tmp_path / "b.csv"
    path.write_text("speed [rpm],kxx,stiffness [N/m],kyy [parsec]\n0,1,2,3\nfast,1,2,3\n")
    with pytest.raises(MachineFileError) as caught:
        bearing_points(path)
    assert len(caught.value.problems) == 5
    assert all(line.startswith(f"{path}: ") for line in caught.value.problems)
    for text in ("", "speed [rpm],kxx [N/m]\n0,1e6\n", "kxx [N/m]\n1e6\n2e6\n"):
        path.write_text(text)
        with pytest.raises(MachineFileError) as caught:
            bearing_points(path)
        assert (caught.value.argument, caught.value.value) == ("path", str(path))


def test_a_fault_of_a_bearing_table_names_the_line_of_the_file(tmp_path):
    path = tmp_path / "b.csv"
    for last in ("0,20", "6000,20x"):
        path.write_text(f"# of a maker\n\nspeed [rpm],kxx [MN/m]\n3000,10\n\n{last}\n")
        with pytest.raises(MachineFileError, match="line 6") as caught:
            bearing_points(path)
        assert (caught.value.argument, caught.value.value) == ("path", str(path))


def test_a_gas_film_and_an_absent_bearing_take_no_table(tmp_path):
    (tmp_path / "b.csv").write_text(TABLES["comma"])
    for machine, number in (("dtu_gas_bearing", 1), ("plain_rotor", 2)):
        with refused(MachineFileError, "bearing", number):
            with_points(rs.load_machine(machine), number, bearing_points(tmp_path / "b.csv"))


@pytest.mark.parametrize("axes", [{"whirl_frequency": [10.0, 200.0, 900.0]},
                                  {"frequency": [50.0, 400.0], "whirl_frequency": [10.0, 200.0, 900.0]}])  # fmt: skip
def test_a_table_over_the_whirl_frequency_comes_into_a_machine_and_gives_the_same_modes(axes):
    shape = tuple(map(len, axes.values()))
    rng = np.random.default_rng(5)
    K, C = (1e6 * rng.uniform(1, 3, (2, *shape)) for _ in range(2))
    ends = [BearingElement(n, K[k], 1e-3 * C[k], kxy=0.1 * K[k], extrapolate="hold", **axes)
            for k, n in enumerate((0, 6))]  # fmt: skip
    rotor = Rotor([ShaftElement(0.1, 0.0, 0.03) for _ in range(6)], [DiskElement(3, 4.0, 0.01, 0.02)], ends)
    machine = machine_of(rotor, "over whirl")
    again = rs.plant.shaft_rotor(rs.machine.Machine.from_text(machine.text))
    for speed in (0.0, 120.0, -300.0):
        assert again.run_modal(speed).eigenvalues == pytest.approx(rotor.run_modal(speed).eigenvalues, rel=1e-6)


POINTS = [{"speed": f"{s} rpm", "whirl_frequency": f"{w} Hz", "kxx": "1 MN/m"} for s in (0, 600) for w in (10, 20)]
WRONG = {
    "half": ([{k: v for k, v in POINTS[0].items() if k != "whirl_frequency"}, *POINTS[1:]], "points"),
    "hole": (POINTS[:3], "points"),
    "order": ([POINTS[1], POINTS[0], *POINTS[2:]], "points.1.whirl_frequency"),
    "twice": ([POINTS[0], POINTS[0], *POINTS[2:]], "points.1.whirl_frequency"),
    "speeds": ([*POINTS[2:], *POINTS[:2]], "points.2.speed"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_table_over_the_whirl_frequency_that_is_no_grid_is_refused_at_its_field(case):
    points, field = WRONG[case]
    with pytest.raises(MachineFileError) as caught:
        rs.machine.TableBearing(kind="table", position="0 mm", points=points)
    assert [line.partition(": ")[0] for line in caught.value.problems] == [f"TableBearing.{field}"]
