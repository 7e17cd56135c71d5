"""Shaft analyses: Campbell, critical speeds, stability, time and frequency response, tables, pedestals, ROSS."""

from types import SimpleNamespace

import numpy as np
import pytest

from fe_shaft import BearingElement, DiskElement, Material, PointMass, Rotor, ShaftElement, Unbalance, steel

pytestmark = pytest.mark.numerical

RPM = np.pi / 30


def twenty(kyy=1e6, c=1e3, kxy=0.0):
    """Shaft of 1.5 m in twenty elements with two discs."""
    shaft = [ShaftElement(0.075, 0.0, 0.05) for _ in range(20)]
    discs = [DiskElement.from_geometry(n, steel, 0.07, 0.05, d) for n, d in ((7, 0.28), (13, 0.35))]
    bearings = [BearingElement(n, 1e6, c, kyy=kyy, kxy=kxy, kyx=-kxy) for n in (0, 20)]
    return Rotor(shaft, discs, bearings)


@pytest.mark.parametrize(("kyy", "c", "kxy"), [(1e6, 0.0, 0.0), (0.8e6, 1e3, 0.0), (1e6, 500.0, 2e5)])
def test_campbell_of_a_large_rotor_equals_the_whole_problem(kyy, c, kxy):
    """Also double frequencies at rest; modes are refined to 1e-11."""
    rotor = twenty(kyy, c, kxy)
    speeds = np.linspace(0.0, 500.0, 6)
    campbell = rotor.run_campbell(speeds)
    for i, speed in enumerate(speeds):
        modes = rotor.run_modal(speed)
        assert campbell.wn[i] == pytest.approx(modes.wn[:6], rel=1e-8)
        assert campbell.damping_ratio[i] == pytest.approx(modes.damping_ratio[:6], abs=1e-8)
    assert np.array_equal(campbell.whirl[3], rotor.run_modal(300.0).whirl[:6])


def test_branches_follow_modes_through_a_crossing():
    """A stiff overhung disc: the second backward mode falls through the first forward modes of the other end."""
    rotor = twenty(c=0.0)
    campbell = rotor.run_campbell(np.linspace(1.0, 900.0, 60), frequencies=6)
    wn = campbell.along_branch("wn")[:, :6]
    bend = np.abs(np.diff(wn, 2, axis=0))
    assert np.nanmax(bend) < 2.0
    data = campbell.dataset()
    for branch in range(4):
        senses = {s for s in data["whirl"].values[1:, branch] if s}
        assert len(senses) == 1
    assert data["wn"].attrs["units"] == "rad/s"


def test_friswell_6_9_1_critical_speeds_of_the_overhung_rotor():
    """Book: 358.43 389.35 2123.79 2659.10 3118.14 rpm, shaft of six elements; last printed digit and the cut one."""
    material = Material("steel", rho=7810.0, E=211e9, Poisson=0.3)
    shaft = [ShaftElement(0.25, 0.0, 0.025, material=material) for _ in range(6)]
    bearings = [BearingElement(n, 0.2e6, 0.0, kyy=0.4e6) for n in (0, 4)]
    rotor = Rotor(shaft, [DiskElement(6, 15.3, 0.062, 0.120)], bearings)
    critical = rotor.run_critical_speed(count=5)
    assert critical.wn / RPM == pytest.approx([358.43, 389.35, 2123.79, 2659.10, 3118.14], abs=0.02)


def test_undamped_critical_speeds_are_the_forward_ones_of_the_rotor():
    rotor = twenty(c=0.0)
    forward = rotor.run_critical_speed(count=6)
    expected = forward.wn[forward.whirl == "forward"][:2]
    result = rotor.run_ucs((1e6, 1e9), num=5)
    assert result.wn[:2, 0] == pytest.approx(expected, rel=1e-8)
    assert np.all(np.diff(result.wn[0]) > 0)


def test_free_motion_that_starts_in_a_mode_stays_in_it():
    """q = Re(phi exp(lambda t)) for any rotor; 1e-8 is the rounding of the matrix exponential. Restarts go on."""
    rotor, speed = twenty(kyy=0.7e6), 300.0
    modes, t = rotor.run_modal(speed), np.arange(400) * 2e-4
    for mode in (0, 3, 5):
        motion = modes.shapes[:, mode] * np.exp(modes.eigenvalues[mode] * t)[:, None]
        start = np.concatenate([motion[0].real, (modes.eigenvalues[mode] * motion[0]).real])
        free = rotor.run_time_response(speed, np.zeros((400, rotor.ndof)), t, start)
        assert np.abs(free.yout - motion.real).max() < 1e-7
        half = rotor.run_time_response(speed, np.zeros((100, rotor.ndof)), t[:100], start).last
        rest = rotor.run_time_response(speed, np.zeros((301, rotor.ndof)), t[99:], half).yout
        assert np.abs(rest - free.yout[99:]).max() < 1e-7


def test_ramp_of_force_is_integrated_exactly_whatever_the_step():
    """One step of 10 ms against a hundred of .1 ms, both with the force linear between the ends."""
    rotor = twenty()
    fine, coarse = np.arange(101) * 1e-4, np.arange(2) * 1e-2
    F = np.zeros((101, rotor.ndof))
    F[:, 28] = fine
    few = rotor.run_time_response(100.0, F[[0, 100]], coarse).yout[-1]
    many = rotor.run_time_response(100.0, F, fine).yout[-1]
    assert np.abs(few - many).max() < 1e-7 * np.abs(many).max()


def test_time_response_settles_to_the_unbalance_response():
    """Force m e w^2 that turns, sampled 100 times a turn: linear pieces lack (pi/100)^2/3 of it."""
    rotor, w = twenty(c=2e4), 150.0
    t = np.arange(30000) * 2 * np.pi / w / 100
    F = np.zeros((len(t), rotor.ndof))
    F[:, 28], F[:, 29] = np.cos(w * t), np.sin(w * t)
    y = rotor.run_time_response(w, F * 1e-4 * w**2, t).yout[-100:, 28]
    amplitude = np.abs(2 / 100 * np.sum(y * np.exp(-1j * w * t[-100:])))
    expected = np.abs(rotor.run_unbalance_response(7, 1e-4, 0.0, w).response[28, 0])
    assert amplitude == pytest.approx(expected, rel=1e-3)


def test_declared_unbalance_and_gravity_settle_to_whirl_about_the_sag():
    """From rest, at a coarse step of an eighth of a turn: exact, so only what has not yet died down is left."""
    rotor, w = twenty(c=2e4), 150.0
    t = np.arange(4000) * 2 * np.pi / w / 8
    me = Unbalance(7, 1e-4, 0.4)
    free = rotor.run_time_response(w, None, t, unbalance=[me], gravity=9.81)
    assert np.abs(free.yout[0]).max() < 1e-15
    steady = rotor.run_unbalance_response(7, 1e-4, 0.4, w).response[:, 0]
    expected = rotor.run_static(9.81).displacement + (steady * np.exp(1j * w * t[-1])).real
    assert np.abs(free.yout[-1] - expected).max() < 1e-6 * np.abs(expected).max()


def test_declared_unbalance_is_the_limit_of_a_finely_sampled_force():
    """Linear pieces lack (w h)^2 / 12 of a turning force: 1.3e-4 at 160 samples a turn; a restart goes on."""
    rotor, w = twenty(), 150.0
    t = np.arange(801) * 2 * np.pi / w / 160
    F = np.zeros((len(t), rotor.ndof))
    F[:, 28], F[:, 29] = np.cos(w * t), np.sin(w * t)
    me = [Unbalance(7, 1e-4)]
    sampled = rotor.run_time_response(w, F * 1e-4 * w**2, t).yout
    declared = rotor.run_time_response(w, None, t, unbalance=me)
    assert np.abs(declared.yout - sampled).max() < 3e-4 * np.abs(sampled).max()
    half = rotor.run_time_response(w, None, t[:401], unbalance=me).last
    rest = rotor.run_time_response(w, None, t[400:], half, unbalance=me)
    assert np.abs(rest.yout - declared.yout[400:]).max() < 1e-7 * np.abs(sampled).max()


def test_frequency_response_is_the_inverse_of_the_dynamic_stiffness(full_rotor):
    w, speed = np.array([0.0, 300.0, 900.0]), 400.0
    result = full_rotor.run_freq_response(w, speed)
    for i, x in enumerate(w):
        Z = full_rotor.K() - x**2 * full_rotor.M() + 1j * x * (full_rotor.C() + speed * full_rotor.G())
        assert np.abs(Z @ result.response[:, :, i] - np.eye(full_rotor.ndof)).max() < 1e-6
    part = full_rotor.run_freq_response(w, speed, inputs=[4], outputs=[8, 9]).response
    assert part == pytest.approx(result.response[np.ix_([8, 9], [4])])


def test_table_over_speed_is_linear_between_its_entries_and_held_where_asked():
    table = {"frequency": [0.0, 100.0, 300.0]}
    bearing = BearingElement(0, [1e6, 2e6, 4e6], [0.0, 10.0, 10.0], **table)
    assert bearing.stiffness_at(50.0)[0, 0] == pytest.approx(1.5e6)
    assert bearing.damping_at(200.0)[1, 1] == pytest.approx(10.0)
    held = BearingElement(0, [1e6, 2e6, 4e6], 0.0, extrapolate="hold", **table)
    assert held.stiffness_at(900.0)[1, 1] == 4e6


def test_modes_on_bearings_that_hang_on_the_whirl_frequency_match_their_own_frequency():
    """Each mode is a mode of the rotor whose bearings are constant at the mode's frequency."""
    axis = np.linspace(0.0, 3000.0, 31)
    shaft = [ShaftElement(0.25, 0.0, 0.05) for _ in range(6)]
    disc = [DiskElement.from_geometry(2, steel, 0.07, 0.05, 0.28)]
    soft = Rotor(shaft, disc, [BearingElement(n, 1e6 + 500 * axis, 0.0, whirl_frequency=axis) for n in (0, 6)])
    modes = soft.run_modal(200.0)
    for mode in (0, 2, 3):
        w = modes.wn[mode]
        stiff = Rotor(shaft, disc, [BearingElement(n, 1e6 + 500 * w, 0.0) for n in (0, 6)])
        assert stiff.run_modal(200.0).wn[mode] == pytest.approx(w, rel=1e-8)


def test_pedestals_put_two_springs_in_series_when_they_are_light():
    """k1 k2 / (k1 + k2); a pedestal of 1e-6 of the rotor's mass changes the frequency by less than that."""
    shaft = [ShaftElement(0.25, 0.0, 0.05) for _ in range(6)]
    bearings = [BearingElement(n, 2e6, 0.0, n_link=7 + i) for i, n in enumerate((0, 6))]
    bearings += [BearingElement(7 + i, 3e6, 0.0) for i in range(2)]
    rotor = Rotor(shaft, [], bearings, [PointMass(7, 1e-5), PointMass(8, 1e-5)])
    plain = Rotor(shaft, [], [BearingElement(n, 1.2e6, 0.0) for n in (0, 6)])
    assert rotor.ndof == 32
    assert rotor.run_modal(100.0).wn[:4] == pytest.approx(plain.run_modal(100.0).wn[:4], rel=1e-5)
    assert rotor.run_static().displacement[1] == pytest.approx(plain.run_static().displacement[1], rel=1e-5)


def test_orbit_of_a_node_has_the_axes_of_its_amplitudes():
    """X = 2, Y = -i: x = 2 cos, y = sin, forward; turned by 30 degrees its major axis is at 30 degrees."""
    from fe_shaft.modal import half_axes, inclination

    turn = np.exp(1j * np.pi / 6)
    x, y = np.array([2.0, 2 * turn.real + 1j * turn.imag]), np.array([-1j, 2 * turn.imag - 1j * turn.real])
    major, minor = half_axes(x, y)
    assert major == pytest.approx([2, 2])
    assert minor == pytest.approx([1, 1])
    assert inclination(x, y) == pytest.approx([0, np.pi / 6])


def test_rotor_of_ross_is_read_by_its_attributes_and_written_again():
    """The class below has the names of ROSS; what is read from it gives the same matrices."""
    rotor = twenty()
    module = SimpleNamespace(
        Material=lambda **k: SimpleNamespace(**k),
        ShaftElement=lambda **k: SimpleNamespace(**k),
        DiskElement=lambda **k: SimpleNamespace(**k),
        PointMass=lambda **k: SimpleNamespace(**k),
        BearingElement=lambda **k: SimpleNamespace(**k),
        Rotor=lambda shaft, discs, bearings: SimpleNamespace(
            shaft_elements=shaft, disk_elements=discs, bearing_elements=bearings, point_mass_elements=[]
        ),
    )
    again = Rotor.from_ross(rotor.to_ross(module))
    for name in ("M", "K", "C", "G"):
        assert np.array_equal(getattr(again, name)(), getattr(rotor, name)())
    with pytest.raises(ValueError, match="held nodes"):
        Rotor(rotor.shaft_elements, clamped=[0]).to_ross(module)


def test_every_result_is_labelled_with_units(full_rotor):
    t = np.arange(5) * 1e-4
    results = [
        full_rotor.run_modal(300.0), full_rotor.run_campbell([0.0, 300.0]), full_rotor.run_critical_speed(count=2),
        full_rotor.run_ucs(num=3), full_rotor.run_stability([0.0, 300.0]), full_rotor.run_static(),
        full_rotor.run_unbalance_response(1, 1e-5, 0.0, [100.0]), full_rotor.run_freq_response([100.0], inputs=[0]),
        full_rotor.run_time_response(0.0, np.zeros((5, full_rotor.ndof)), t),
    ]  # fmt: skip
    for result in results:
        for variable in result.dataset().variables.values():
            assert "units" in variable.attrs or variable.dims == ("axis",)
