"""Pages of measured records: every usual diagram is drawn from closed forms, or left out with the reason."""

import numpy as np
import pytest
import xarray as xr

import identification as idn
import rotorsim as rs
from identification.records.sensors import SlowRollSource, without_slow_roll
from rotorsim.base.errors import DataError, SchemaError
from rotorsim.report.page import html
from rotorsim.report.record import MEASURED, made_sections, record_page
from rotorsim.report.run import SECTIONS, analyse
from rotorsim.signals.orders import mean_order

RATE = 2000.0
RUNOUT = 4e-6 * np.exp(0.8j)


def response(speed):
    """Vector of 1X [m] of a rotor with its resonance at 30 Hz."""
    w = 2 * np.pi * 30
    return 10e-6 * speed**2 / (w**2 - speed**2 + 2j * 0.08 * w * speed)


def ramp(seconds=24.0, first=4.0, last=55.0, keyphasor=True):
    """Record of a run-up in 1X with runout, whose mean goes up by 20 um."""
    t = np.arange(int(seconds * RATE)) / RATE
    f = np.where(t < 3, first, first + (last - first) * (t - 3) / (seconds - 3))
    angle = 2 * np.pi * np.cumsum(f) / RATE
    a = response(2 * np.pi * f) + RUNOUT
    motion = np.column_stack([(a * np.exp(1j * angle)).real, (-1j * a * np.exp(1j * angle)).real])
    motion += np.column_stack([0 * t, 20e-6 * f / last]) + 2e-8 * np.random.default_rng(0).standard_normal(motion.shape)
    more = {"angle": angle, "speed": 2 * np.pi * f} if keyphasor else {}
    return idn.make_record(t, {"disc_measured": motion} | more)


@pytest.fixture(scope="module")
def run_up():
    return ramp()


def shown(record):
    made = {one.section: one.why for one in made_sections(analyse(record))}
    return {name: made[SECTIONS[name]] for name in SECTIONS if SECTIONS[name] in made}


def test_a_run_up_has_every_diagram_but_the_averaged_spectrum(run_up):
    why = shown(run_up)
    assert {name for name in MEASURED if why[name]} == {"spectra"} and "waterfall" in why["spectra"]


def test_the_polar_diagram_is_the_response(run_up):
    figure = rs.report.polar(run_up)
    x = next(trace for trace in figure.data if trace.mode == "lines" and trace.xaxis == "x")
    speed, vectors = np.asarray(x.customdata) * np.pi / 30, 1e-6 * (np.asarray(x.x) + 1j * np.asarray(x.y))
    truth = response(speed) + RUNOUT
    assert np.abs(vectors - truth).max() < 0.08 * np.abs(truth).max()  # windows of 8 turns smear the resonance
    assert np.median(np.abs(vectors - truth)) < 0.02 * np.abs(truth).max()


def test_2x_is_drawn_where_it_stands_out_of_the_noise(run_up):
    assert {trace.xaxis for trace in rs.report.polar(run_up).data} == {"x"}
    twice = 1e-6 * np.exp(2j * run_up["angle"].values)
    more = run_up.assign(disc_measured=run_up["disc_measured"] + np.column_stack([twice.real, twice.imag]))
    assert {trace.xaxis for trace in rs.report.polar(more).data} == {"x", "x2"}
    assert {trace.yaxis for trace in rs.report.filtered_orbits(more).data} == {"y", "y2", "y3", "y4"}


def test_the_page_is_named_by_its_file_and_states_lists_and_angles_as_text(run_up, tmp_path):
    attrs = {"source": "lab.csv", "disc_probe_angles": [0.75 * np.pi, 0.25 * np.pi], "notes": ["a", "b"]}
    page = rs.report.record.record_page(run_up.assign_attrs(attrs))
    rows = dict(next(block for row in page.blocks for block in np.atleast_1d(row) if block.title == "Provenance").rows)
    assert page.heading == "lab.csv" and page.introduction == "Measured record."
    assert rows["Notes"] == "a; b" and rows["Disc probe angles"] == "135 deg, 45 deg"


def test_the_centreline_goes_as_far_as_the_mean(run_up):
    line = rs.report.centreline(run_up).data[0]
    assert np.ptp(line.y) == pytest.approx(20 * 51 / 55, rel=0.1) and np.ptp(line.x) < 1


def test_the_cascade_stands_on_its_speeds(run_up):
    figure = rs.report.cascade(run_up)
    raised = [trace for trace in figure.data if trace.fill == "tozeroy"]
    tallest = max(raised, key=lambda trace: np.max(trace.customdata))
    assert len(raised) > 10 and np.max(tallest.customdata) == pytest.approx(10 / 0.16, rel=0.25)
    assert tallest.x[int(np.argmax(tallest.customdata))] == pytest.approx(30, abs=3)


def test_filtered_orbits_of_a_run_up_are_those_of_the_resonance(run_up):
    figure = rs.report.filtered_orbits(run_up)
    one = next(trace for trace in figure.data if trace.mode == "lines" and trace.xaxis == "x")
    peak = 1e6 * np.abs(response(2 * np.pi * np.linspace(20, 40, 500))).max()
    assert np.hypot(one.x, one.y).max() == pytest.approx(peak, rel=0.15)
    assert {trace.xaxis for trace in figure.data} == {"x", "x2"}  # resonance and end; no row for 2X, which is noise
    dot = next(t for t in figure.data if t.mode == "markers" and t.xaxis == "x")
    tracked = analyse(run_up).tracked.sel(order=1, axis=["x", "y"])
    largest = tracked["amplitude"].isel(window=int(np.hypot(*np.abs(tracked["amplitude"].values).T).argmax())).values
    assert np.array([dot.x[0], dot.y[0]]) / 1e6 == pytest.approx(largest.real, abs=0.1 * np.abs(largest).max())


def test_the_slow_roll_of_a_record_is_its_own_motion_below_a_speed(run_up):
    bare = without_slow_roll(run_up, SlowRollSource(below=2 * np.pi * 5))
    before, after = (
        rs.signals.track_orders(rs.signals.prepared(r), (1,))["amplitude"].values[:, 0, 0] for r in (run_up, bare)
    )
    slow = response(2 * np.pi * 4.0)
    assert before - after == pytest.approx(RUNOUT + slow, abs=0.03 * abs(RUNOUT))
    assert "own motion below 300 rpm" in bare.attrs["slow_roll"]
    assert "Slow roll was subtracted" in SECTIONS["polar"].caption(analyse(bare), None)
    with pytest.raises(SchemaError, match="once"):
        without_slow_roll(bare, SlowRollSource(below=2 * np.pi * 5))
    with pytest.raises(SchemaError, match="never turns slower than 60 rpm"):
        without_slow_roll(run_up, SlowRollSource(below=2 * np.pi))
    with pytest.raises(SchemaError, match="not slow"):
        without_slow_roll(run_up, SlowRollSource(below=2 * np.pi * 40))


def test_without_a_keyphasor_each_diagram_of_the_angle_is_left_out_with_the_reason():
    why = shown(ramp(6.0, keyphasor=False))
    for name in ("orbits", "filtered_orbits", "polar", "bode"):
        assert "no shaft angle" in why[name]
    assert {name for name in MEASURED if why[name] is None} >= {"spectra", "full_spectrum", "waterfall", "against_time"}


def test_probes_without_a_mean_have_no_centreline(run_up):
    record = run_up.assign_attrs(notes="AC-coupled, without a mean position: A, B")
    assert "AC-coupled" in shown(record)["centreline"]


def lone(run_up):
    reading = run_up["disc_measured"].values[:, :1]
    probes = {"probe": ["A"], "probe_unit": ["m"]}
    arrays = {"probe_measured": reading, "angle": run_up["angle"].values, "speed": run_up["speed"].values}
    return idn.make_record(run_up["time"].values, arrays, probes=probes)


def test_a_lone_probe_has_its_spectra_and_orders_and_no_orbit(run_up):
    record = lone(run_up)
    why = shown(record)
    assert {name for name in MEASURED if why[name] is None} == {"polar", "bode", "waterfall", "cascade", "against_time"}
    for name in ("orbits", "filtered_orbits", "full_spectrum", "centreline"):
        assert why[name] == "Probe A alone does not see both x and y."
    assert {trace.name for trace in rs.report.bode(record).data} == {"probe A"}


def test_the_page_states_that_a_second_probe_without_an_angle_is_left_out(run_up):
    record = lone(run_up)
    reading = np.repeat(record["probe_measured"].values, 2, axis=1)
    arrays = {"probe_measured": reading, "angle": run_up["angle"].values, "speed": run_up["speed"].values}
    two = idn.make_record(run_up["time"].values, arrays, probes={"probe": ["A", "B"], "probe_unit": ["m", "m"]})
    assert analyse(record).others == [] and analyse(two).others == ["B"]
    assert "are left out: x and y need the angle" in html(record_page(two))
    assert "are left out: x and y need the angle" not in html(record_page(record))


def test_the_mean_of_an_order_has_the_standard_error_of_its_scatter():
    """The mean of n vectors whose parts scatter by s has s / sqrt(n)."""
    rng = np.random.default_rng(2)
    a = 3e-6 * np.exp(0.5j) + 1e-6 * (rng.standard_normal(4000) + 1j * rng.standard_normal(4000))
    tracked = xr.Dataset({"amplitude": (("window", "order", "axis"), a[:, None, None])}, {"order": [1], "axis": ["x"]})
    mean, error = mean_order(tracked, 1, "x")
    assert mean == pytest.approx(3e-6, abs=5e-8) and error == pytest.approx(1e-6 / np.sqrt(4000), rel=0.05)
    assert np.isnan(mean_order(tracked.isel(window=[0]), 1, "x")[1])


def test_vectors_have_bode_polar_and_filtered_orbits_alone(run_up, tmp_path):
    speed = 2 * np.pi * np.linspace(10, 55, 80)
    a = np.stack([response(speed), -1j * response(speed)], axis=1)[:, None, :]
    record = idn.make_vectors(speed, np.abs(a), -np.angle(a), orders=(1,))
    why = shown(record)
    assert {name for name in MEASURED if why[name] is None} == {"filtered_orbits", "polar", "bode"}
    curve = rs.report.polar(record).data[0]
    assert np.asarray(curve.x) + 1j * np.asarray(curve.y) == pytest.approx(1e6 * a[:, 0, 0], rel=1e-4)
    rs.write_report(record, tmp_path / "a.html")
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "Not shown" in text and "no motion over time" in text


def test_a_record_without_any_displacement_is_refused(run_up):
    record = lone(run_up).assign_coords(probe_unit=("probe", ["m/s^2"]))
    with pytest.raises(DataError, match="neither 'disc' nor 'disc_measured'"):
        analyse(record)
