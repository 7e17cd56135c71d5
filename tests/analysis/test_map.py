"""Operating maps, onsets, critical speeds and mode shapes against the plant they are computed from."""

import sys

import numpy as np
import pytest
import xarray as xr

from rotorsim.analysis import (
    critical_speeds,
    lift_off,
    mode_shapes,
    operating_map,
    operating_point,
    over_fields,
    safe_region,
    whirl_onset,
)
from rotorsim.analysis.axes import Field, checked, read_axis, read_field
from rotorsim.analysis.operating_map import unsafe_lines, useful
from rotorsim.base.errors import DataError, MachineFileError, NoLiftOffError
from rotorsim.plant import Plant

pytestmark = pytest.mark.numerical

RPM = np.pi / 30


@pytest.fixture(scope="module")
def plant(rig):
    return rig()


@pytest.fixture(scope="module")
def small(plant):
    """A map that reaches below lift-off and above the critical speed."""
    return safe_region(operating_map(plant, np.array([0, 3000, 6000, 9000]) * RPM, [0.1e6, 0.4e6, 0.7e6]))


def test_a_point_of_the_map_is_what_plant_and_film_give(plant, small):
    speed, pressure = 3000 * RPM, 0.4e6
    here = small.isel(speed=1, pressure=1)
    model, rest = plant.linearise(speed, pressure), plant.equilibrium(speed, pressure)
    assert here["wn"].values[:2] == pytest.approx(model.wn[:2], rel=1e-12)
    assert here["static_gain"].values == pytest.approx(model.static_gain, rel=1e-12)
    assert here["delay"].values == pytest.approx(model.delay, rel=1e-12)
    assert float(here["eccentricity_ratio"]) == rest.eccentricity_ratio
    assert here["mass_flow"].values == pytest.approx(rest.mass_flow, rel=1e-15)


def test_without_lift_off_a_point_is_empty_and_not_safe(small):
    low = small.isel(pressure=0, speed=0)
    assert float(low["lifted"]) == 0 and np.isnan(low["wn"]).all() and float(low["safe"]) == 0


def test_safe_is_lifted_stable_and_clear_of_the_critical_speeds(small):
    """At .7 MPa the criticals are near 7200 and 7800 rpm: 0, 3000 are safe, 9000 is 15.4 % above the upper one."""
    assert small["safe"].sel(pressure=0.7e6).values.tolist() == [1, 1, 1, 1]
    assert small["safe"].sel(pressure=0.4e6).values.tolist() == [1, 1, 0, 1]
    assert small["critical_speed"].sel(pressure=0.7e6).values / RPM == pytest.approx([7229, 7801], rel=0.01)


def test_each_point_that_is_not_safe_has_its_reason(small):
    lost, near, grows = small["lifted"] == 0, small["near_critical"] == 1, small["grows"] == 1
    assert ((small["safe"] == 0) == (lost | near | grows)).all() and not (lost & (near | grows)).any()
    assert unsafe_lines(small) == [f"{int(lost.sum())} not carried, 1 within 15 % of a critical speed"]
    zeta = small["zeta_least"].copy()
    zeta[{"pressure": 1, "speed": slice(2, None)}] = -0.1
    whirls = safe_region(small.assign(zeta_least=zeta))
    first, onset = unsafe_lines(whirls)
    assert "2 a mode grows" in first
    assert onset == "a mode grows from between 3000 and 6000 rpm on, at 0.4 MPa"


def test_growth_is_shaded_from_where_the_damping_passes_zero():
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    from rotorsim.report.page import shade_growth

    speed = np.arange(0.0, 7000.0, 1000.0)
    zeta = np.where(speed < 6000, (speed - 1250) * (speed - 4600) / 1e8, np.nan)
    figure = make_subplots(2, 1)
    for row in (1, 2):
        figure.add_trace(go.Scatter(x=speed, y=speed), row, 1)
    shade_growth(figure, speed, zeta, rows=2)
    between = [
        np.interp(0, *zip(*sorted(zip(zeta[k : k + 2], speed[k : k + 2], strict=True)), strict=True)) for k in (1, 4)
    ]
    assert [(one.x0, one.x1) for one in figure.layout.shapes] == [pytest.approx(between)] * 2
    shade_growth(figure, speed, np.abs(zeta), rows=2)
    assert len(figure.layout.shapes) == 2
    zeta[3] = np.nan  # no film carries there
    shade_growth(figure, speed, zeta, rows=1)
    assert [(one.x0, one.x1) for one in figure.layout.shapes[2:]] == [
        pytest.approx((between[0], 2000.0)), pytest.approx((4000.0, between[1]))
    ]  # fmt: skip


def test_what_is_not_safe_is_shaded_above_the_contours(small):
    """As a contour: plotly draws heat maps below filled contours, whatever their order."""
    from rotorsim.report.operating_map import contour_figure

    panels = contour_figure(small).data
    assert [t.type for t in panels[:2]] == ["contour", "contour"]
    assert np.array_equal(panels[1].z, 1 - small["safe"].values)


def test_the_film_in_the_map_is_the_film_of_reynolds(plant, small):
    """K(omega) and C(omega) against the same matrices solved the other way round; C(0) against 1 mHz."""
    from reynolds.perturbation import dynamic_stiffness

    film = plant.linearise(3000 * RPM, 0.4e6).film
    here = small.isel(speed=1, pressure=1)
    for k, omega in enumerate(here["film_frequency"].values):
        Z = dynamic_stiffness(film, max(float(omega), 1e-2))
        assert here["film_stiffness"].values[k] == pytest.approx(Z.real, rel=1e-8, abs=1e-2)
        assert here["film_damping"].values[k] == pytest.approx(Z.imag / max(float(omega), 1e-2), rel=1e-6, abs=1e-2)


def test_condensed_eigenvalues_and_gains_are_those_of_the_whole_matrix(plant):
    model = plant.linearise(4000 * RPM, 0.5e6)
    values = np.linalg.eigvals(model.A)
    for found in model.eigenvalues:
        assert np.abs(values - found).min() < 1e-6 * abs(found)
    gain = -model.C @ np.linalg.solve(model.A, model.B)
    assert model.static_gain == pytest.approx(gain[:, :2], rel=1e-9, abs=1e-14)
    s = 300j
    whole = model.C @ np.linalg.solve(s * np.eye(len(model.A)) - model.A, model.B.astype(complex))
    assert model.transfer(s) == pytest.approx(whole, rel=1e-8, abs=1e-16)


def test_any_field_of_the_machine_file_can_be_an_axis(plant):
    """A wider bearing is softer: that is what the clearance does to this rig at .5 MPa and rest."""
    fields = [read_field("bearings.1.clearance=24 um, 26 um")]
    found = operating_map(plant, [0.0], [0.5e6], fields)
    assert found["wn"].dims == ("bearings_1_clearance", "pressure", "speed", "mode")
    assert found["bearings_1_clearance"].values.tolist() == [24.0, 26.0]
    alone = operating_map(type(plant)(plant.machine.replace("bearings.1.clearance", "26 um")), [0.0], [0.5e6])
    assert found["wn"].values[1] == pytest.approx(alone["wn"].values, rel=1e-12)


def test_onset_lift_off_and_crossings_are_those_of_the_machine_that_is_mapped(rig):
    """A clearance of 40 um moves onset and critical speed; the damping of the map changes sign at the onset."""
    plant, fields = rig(), [read_field("bearings.1.clearance=25 um, 40 um")]
    wider = type(plant)(plant.machine.replace("bearings.1.clearance", "40 um"))
    for analysis in (lambda p: whirl_onset(p, [0.5e6]), lambda p: critical_speeds(p, np.array([0.5e6]), (1,))):
        found, filed, alone = over_fields(plant, fields, analysis), analysis(plant), analysis(wider)
        xr.testing.assert_identical(found.isel(bearings_1_clearance=0, drop=True), filed)
        xr.testing.assert_identical(found.isel(bearings_1_clearance=1, drop=True), alone)
        assert not np.allclose(next(iter(filed.values())), next(iter(alone.values())), rtol=0.01)
    for k, onset in enumerate(over_fields(plant, fields, lambda p: whirl_onset(p, [0.5e6]))["onset_speed"].values):
        around = operating_map(plant, [0.99 * onset[0], 1.01 * onset[0]], [0.5e6], fields).isel(bearings_1_clearance=k)
        assert around["zeta_least"].values[0, 0] > 0 > around["zeta_least"].values[0, 1]


def test_two_fields_make_two_axes(rig):
    """Every combination is computed, in the order of the fields."""
    plant = rig()
    fields = [read_field("bearings.1.clearance=24 um, 26 um"), read_field("discs.0.mass=1.4 kg, 1.5 kg, 1.6 kg")]
    found = over_fields(plant, fields, lambda p: xr.Dataset({"mass": p.machine.mass, "c": p.machine.film.clearance}))
    assert found["mass"].dims == ("bearings_1_clearance", "discs_0_mass") and found["mass"].shape == (2, 3)
    assert np.ptp(found["mass"].values, axis=1) == pytest.approx(0.2) and found["discs_0_mass"].attrs["units"] == "kg"
    assert found["c"].values[:, 0] == pytest.approx([24e-6, 26e-6])


def test_two_processes_compute_what_one_does(plant, monkeypatch):
    speeds, pressures = np.array([0.0, 6000.0]) * RPM, [0.3e6, 0.7e6]
    assert useful(2, 120) == 2 and useful(2, 6) == 1
    monkeypatch.setitem(useful.__globals__, "WORTH", 2)
    one, two = (operating_map(plant, speeds, pressures, workers=n) for n in (1, 2))
    xr.testing.assert_identical(one, two)


def test_a_critical_speed_is_a_crossing(plant):
    found = critical_speeds(plant, np.array([0.5e6]), (1, 2))
    for order in (1, 2):
        for mode in (0, 1):
            speed = float(found["critical_speed"].sel(order=order)[0, mode])
            wn = operating_point(plant, speed, 0.5e6).model.wn[mode]
            assert wn == pytest.approx(order * speed, rel=1e-6)


def test_the_rig_lifts_at_rest_between_150_and_175_kilopascal(plant):
    found = lift_off(plant, [0.0])[0]
    assert 0.150e6 < found < 0.175e6
    assert plant.equilibrium(0.0, found).h_min > 0
    with pytest.raises(NoLiftOffError):
        plant.equilibrium(0.0, found - 2e3)
    thicker = lift_off(plant, [0.0], least_film=15e-6)[0]
    assert plant.equilibrium(0.0, thicker).h_min == pytest.approx(15e-6, rel=0.01) and thicker > found


def test_mode_shapes_show_at_the_disc_what_the_model_sees(plant):
    speed, pressure = 6000 * RPM, 0.5e6
    found = mode_shapes(plant, speed, pressure)
    model, node = plant.linearise(speed, pressure), int(found["disc_node"][0])
    shape = found["shape_re"].values[:, node] + 1j * found["shape_im"].values[:, node]
    x, y = model.H @ model._modes[1]
    assert shape[:, 1] / shape[:, 0] == pytest.approx(y / x, rel=1e-9)
    assert np.hypot(found["shape_re"], found["shape_im"]).max(("node", "axis")).values == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda p: operating_map(p, [], [0.5e6]), "the grid is empty"),
        (lambda p: operating_map(p, [0.0, np.nan], [0.5e6]), "value 2 is not a finite number"),
        (lambda p: operating_map(p, [100.0, 0.0], [0.5e6]), "value 2, 0, is not above"),
        (lambda p: operating_map(p, [0.0], [-2e5]), "below vacuum"),
        (lambda p: operating_map(p, [0.0], [0.5e6], frequencies=[np.inf]), "not finite"),
        (lambda p: operating_map(p, np.arange(1000.0), np.arange(1.0, 1001.0)), "at most"),
        (lambda p: operating_map(p, [0.0], [0.5e6], [Field("no.such", (1,), (1.0,), "")]), "no"),
        (lambda p: read_axis("speed", "6000 rpm:0 rpm:3", "rad/s"), "is not above the one before"),
        (lambda p: read_axis("speed", "0:6000:7", "rad/s"), "--speed"),
        (lambda p: read_axis("speed", "0 rpm:6000 rpm", "rad/s"), "FROM:TO:COUNT"),
        (lambda p: read_axis("pressure", "", "Pa"), "empty"),
        (lambda p: read_field("bearings.1.clearance"), "is not PATH=VALUES"),
        (lambda p: read_field("bearings.1.clearance=20 um:30 mm:3"), "one and the same unit"),
        (lambda p: checked("x", [3.0, 3.0]), "is not above"),
        (lambda p: lift_off(p, []), "the grid is empty"),
    ],
)
def test_grids_that_make_no_sense_are_refused_by_name(plant, call, sentence):
    with pytest.raises((DataError, MachineFileError), match=sentence):
        call(plant)


@pytest.mark.parametrize("after", [0, 2])
def test_an_interrupt_keeps_the_points_that_are_done_and_without_any_continues(monkeypatch, after):
    """An empty map ended in a KeyError of 'lifted', after the kernels were compiled."""
    module, left = sys.modules["rotorsim.analysis.operating_map"], iter(range(after))

    def numbers(*arguments):
        if next(left, None) is None:
            raise KeyboardInterrupt
        return {"lifted": np.array(1.0)}

    monkeypatch.setattr(module, "numbers", numbers)
    if after:
        found = operating_map(Plant("plain_rotor"), [0.0, 10.0], [0.0, 1e5])
        assert found.attrs["ended"] == "interrupted" and found["done"].values.tolist() == [[1, 1], [0, 0]]
    else:
        with pytest.raises(KeyboardInterrupt):
            operating_map(Plant("plain_rotor"), [0.0, 10.0], [0.0, 1e5])


def test_what_was_not_looked_for_everywhere_is_not_known_and_not_absent():
    """Onset and crossings of two pressures without a number, the modes proven at the second alone."""
    from rotorsim.commands.map import LOOKED, tables
    from rotorsim.report.operating_map import _missing

    none = np.full(2, np.nan)
    found = xr.Dataset(
        {"onset_speed": ("pressure", none), "onset_looked": ("pressure", [0.0, 1.0]),
         "crossing_speed": (("pressure", "order", "mode_crossing"), none.reshape(2, 1, 1)),
         "crossing_searched": ("pressure", [0.0, 1.0])},
        {"pressure": ("pressure", [1e5, 2e5], {"units": "Pa"}), "order": [1], "mode_crossing": [1]},
    )  # fmt: skip
    onset, crossing = tables(found)
    assert [next(iter(column.cells)) for column in onset.columns] == ["not known", "none"]
    assert list(crossing.columns[-1].cells) == ["not known", "none"]
    assert _missing(found)[0][1].startswith("not known")
    assert _missing(found.isel(pressure=[1]))[0][1].startswith("no mode grows")
    assert {flag for flag, _ in LOOKED.values()} == {"onset_looked", "crossing_searched"}
