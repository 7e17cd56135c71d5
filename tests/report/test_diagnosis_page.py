"""First screen of a diagnosis' page: place of every kind of effect, next step by verdict, marks in the sketch."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rotorsim.discrepancy.decision import DecisionSteps
from rotorsim.discrepancy.discovery import DiscoveredLaw
from rotorsim.discrepancy.files import StoredPlan
from rotorsim.discrepancy.force_shape import ForceShape
from rotorsim.discrepancy.judge import NO_ACCURACY
from rotorsim.discrepancy.law_terms import MOMENTS, PART, PlaceMotion, force_curve, law_places, off_shaft, slipping
from rotorsim.discrepancy.machine_file import IdentifiedEffect
from rotorsim.discrepancy.records import ONE_EXCITATION, ONE_SPEED_ALONE
from rotorsim.discrepancy.result import PLAN_NEXT, RECORD_ALSO, TESTED_ON, located
from rotorsim.discrepancy.stochastic import StochasticForce
from rotorsim.discrepancy.verdict import Explanation
from rotorsim.effects import REGISTRY
from rotorsim.machine import Support, load_machine
from rotorsim.plant.locations import acting_places, nozzles
from rotorsim.report.diagnosis import HELD_OUT, UNTOUCHED, caption, diagnosis_page, force_over_motion, gap_bars
from rotorsim.report.machine_sketch import MARKS, machine_sketch
from rotorsim.report.page import html
from small_diagnosis import blocked, runout, small_diagnosis


def test_bearings_that_records_leave_open_stand_in_the_verdict():
    """2.9 +- .65 MN/m may be 1.5 times the 2.2 of the file."""
    key = "bearing.0.kx"
    narrow, wide = (
        small_diagnosis(status="no_disagreement", effects=[], localisation=(), calibration={key: (0.1, sd)})
        for sd in (0.02, 0.2)
    )
    assert narrow.left_open == () and "leave open" not in narrow.sentence and "Nothing needs" in narrow.next_step
    (one,) = wide.left_open
    assert one in wide.sentence and "+-" in one and "the file has" in one and "Nothing needs" not in wide.next_step


def test_an_unbalance_that_the_calibration_doubles_stands_in_a_peaceful_verdict():
    """Parts of a wave are changes to the file's own: as much again along its phase is twice the amplitude."""
    machine = load_machine("dtu_gas_bearing")
    (own,) = machine.effects["unbalance"]
    key, parts = "unbalance.1.me~phase", (own.me * np.cos(own.phase), own.me * np.sin(own.phase))
    for share, stated in ((1.0, True), (0.3, False)):
        calibration = {f"{key}.{part}": (share * size, 0.01 * own.me) for part, size in zip("cs", parts, strict=True)}
        found = small_diagnosis(status="no_disagreement", effects=[], localisation=(), calibration=calibration)
        found = replace(found, machine=machine)
        assert bool(found.moved) is stated and found.exit_code == 0
        assert all(one in found.sentence and "2 times larger" in one for one in found.moved)


@pytest.mark.parametrize("left", [0, 2])
def test_a_calibration_within_a_floor_that_nothing_states_excludes_no_effect(left):
    """The note has it that such records may be too coarse to disagree."""
    stated, open_still = (
        small_diagnosis(status="recalibrated", effects=[], large=("softer",), left=left, notes=notes)
        for notes in ((), (NO_ACCURACY,))
    )
    assert "agree" in stated.sentence and "stays open" not in stated.sentence
    assert "softer" in open_still.sentence and "stays open" in open_still.sentence
    assert not any(part in open_still.sentence for part in ("agree.", "no effect is missing"))
    assert (": 2." in open_still.sentence) == bool(left) and open_still.exit_code == 13


def page(found):
    return html(diagnosis_page(found))


@pytest.mark.parametrize("there", [("fit",), ("fit", "held_out"), ("fit", "untouched"),
                                   ("fit", "held_out", "untouched")])  # fmt: skip
def test_the_page_states_which_records_tested_a_law(there):
    law = DiscoveredLaw("law", "disc 1", 0.3, "", {}, {}, ("cubic",), "", "", 0.99)
    found = small_diagnosis(status="discovered", effects=[], discovered=law)
    found = replace(found, gap=found.gap.isel(record=np.isin(found.gap["role"].values, there)))
    text, best = page(found), there[-1]
    assert found.roles == there
    assert [words in found.texts.meaning for words in TESTED_ON.values()] == [role == best for role in TESTED_ON]
    for role, sentences in (("held_out", HELD_OUT), ("untouched", UNTOUCHED)):
        assert [sentence.strip() in text for sentence in sentences.values()] == [role in there, role not in there]


@pytest.mark.parametrize(("more", "form"), [({"source": "register_me = 1"}, "written as a file"), ({}, ""),
                                            ({"bearing": {"kind": "linear"}}, "hidden mass")])  # fmt: skip
def test_a_law_is_stated_to_be_the_file_that_it_is(more, form):
    law = replace(DiscoveredLaw("law", "disc 1", 0.3, "", {}, {}, ("cubic",), "", "", 0.99), **more)
    meaning = small_diagnosis(status="discovered", effects=[], discovered=law).texts.meaning
    assert form in meaning and ("file" in meaning) == bool(form)


def test_planes_of_a_record_are_not_labelled_as_repeats():
    found = small_diagnosis()
    names = [str(name) for name in found.gap["record"].values]
    points = ["2400 rpm"] * 2 + [f"{k} rpm" for k in range(len(names) - 2)]
    same = found.gap.assign_coords(point=("record", points), role=("record", ["fit"] * len(names)))
    labels = gap_bars(replace(found, gap=same)).data[0].y
    assert labels[:2] == tuple(f"fit: 2400 rpm, {name}" for name in names[:2]) and "fit: 0 rpm" in labels[2:]


LINE = {"point": "2400 rpm, 10 N", "frequency_hz": 62.5, "order": None, "force_n": 2.0, "unsteady": False,
        "direction": "along 0 deg from x", "residual_um": 1.0}  # fmt: skip
UNKNOWN = {"where": "at the disc", "lines": [LINE], "growth": {}, "groups": ["between"]}
PROPOSAL = {"experiment": "impact of 40 N at 300 rpm", "minutes": 3.0, "entropy_bit": 0.1, "chance_of_decision": 0.9}


@pytest.mark.parametrize(
    ("machine", "effect", "parameters", "part", "span"),
    [
        ("plain_rotor", "runout", {}, "probes", (0.3, 0.3)),
        ("plain_rotor", "unbalance", {}, "disc", (0.3, 0.3)),
        ("plain_rotor", "unbalance", {"position": 0.1}, "shaft", (0.1, 0.1)),
        ("plain_rotor", "ball_bearing", {"bearing": 1.0}, "bearing", (0.6, 0.6)),
        ("plain_rotor", "coupling", {}, "shaft", (0.0, 0.0)),
        ("plain_rotor", "shaft_bow", {}, "shaft", (0.0, 0.6)),
        ("plain_rotor", "internal_damping", {}, "shaft", (0.0, 0.6)),
        ("dtu_gas_bearing", "weak_injector", {"injector": 3.0}, "injector", (0.2366875, 0.2366875)),
        ("dtu_gas_bearing", "plenum_volume", {"injector": 0.0}, "bearing", (0.2166875, 0.2566875)),
        ("dtu_gas_bearing", "out_of_round", {}, "bearing", (0.2166875, 0.2566875)),
        ("dtu_gas_bearing", "hysteresis", {}, "bearing", (0.2166875, 0.2566875)),
        ("dtu_gas_bearing", "supply_droop", {}, "bearing", (0.2166875, 0.2566875)),
        ("dtu_gas_bearing", "ball_bearing", {}, "bearing", (0.0, 0.0)),
    ],
)
def test_an_effect_acts_where_its_port_and_its_parameters_put_it(machine, effect, parameters, part, span):
    (place,) = acting_places(load_machine(machine), REGISTRY[effect](**parameters))
    assert place.part == part and (place.begin, place.end) == pytest.approx(span)


@pytest.mark.parametrize("machine", ["plain_rotor", "dtu_gas_bearing", "aerostatic_spindle", "foil_turbo_rotor"])
@pytest.mark.parametrize("effect", sorted(REGISTRY))
def test_every_effect_that_a_machine_can_have_has_a_place_on_its_shaft(machine, effect):
    one = load_machine(machine)
    neutral = REGISTRY[effect].neutral(one, 0)
    for place in acting_places(one, neutral):
        assert one.shaft.start <= place.begin <= place.end <= one.shaft.end and place.name


def test_injectors_are_numbered_in_the_film_that_they_feed():
    spindle = load_machine("aerostatic_spindle")
    found = nozzles(spindle)
    assert len(found) == spindle.orifice_count and {one.bearing for one in found} == {0, 1}
    of_both = acting_places(spindle, REGISTRY["weak_injector"](injector=2.0))
    (of_one,) = acting_places(spindle, REGISTRY["weak_injector"](injector=2.0, bearing=1.0))
    assert len(of_both) == 2 and of_one == of_both[1] and of_one.nozzle.number == 2


def test_a_tie_marks_the_rivals_and_a_partial_explanation_the_equivalent_force():
    keys = ("runout.amplitude_1x", "shaft_bow.bow")
    tied = IdentifiedEffect("runout", keys[0], {"amplitude_1x": 1e-6, "phase_1x": 0.0}, {}, keys)
    found = small_diagnosis(status="tie", effects=[tied])
    assert [(one.role, one.places[0].part) for one in located(found)] == [("found", "probes"), ("rival", "shaft")]
    partly = small_diagnosis(status="partial", unknown=UNKNOWN)
    assert [one.role for one in located(partly)] == ["found", "force"]
    assert located(partly)[1].places[0].part == "disc"


def test_a_bearing_far_from_its_file_is_marked():
    """The number marks the bearing: names that contain one another do not confuse it."""
    (one,) = located(small_diagnosis(status="recalibrated", effects=[], large=("softer",), far_bearings=(1,)))
    assert (one.role, one.places[0].part, one.places[0].begin) == ("found", "bearing", pytest.approx(0.6))


def test_forces_and_probes_elsewhere_are_marked_where_they_are():
    """A probe of another plane is not at the disc's probes, a rival at a bearing not at the disc."""
    gain, seal = "sensor_gain.y of NDEy", "labyrinth_seal.damping of the bearing right"
    found = IdentifiedEffect("sensor_gain", gain, {"y": 0.1}, {}, (gain,), False)
    made = small_diagnosis(status="tie", effects=[found], ties=((seal,),), at={gain: 0.45, seal: 0.6})
    assert [(one.role, one.places[0].begin) for one in located(made)] == [("found", 0.45), ("rival", 0.6)]


def test_a_rival_of_another_injector_is_marked_at_that_injector():
    found = small_diagnosis("dtu_gas_bearing", "tie", [blocked()], ties=(("weak_injector.blocked of injector 1",),))
    assert [one.places[0].nozzle.number for one in located(found)] == [3, 1]


def test_the_sketch_marks_the_injector_with_its_number_and_the_bearing():
    found = small_diagnosis("dtu_gas_bearing", effects=[blocked()])
    marked = [(one.role, place) for one in located(found) for place in one.places]
    figure = machine_sketch(found.machine, marked)
    band, dot = (trace for trace in figure.data if trace.name == MARKS["found"][0])
    assert min(x for x in band.x if x is not None) < 236.7 < max(x for x in band.x if x is not None)
    assert dot.text == ("<b>3</b>",) and dot.y[0] < 0  # the lowest one


@pytest.mark.parametrize("machine", ["bently_rk4", "pump_on_tables", "grooved_turbo_rotor", "rigid_rotor_self_acting"])
def test_every_kind_of_machine_has_a_sketch(machine):
    names = {trace.name for trace in machine_sketch(load_machine(machine)).data}
    assert {"shaft", "bearing", "probes"} <= names


STORED = StoredPlan({"sentence": "Next: impact.", "proposals": [PROPOSAL], "unbreakable": []})
COARSE = small_diagnosis(status="unknown", effects=[], localisation=(), notes=(NO_ACCURACY,))
STEPS = {
    "named": (small_diagnosis(), "Inspect the probes at 300 mm; the new machine file holds the effect."),
    "nothing": (small_diagnosis(status="no_disagreement", effects=[]), "Use the re-calibrated machine file"),
    "tie": (small_diagnosis(status="tie"), "Inspect the probes at 300 mm: these records do not distinguish"),
    "plan": (small_diagnosis(planned=STORED), "Next: impact."),
    "partial": (small_diagnosis(status="partial", unknown=UNKNOWN), "Do not use the effect as found"),
    "unknown": (small_diagnosis(status="unknown", effects=[], unknown=UNKNOWN), "Look on the machine"),
    "no force": (small_diagnosis(status="unknown", effects=[], localisation=()), "Record again with more excitation"),
    "accuracy": (COARSE, "Nothing states"),
    "one speed": (
        small_diagnosis(status="no_disagreement", effects=[], notes=(ONE_SPEED_ALONE, ONE_EXCITATION)),
        "Use the re-calibrated machine file at this speed and for motions as large as these. Record 3 more speeds and "
        "diagnose again: a force that grows with the speed cannot be distinguished from stiffness and damping at one "
        "speed. "
        "Record the same points with half the excitation",
    ),
    "other groups left": (
        small_diagnosis(status="no_disagreement", effects=[], notes=(ONE_SPEED_ALONE, ONE_EXCITATION), left=1),
        "Record the points that the notes name again",
    ),
    "one amplitude": (
        small_diagnosis(status="no_disagreement", effects=[], notes=(ONE_EXCITATION,)),
        "Use the re-calibrated machine file for motions as large as these. Record the same points with half",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", STEPS)
def test_the_first_screen_states_the_next_step_of_every_verdict(case):
    found, begin = STEPS[case]
    assert found.next_step.startswith(begin)
    text = page(found)
    first = text.partition("<body>")[2].partition("The gap, record by record")[0]
    for part in (begin, "How probable each explanation is", "Where on the machine", "Gap before and after"):
        assert part in first
    assert "Infinity" not in first and "NaN" not in re.sub(r"log\. evidence.*?</table>", "", first)


UNSURE = tuple(replace(e, probability=p) for e, p in zip(small_diagnosis().explanations, (0.6, 0.3, 0.1), strict=True))
ENDED = DecisionSteps({"sure": 0.95}, end="budget")


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (small_diagnosis(status="tie"), True),
        (small_diagnosis(status="partial", unknown=UNKNOWN, explanations=UNSURE), True),
        (small_diagnosis(status="partial", unknown=UNKNOWN), False),  # one explanation has 95 %
        (small_diagnosis(), False),
        (small_diagnosis(status="tie", planned=STORED), False),
        (small_diagnosis(status="tie", steps=ENDED), False),
        (small_diagnosis(status="tie", explanations=()), False),  # without odds nothing can be planned
    ],
)
def test_a_tie_or_unsettled_odds_without_a_plan_state_how_to_get_one(found, expected):
    assert found.unplanned is expected
    assert (PLAN_NEXT in found.next_step) is expected


def test_without_odds_and_effects_the_page_has_a_sketch_without_marks():
    found = replace(small_diagnosis(status="no_disagreement", effects=[]), explanations=(), localisation=())
    assert "Nothing is marked" in page(found) and "How probable" not in page(found)


def test_a_tie_of_a_class_names_its_members_in_the_verdict():
    one = IdentifiedEffect("runout", "runout.amplitude_1x", {}, {}, ("runout.amplitude_1x", "shaft_bow.bow"))
    found = small_diagnosis(status="tie", effects=[one])
    assert found.sentence.endswith("runout.amplitude_1x, or, indistinguishable from it: shaft_bow.bow.")


def test_several_effects_are_all_marked():
    found = small_diagnosis("dtu_gas_bearing", effects=[blocked(), runout()])
    assert [one.places[0].part for one in located(found)] == ["injector", "probes"]


def test_the_band_of_a_law_is_two_standard_deviations_about_it_along_each_axis():
    u = np.array([[2e-6, 1e-6], [-1e-6, 0.0], [0.0, 3e-6]])
    curve = {"displacement": u, "velocity": u, "measured": 2e6 * u, "law": 1e6 * u, "spread": 1e5 * np.abs(u)}
    law = DiscoveredLaw("law", "disc 1", 0.3, "", {}, {}, ("cubic",), "", "", 0.99, curve=curve)
    bands = [trace for trace in force_over_motion(law.curve).data if trace.name == "band"]
    for i, band in enumerate(bands):
        there = np.sort(u[:, i])
        upper, lower = np.split(np.array(band.y), [3])
        assert np.array(band.x) == pytest.approx(1e6 * np.concatenate([there, there[::-1]]))
        assert upper - 1e6 * there == pytest.approx(2e5 * np.abs(there))
        assert lower[::-1] - 1e6 * there == pytest.approx(-2e5 * np.abs(there))
    assert len(bands) == 2


@pytest.mark.parametrize("remembers", [True, False])
def test_a_force_is_drawn_over_the_motion_of_which_it_is_a_function_and_a_memory_as_its_loop(remembers):
    """Dry friction is a function of the velocity; a spring that slips is one of neither."""
    t = 2 * np.pi * np.arange(200) / 200
    u, v = (2e-6 * np.column_stack([wave(t), wave(t + 1)]) for wave in (np.sin, np.cos))
    force = np.column_stack([slipping(one, 5e-7) for one in u.T]) if remembers else 1e-6 * np.tanh(3e6 * v)
    curve = {"displacement": u, "velocity": v, "measured": force, "law": force, "spread": 0.1 * np.abs(force)}
    traces = force_over_motion(curve).data
    drawn = [np.array(one.x) for one in traces if one.name == "model"]
    assert any(one.name == "band" for one in traces) != remembers
    assert f"{100 * PART:.0f} % of a record's period" in caption(force_over_motion(curve))
    for x, moved, velocity in zip(drawn, u.T, v.T, strict=True):
        assert x == pytest.approx(1e6 * moved if remembers else 1e3 * np.sort(velocity))


@pytest.mark.parametrize("status", ["named", "tie", "partial", "unknown"])
@pytest.mark.parametrize("note", [ONE_EXCITATION, ONE_SPEED_ALONE])
def test_the_next_step_states_what_records_of_one_speed_or_one_amplitude_lack(status, note):
    found = small_diagnosis(status=status, unknown=UNKNOWN, notes=(note,))
    assert RECORD_ALSO[note][1] in found.next_step
    assert RECORD_ALSO[note][1] not in replace(found, notes=()).next_step


@pytest.mark.parametrize(("status", "gone", "headline"), [("unknown", 0.924, True), ("unknown", 0.4, False),
                                                          ("partial", 0.924, False)])  # fmt: skip
def test_a_force_whose_law_is_not_known_stands_in_the_headline_and_is_marked(status, gone, headline):
    machine = load_machine("plain_rotor")
    *_, (place, z) = law_places(machine).items()
    shape = ForceShape(place, z, 900.0, gone, {"displacement": 300.0}, {})
    found = small_diagnosis(status=status, effects=[], unknown=UNKNOWN, shape=shape)
    assert (f"a force at {place} explains 92 %" in found.sentence) == headline
    assert found.next_step.startswith(f"Look at {place} ") == headline
    marked = [one for one in located(found) if one.role == "force"]
    assert [p.begin <= z <= p.end for one in marked for p in one.places] == [headline]


@pytest.mark.parametrize(("n", "share"), [(MOMENTS // 5, 1.0), (2048, PART), (8192, PART)])
def test_a_force_is_shown_in_a_part_of_the_period_about_the_largest_motion(monkeypatch, n, share):
    """The motion is nearly a circle, so that its angle is the time; 499 of 2048 moments are 3 % less than a quarter."""
    angle = 2 * np.pi * np.arange(n) / n
    u = np.array([1.001 * np.cos(angle), np.sin(angle)])
    monkeypatch.setattr("rotorsim.discrepancy.law_terms.complex_lines", lambda *given: np.zeros((2, 9)))
    motion = PlaceMotion(u, u, angle, 1.0, np.zeros((9, 2, 2)), np.arange(9.0))
    seen = SimpleNamespace(motions={"disc": [motion]}, comparison=SimpleNamespace(sigma=None))
    shown = force_curve(seen, "disc", None, lambda m: (m.displacement, m.displacement))["displacement"]
    seen_angle = np.unwrap(np.arctan2(shown[:, 1], shown[:, 0]))
    assert np.ptp(seen_angle) == pytest.approx(2 * np.pi * share, rel=0.03)
    assert seen_angle[len(shown) // 2] == pytest.approx(0.0, abs=1e-9) or share == 1.0


def test_what_an_unknown_verdict_has_beyond_the_catalogue_is_one_explanation():
    two = tuple(Explanation((key,), True, 0.0, 0.0, True, 0.4) for key in ("runout.amplitude_2x", "shaft_bow.bow"))
    odds = (*two, Explanation((), False, 0.0, 0.0, True, 0.2))
    found = small_diagnosis(status="unknown", effects=[], explanations=odds)
    assert [(e.effects, e.beyond, e.probability) for e in found.leading] == [((), True, 0.8), ((), False, 0.2)]
    assert replace(found, status="partial").leading == odds


def test_what_does_not_repeat_and_a_law_are_marked_at_their_places_by_name():
    machine = load_machine("plain_rotor")
    (disc, z), *_, (bearing, end) = law_places(machine).items()
    line = StochasticForce("line", bearing, (disc,), (1.0, 1.0), (0.1, 0.1), "N rms", 100.0, 0.42)
    found = small_diagnosis(status="stochastic", effects=[], unknown=UNKNOWN, stochastic=line)
    [marked] = located(found)
    assert [(p.part, p.begin <= at <= p.end) for p, at in zip(marked.places, (end, z), strict=True)] == [
        ("bearing", True), ("disc", True)]  # fmt: skip
    law = DiscoveredLaw("law", bearing, end, "", {}, {}, ("cubic",), "", "", 0.99)
    [marked] = located(small_diagnosis(status="discovered", effects=[], discovered=law))
    assert [p.part for p in marked.places] == ["bearing"] and marked.places[0].name.startswith(bearing)


@pytest.mark.parametrize(("influence", "beginning"), [("housing", "the housing of bearing 1 "),
                                                      ("between", "bearing 1 ")])  # fmt: skip
def test_a_law_and_an_effect_on_a_housing_are_marked_at_its_bearing(influence, beginning):
    support = Support(mass="1 kg", kxx="10 MN/m")
    machine = load_machine("plain_rotor").with_({"bearings.1.support": support})
    place = next(name for name, moving in off_shaft(machine).items() if moving == influence)
    law = DiscoveredLaw("law", place, 0.6, "", {}, {}, ("cubic",), "", "", 0.99)
    found = small_diagnosis(status="discovered", effects=[], discovered=law)
    [marked] = located(replace(found, machine=machine))
    effect = SimpleNamespace(port="motion", influence=influence, place="disc", position=0.6)
    assert marked.places == acting_places(machine, effect)
    assert marked.places[0].part == "bearing" and marked.places[0].name.startswith(beginning)
