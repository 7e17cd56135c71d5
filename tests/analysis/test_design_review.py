"""Rules of the standards against numbers by hand, and a design review against a rotor whose response is known."""

from dataclasses import replace
from math import pi, sqrt

import control
import numpy as np
import pytest

import rotorsim as rs
from rotorsim.analysis import standards
from rotorsim.analysis.design_review import (
    MET,
    MISSED,
    OPEN,
    _scales,
    _with_peaks,
    deflected_line,
    design_review,
    margin_of,
    static_loads,
)
from rotorsim.analysis.shaft_motion import over_largest
from rotorsim.commands.report import _sensitivity as sensitivity_of
from rotorsim.control.sampled_loop import law_system
from rotorsim.live.laws import SHIPPED
from rotorsim.report.design import LIFTED, design_page
from rotorsim.report.machine_sketch import machine_drawing, side_view
from rotorsim.report.page import Block, Page, plain_page
from rotorsim.report.units import page_system
from rotorsim.verify.closed_loop import full_plant, pins

RPM = pi / 30


@pytest.mark.parametrize(
    ("amplification", "above", "asked"),
    [(2.49, False, 0.0), (2.5, False, 0.0), (3.5, False, 8.5), (6.5, False, 13.6), (6.5, True, 23.6),
     (40.0, False, 16.0), (40.0, True, 26.0), (18.5, False, 16.0), (18.5, True, 26.0)],
)  # fmt: skip
def test_the_margin_asked_is_that_of_the_formula_by_hand(amplification, above, asked):
    # 17 (1 - 1/(6.5 - 1.5)) = 13.6; 17 (1 - 1/(3.5 - 1.5)) = 8.5; 17 (1 - 1/17) = 16: there the limit begins
    assert standards.required_margin(amplification, above) == pytest.approx(asked, abs=1e-12)


def test_a_worked_example_of_amplification_and_margin():
    # N1 = 3900, Nc = 4000 and N2 = 4150 rpm: AF = 4000 / 250 = 16, margin asked 17 (1 - 1/14.5) = 15.828 % of 5000 rpm
    peak = standards.HalfPower(4000 * RPM, 50e-6, 3900 * RPM, 4150 * RPM)
    assert peak.amplification == pytest.approx(16.0, rel=1e-12)
    assert standards.required_margin(peak.amplification, above=False) == pytest.approx(15.8276, abs=1e-4)
    assert standards.found_margin(peak.speed, 5000 * RPM, 6000 * RPM) == pytest.approx(20.0, rel=1e-12)
    assert standards.found_margin(7500 * RPM, 5000 * RPM, 6000 * RPM) == pytest.approx(25.0, rel=1e-12)
    assert standards.found_margin(5500 * RPM, 5000 * RPM, 6000 * RPM) == 0.0


@pytest.mark.parametrize("zeta", [0.01, 0.05, 0.1])
def test_half_power_of_a_single_mass_is_that_of_its_closed_form(zeta):
    # |u| = r^2 / |1 - r^2 + 2 i zeta r|; its peak is at 1/sqrt(1 - 2 zeta^2), both half-power points solve a quadratic
    r = np.linspace(0.4, 1.8, round(14 / zeta) + 1)
    found = standards.half_power(r, r**2 / np.abs(1 - r**2 + 2j * zeta * r))
    top = 1 / sqrt(1 - 2 * zeta**2)
    level = top**4 / ((1 - top**2) ** 2 + (2 * zeta * top) ** 2) / 2
    sides = np.sqrt(np.roots([1 - 1 / level, 4 * zeta**2 - 2, 1]))
    assert len(found) == 1
    assert found[0].speed == pytest.approx(top, rel=3e-4)  # a step is a tenth of the damping ratio
    assert [found[0].low, found[0].high] == pytest.approx(sorted(sides), rel=1e-4)


def test_a_flank_that_is_not_deep_enough_leaves_the_amplification_open():
    r = np.linspace(0.9, 1.4, 201)
    found = standards.half_power(r, r**2 / np.abs(1 - r**2 + 2j * 0.2 * r))
    assert len(found) == 1 and np.isnan(found[0].amplification)


@pytest.mark.parametrize("flank", [0.4, 0.2])
def test_a_peak_narrower_than_the_points_leaves_the_amplification_open(flank):
    """Its parabola is at less than half of its own point, or below 0."""
    found = standards.half_power(np.arange(1.0, 6.0), [0.1, flank, 1.0, 0.95, 0.1])
    assert len(found) == 1 and np.isnan(found[0].amplification) and np.isnan(found[0].size) == (flank < 0.3)


def test_unbalances_and_limits_by_hand():
    # 100 lb at 12000 rpm: 4 W/N = .0333 oz in = 24.0 g mm, and 6350 * 45.36 / 12000 = 24.0 g mm
    load = 100 * 0.45359237
    assert standards.residual_unbalance(load, 12000 * RPM) == pytest.approx(
        4 * 100 / 12000 * 28.3495e-3 * 25.4e-3, rel=1e-3
    )
    assert (
        standards.vibration_limit(12000 * RPM) == pytest.approx(25.4e-6)
        and standards.vibration_limit(6000 * RPM) == 25.4e-6
    )
    assert standards.vibration_limit(48000 * RPM) == pytest.approx(12.7e-6)
    assert standards.permissible_unbalance(2.5, 10.0, 3000 * RPM) == pytest.approx(79.6e-6, rel=1e-3)  # 79.6 g mm
    assert [standards.shaft_zone(um * 1e-6, 3600 * RPM) for um in (79, 81, 151, 221)] == ["A", "B", "C", "D"]
    assert [standards.sensitivity_zone(s) for s in (2.9, 3.1, 4.1, 5.1)] == ["A", "B", "C", "D"]


def test_a_deflected_line_of_a_circular_and_of_a_plane_mode():
    z = np.linspace(0, pi, 21)
    for y in (1j, -1j, 0.0, 2.0):
        line = deflected_line((1 + 0.3j) * np.sin(2 * z), (1 + 0.3j) * y * np.sin(2 * z))
        assert np.abs(line) == pytest.approx(np.abs(np.sin(2 * z)), abs=1e-4)


@pytest.mark.parametrize("y", [1j, -1j, 1.0, 0.4j])
def test_a_shape_and_its_line_do_not_depend_on_the_phase_of_the_mode_or_on_its_last_digits(y):
    """The antinodes are alike, and so are x and y on a circle: rounding decides which of them is the largest."""
    z, rng = np.linspace(0, pi, 21), np.random.default_rng(1)
    shape = np.stack([np.sin(2 * z) + 0.3j * np.sin(4 * z), y * np.sin(2 * z) + 0.2 * np.sin(4 * z)], axis=-1)
    own = over_largest(shape[None])[0]
    for _ in range(50):
        noise = 1e-13 * rng.standard_normal(shape.shape)
        other = over_largest((shape + noise)[None] * np.exp(2j * pi * rng.uniform()))[0]
        assert other == pytest.approx(own, abs=1e-9)
        assert deflected_line(*other.T) == pytest.approx(deflected_line(*own.T), abs=1e-9)


@pytest.mark.parametrize("step", [0.2, 0.4, 0.8])
def test_the_width_of_a_single_mass_does_not_depend_on_the_step(step):
    """1 / size^2 = 1 + (speed - top)^2 / half^2 with the top between points: the width is 2 half."""
    half, top = 0.02, 1.0037
    r = np.arange(0.8, 1.2, step * half)
    found = standards.half_power(r, 1 / np.sqrt(1 + ((r - top) / half) ** 2))[0]
    assert [found.low, found.high] == pytest.approx([top - half, top + half], rel=1e-9)


@pytest.fixture(scope="module")
def review():
    return design_review(rs.Plant("plain_rotor"), (3200 * RPM, 4000 * RPM))


def test_static_loads_are_those_of_a_lever():
    plant = rs.Plant("aerostatic_spindle")
    shaft, disc = plant.machine.shaft.mass, plant.machine.discs[0].mass
    front = (shaft * (0.12 - 0.05) + disc * (0.24 - 0.05)) / 0.14
    assert static_loads(plant) == pytest.approx([shaft + disc - front, front], rel=1e-9)


def test_the_peak_of_a_review_is_that_of_its_mode_and_of_the_response_command(review):
    first = next(m for m in review.criticals if m.peak is not None)
    assert first.peak.speed == pytest.approx(first.speed, rel=1e-4)
    assert first.peak.amplification == pytest.approx(1 / (2 * first.zeta), rel=0.01)
    case = next(c for c in review.cases if c.name == first.driven_by)
    found = rs.analysis.unbalance_response(review.plant, [first.peak.speed], 0.0, case.unbalances)
    assert float(found["major"].sel(place="measuring plane")[0]) == pytest.approx(first.peak.size, rel=1e-3)


def test_a_critical_speed_among_the_operating_speeds_misses_its_margin(review):
    at = next(m for m in review.criticals if m.peak is not None).peak.speed
    inside = design_review(review.plant, (0.9 * at, 1.1 * at))
    missed = [c for c in inside.checks if c.rule == "margin" and c.verdict == MISSED]
    assert missed and (missed[0].found, missed[0].unit) == (0.0, "%")
    mode = next(m for m in review.criticals if m.peak is not None)
    asked, found = margin_of(mode, review)
    verdicts = [c.verdict for c in review.checks if c.rule == "margin" and f"{mode.peak.speed / RPM:.0f}" in c.name]
    assert verdicts == [MET if found >= asked else MISSED]


def test_what_was_not_looked_at_is_never_met(review):
    asked = {check.rule: check for check in review.checks}
    assert asked["sensitivity"].verdict == OPEN
    assert {"margin", "decrement", "onset", "clearance", "sensitivity"} <= asked.keys() <= standards.RULES.keys()
    with_law = design_review(review.plant, (3200 * RPM, 4000 * RPM), sensitivity=4.5)
    assert [c.verdict for c in with_law.checks if c.rule == "sensitivity"] == [MISSED]


def test_a_review_reports_each_step_before_it_starts():
    texts = []
    found = design_review(rs.Plant("plain_rotor"), (250.0, 300.0), progress=texts.append)
    steps = [int(text.split()[1]) for text in texts]
    assert steps == sorted(steps) and set(steps) == {1, 2, 3}
    assert steps.count(1) >= len(found.modes.followed.nodes) and steps.count(2) == found.responses.sizes["speed"]


@pytest.mark.parametrize("speeds", [(0.0, 100.0), (200.0, 100.0)])
def test_operating_speeds_that_do_not_ascend_are_refused(speeds):
    with pytest.raises(rs.errors.DataError):
        design_review(rs.Plant("plain_rotor"), speeds)


def test_the_least_decrement_is_looked_at_at_both_ends_of_the_operating_speeds(review):
    at = review.decrements["speed"].values
    assert {review.low, review.high} <= set(at.tolist())
    zeta = min(rs.Plant("plain_rotor").linearise(review.high, 0.0).zeta)
    here = float(review.decrements.sel(speed=review.high))
    assert here == pytest.approx(2 * pi * zeta / sqrt(1 - zeta**2), rel=1e-6)


def test_a_bearing_that_the_shaft_lifts_off_has_words_for_its_load(review):
    rows = dict(design_page(replace(review, loads=np.array([-0.5, 4.0]))).blocks[0].rows)
    first, second = rows["Static loads W"].split(", ")
    assert LIFTED in first and LIFTED not in second


def test_static_loads_leave_out_what_the_bearings_add_to_the_inertia():
    machine = rs.load_machine("plain_rotor").with_({"bearings.0.mxx": 2.0})
    assert static_loads(rs.Plant(machine)) == pytest.approx(static_loads(rs.Plant("plain_rotor")), rel=1e-9)


def test_motion_in_a_clearance_is_looked_at_up_to_the_highest_operating_speed():
    rub = '[effects.rub]\nstiffness = "0.001 N/m"\ngap = "500 um"\n\n[effects.unbalance]'
    text = rs.load_machine("plain_rotor").text.replace("[effects.unbalance]", rub)
    found = design_review(rs.Plant(rs.machine.Machine.from_text(text)), (100.0, 277 / 1.28))
    assert found.clearances and all(one.speed <= found.high * (1 + 1e-9) for one in found.clearances)
    assert next(c.verdict for c in found.checks if c.rule == "clearance") == MET


def test_a_mode_with_a_node_at_the_probe_is_seen_at_the_bearings_and_is_open_where_no_place_sees_it():
    text = rs.load_machine("plain_rotor").text.replace('"0.012627 kg*m^2"', '"0.002 kg*m^2"')
    found = design_review(rs.Plant(rs.machine.Machine.from_text(text)), (1150.0, 1700.0))
    second = next(m for m in found.criticals if m.speed > 1700.0 and m.whirl == "forward")
    asked, has = margin_of(second, found)
    assert second.place.startswith("bearing") and set(found.probes.values()) < set(found.places.values())
    assert 0 < has < asked and second.peak.speed == pytest.approx(second.speed, rel=1e-3)
    modes = tuple(replace(m, peak=None) if m is second else m for m in found.criticals)
    for one, verdict in ((found, MISSED), (replace(found, criticals=modes), OPEN)):
        assert verdict in [c.verdict for c in one.checks if c.rule == "margin"]


def test_a_backward_mode_that_unbalance_does_not_drive_needs_no_margin(review):
    back = next(m for m in review.criticals if m.whirl == "backward")
    assert back.peak is None and margin_of(back, review)[0] == 0.0
    assert margin_of(replace(back, whirl="mixed"), review)[0] > 0.0


def test_a_machine_without_a_mode_in_the_region_has_a_steady_response():
    text = rs.load_machine("plain_rotor").text.replace('cxx = "200 N*s/m"', 'cxx = "200000 N*s/m"')
    text = text.replace('kxx = "10 MN/m"', 'kxx = "0.01 MN/m"')
    found = design_review(rs.Plant(rs.machine.Machine.from_text(text)), (100.0, 150.0))
    assert (found.responses["zeta_least"].values > 0).all()
    assert OPEN not in [c.verdict for c in found.checks if c.rule in ("vibration", "decrement")]


def test_the_vibration_checked_is_the_largest_at_the_operating_speeds(review):
    wide = design_review(review.plant, (2500 * RPM, 4000 * RPM))
    assert [c.verdict for c in wide.checks if c.rule == "vibration"] == [MISSED]


def test_a_review_does_not_depend_on_the_order_in_which_its_responses_are_held(review):
    turned = replace(review, responses=review.responses.transpose("z", "speed", "case"))
    speeds = (review.low, review.high)
    assert _scales(turned.responses, review.cases, review.probes, speeds) == review.scales
    again = list(_with_peaks(review.criticals, turned.responses, review.cases, review.places))
    assert [(m.peak, m.place, m.driven_by) for m in again] == [(m.peak, m.place, m.driven_by) for m in review.criticals]
    for z in review.places.values():
        np.testing.assert_array_equal(turned.motion("static 1", z), review.motion("static 1", z))


@pytest.mark.parametrize("held", [slice(1, None), slice(-1)])
def test_responses_of_other_cases_than_the_unbalances_are_refused(review, held):
    fewer = review.responses.isel(case=held)
    with pytest.raises(ValueError, match="zip"):
        _scales(fewer, review.cases, review.probes, (review.low, review.high))
    with pytest.raises(ValueError, match="zip"):
        list(_with_peaks(review.criticals, fewer, review.cases, review.places))


def test_the_drawing_shows_a_cone_with_both_its_diameters():
    built = rs.load_machine("plain_rotor").replace("shaft.sections.0.outer_diameter_right", "15 mm")
    left, right = built.shaft.sections[0].outer
    (shaft,) = [trace for trace in machine_drawing(built).data if trace.name == "shaft"]
    heights = {round(abs(y), 9) for y in shaft.y if y is not None}
    assert {round(500 * left, 9), round(500 * right, 9)} <= heights and left != right


def test_the_drawing_shows_foils_mouths_and_collars_where_they_are_and_keeps_names_apart():
    """The foil over the length of its film between journal and sleeve; the orifices of both rows, above and below."""
    foiled, fed, thrust = map(rs.load_machine, ("foil_turbo_rotor", "aerostatic_spindle", "grooved_turbo_rotor"))
    foils = [one for one in side_view(foiled).shapes if one.kind == "foil"]
    assert len(foils) == 2 * len(foiled.films)
    for film, upper in zip(foiled.films, foils[::2], strict=True):
        z, y = np.array(upper.corners).T
        assert (z.min(), z.max(), y.min()) == pytest.approx((*(1e3 * e for e in film.ends), 500 * film.diameter))
    mouths = [one for one in side_view(fed).shapes if one.kind == "mouth"]
    places = {round(float(np.mean([z for z, _ in one.corners])), 3) for one in mouths}
    assert places == {round(1e3 * (f.position + row.offset), 3) for f in fed.films for row in f.orifices}
    collars = [max(y for _, y in one.corners) for one in side_view(thrust).shapes if one.kind == "collar"]
    assert collars == pytest.approx([500 * one.outer_diameter for one in thrust.thrust_bearings])
    notes = [a for a in machine_drawing(thrust).layout.annotations if "\N{DIAMETER SIGN}26" in a.text]
    assert len(notes) == 2 and notes[0].x == notes[1].x and notes[0].yshift != notes[1].yshift


def test_the_sensitivity_of_the_shipped_law_is_that_of_python_control_and_an_unstable_loop_has_none(tmp_path):
    """ISO 14839-3 on the sampled loop of 290 states; a law with a hundredfold gain drives the rotor away."""
    plant, path, at = rs.Plant("dtu_gas_bearing"), SHIPPED / "hinf.json", (3000 * RPM, 0.5e6)
    law = rs.load_law(path)
    systems = full_plant(plant, *at, pins(plant)), law_system(law, *at)
    G, K = (control.ss(s.A, s.B, s.C, s.D, law.Ts) for s in systems)
    S = control.feedback(control.ss([], [], [], np.eye(2), law.Ts), G * K, sign=1)
    z = np.exp(2j * pi * np.geomspace(0.5, 2400.0, 1500) * law.Ts)
    largest = np.linalg.svd(np.moveaxis(S(z), -1, 0), compute_uv=False).max()
    assert sensitivity_of(plant, path, (100.0, at[0]), at[1]) == pytest.approx(largest, rel=1e-4)
    loud = replace(law, C=100 * law.C, D=100 * law.D)
    loud.save(tmp_path / "loud.json")
    worst = sensitivity_of(plant, tmp_path / "loud.json", (100.0, at[0]), at[1])
    assert worst == np.inf and standards.sensitivity_zone(worst) == "D"


def test_a_drawing_in_inches_keeps_its_scale_in_both_directions():
    pages = {}
    for units in ("metric", "imperial"):
        with page_system(units):
            figure = machine_drawing(rs.load_machine("aerostatic_spindle"))
            pages[units] = plain_page(Page("", "", [Block("Machine", figure=figure)]))["rows"][0][0]["figure"]
    metric, imperial = (one["data"] for one in pages.values())
    assert len(metric) > 4
    for mm, inch in zip(metric, imperial, strict=True):
        for axis in "xy":
            pairs = zip(mm[axis], inch[axis], strict=True)
            assert all((a is b is None) or b == pytest.approx(a / 25.4, rel=1e-4, abs=1e-9) for a, b in pairs)
    texts = [note["text"] for note in pages["imperial"]["layout"]["annotations"]]
    assert "9.45" in texts and "240" not in texts
