"""Axial equilibrium and mode between thrust bearings, from the machine file to the report."""

import numpy as np
import pytest

import rotorsim as rs
from refusals import refused
from rotorsim.analysis import axial_forces, axial_state, thrust_films
from rotorsim.analysis.sweep_definition import QUANTITIES, Axial
from rotorsim.errors import DataError, MachineFileError, NoLiftOffError
from rotorsim.report.sweep import DEFINITIONS, sweep_page

SPEED = 6000.0


def turbo(**changes):
    """The shipped rotor with values of its thrust bearings changed on both sides."""
    machine = rs.load_machine("grooved_turbo_rotor")
    both = {f"thrust_bearings.{k}.{name.replace('__', '.')}": v for k in (0, 1) for name, v in changes.items()}
    return machine.with_(both) if both else machine


def test_a_pair_of_equal_films_holds_the_rotor_in_the_middle_with_twice_their_stiffness():
    found = axial_state(turbo(), SPEED)
    (film, _), gap = thrust_films(turbo()), turbo().thrust_bearings[0].clearance
    assert abs(found.displacement) < 1e-14 and found.least_gap == pytest.approx(gap)
    # s solves m s^2 + 2 Z(s) = 0 with the dynamic stiffness at the damped frequency itself
    s = found.wn * (-found.zeta + 1j * np.sqrt(1 - found.zeta**2))
    left = found.mass * s**2 + 2 * film.dynamic_stiffness(gap, SPEED, s=s)[0]
    assert abs(left) < 1e-8 * found.mass * found.wn**2


def test_the_films_carry_the_load_and_a_small_one_moves_the_rotor_by_load_over_stiffness():
    machine = turbo().with_({"axial_load": 2.0})
    found = axial_state(machine, SPEED)
    assert float(axial_forces(machine, np.array([found.displacement]), SPEED).sum()) == pytest.approx(-2.0, rel=1e-9)
    assert found.films[1].load - found.films[0].load == pytest.approx(2.0, rel=1e-9) and found.displacement > 0
    small = axial_state(turbo().with_({"axial_load": 1e-3}), SPEED)
    assert small.displacement == pytest.approx(1e-3 / sum(f.static_stiffness for f in small.films), rel=1e-3)


def test_the_mirrored_rotor_stands_in_the_mirrored_place():
    ways = [axial_state(turbo().with_({"axial_load": load}), SPEED) for load in (1.5, -1.5)]
    assert ways[0].displacement == pytest.approx(-ways[1].displacement, rel=1e-9)
    assert ways[0].zeta == pytest.approx(ways[1].zeta, rel=1e-9)


def test_one_film_carries_a_weight_alone_at_the_gap_of_its_load():
    machine = turbo()
    alone = machine.with_({"thrust_bearings": machine.thrust_bearings[:1], "axial_load": -0.636})
    found = axial_state(alone, SPEED)
    assert found.films[0].load == pytest.approx(0.636, rel=1e-9)
    assert thrust_films(alone)[0].steady(found.films[0].gap, SPEED).load == pytest.approx(0.636, rel=1e-9)


def test_films_that_are_fed_carry_at_rest():
    feed = rs.machine.RingFeed(count=8, diameter="0.1 mm")
    found = axial_state(turbo(inner_edge="fed", feed=feed), 0.0, 0.5e6)
    assert found.wn > 0 and all(f.flow > 0 and f.power == 0 for f in found.films)


def test_no_film_no_speed_and_too_much_load_are_refused():
    with refused(DataError, "machine", "plain_rotor"):
        axial_state(rs.load_machine("plain_rotor"), SPEED)
    with pytest.raises(NoLiftOffError):
        axial_state(turbo(), 0.0)
    with pytest.raises(NoLiftOffError):
        axial_state(turbo().with_({"thrust_bearings": turbo().thrust_bearings[:1]}), SPEED)


@pytest.mark.parametrize(("sign", "way"), [(1, "-z"), (-1, "+z")])
def test_what_is_missing_against_a_load_is_its_rest_over_the_films_at_the_smallest_gap(sign, way):
    """The films that push against the load are short of it, by the load less what they and the others push there."""
    machine = turbo().with_({"axial_load": sign * 1e3})
    end = 0.98 * machine.thrust_bearings[0].clearance * sign
    lacking = 1e3 + sign * float(axial_forces(machine, np.array([end]), SPEED).sum())
    with pytest.raises(NoLiftOffError) as caught:
        axial_state(machine, SPEED)
    assert f"{lacking:.3g} N" in str(caught.value) and f"towards {way}" in str(caught.value)


def test_a_rotor_that_creeps_back_along_the_shaft_is_stated_to_be_overdamped():
    """The films' stiffness grows with the speed, their damping does not: when slow s is real, and wn is its rate."""
    assert not axial_state(turbo(), SPEED).overdamped
    found, gap = axial_state(turbo(), 100.0), turbo().thrust_bearings[0].clearance
    left = found.mass * found.wn**2 + 2 * thrust_films(turbo())[0].dynamic_stiffness(gap, 100.0, s=-found.wn)[0]
    assert found.overdamped and abs(left) < 1e-8 * found.films[0].static_stiffness


def test_slip_of_the_machine_softens_its_thrust_films():
    slipping = turbo().replace("effects.slip.mean_free_path", "68 nm")
    assert axial_state(slipping, SPEED).wn < 0.999 * axial_state(turbo(), SPEED).wn


@pytest.mark.parametrize(
    ("changes", "path"),
    [
        ({"thrust_bearings.0.inner_diameter": 0.03}, "thrust_bearings.0.inner_diameter"),
        ({"thrust_bearings.0.grooves.land": 0.006}, "thrust_bearings.0.grooves.land"),
        ({"thrust_bearings.0.hub_diameter": 0.01}, "thrust_bearings.0.hub_diameter"),
        ({"thrust_bearings.0.inner_edge": "closed", "thrust_bearings.0.hub_diameter": 0.02},
         "thrust_bearings.0.hub_diameter"),
        ({"thrust_bearings.0.feed": rs.machine.RingFeed(count=8, diameter="0.2 mm")}, "thrust_bearings.0.feed"),
        ({"thrust_bearings.0.clearance": 1.5e-3}, "thrust_bearings.0.clearance"),
        ({"thrust_bearings.0.position": 0.5}, "thrust_bearings.0.position"),
        ({"thrust_bearings.1.name": "thrust"}, "thrust_bearings.1.name"),
        ({"thrust_bearings.1.pushes": "+z", "axial_load": 2.0}, "axial_load"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_with_its_path(changes, path):
    with pytest.raises(MachineFileError) as caught:
        rs.load_machine("grooved_turbo_rotor").with_(changes)
    assert [line.partition(":")[0] for line in caught.value.problems] == [path]


def test_thrust_bearings_of_a_file_are_written_and_read_back():
    machine = turbo()
    assert rs.machine.Machine.from_text(machine.text) == machine
    assert {path for path, _, _ in rs.machine.rows(machine)} >= {"thrust_bearings.0.grooves.angle", "axial_load"}
    assert "2 thrust bearings" in rs.machine.summary(machine)


def test_thrust_bearings_leave_the_lateral_rotor_as_it_is():
    """They have no part in the lateral step: every bit of an equilibrium stays."""
    with_them = rs.Plant(turbo()).equilibrium(SPEED, 0.0)
    without = rs.Plant(turbo().with_({"thrust_bearings": ()})).equilibrium(SPEED, 0.0)
    assert np.array_equal(with_them.forces, without.forces)


def test_a_sweep_over_the_clearance_of_the_thrust_bearings_has_a_page_with_every_quantity():
    over = {"thrust_bearings.*.clearance": "8 um, 16 um"}
    found = rs.analysis.sweep(turbo(), over, Axial.quantities, speed=SPEED, pressure=0.0)
    stiffness, gap, power = (found.data[name].values for name in ("axial_stiffness", "thrust_gap", "thrust_power"))
    assert stiffness[0] > 2 * stiffness[1]
    assert gap[0] == pytest.approx(8e-6) and power[0] > power[1]
    drawn = [block.title for block in sweep_page(found).blocks if block.figure is not None]
    assert len(drawn) == len(Axial.quantities) and set(DEFINITIONS) == set(QUANTITIES)
