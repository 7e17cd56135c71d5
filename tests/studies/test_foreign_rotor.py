"""Rotor of beam elements that shares no code with rotorsim: its gyroscopic moments, its stop, the judge of its set."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eig

from studies.benchmarks.foreign_rotor import (
    ACCURACY,
    BEARINGS,
    DISCS,
    HERTZ,
    TwoDiscRig,
    least_damping,
    left_by_sound,
    response,
    rotor,
)
from studies.benchmarks.foreign_set import FAINT, FAULTS, drawn, judged, summary, with_result


def whirls(sense: int, hertz: float) -> dict[int, float]:
    """Lowest natural frequency [Hz] on isotropic undamped supports that whirls with (1) and against (-1) x to y."""
    round_supports = tuple((kx, kx, 0.0, 0.0) for _, kx, *_ in BEARINGS)
    M, C, K = rotor(TwoDiscRig(round_supports, (), sense=sense), 2 * np.pi * hertz, 0.0)
    n = len(K)
    zero, one = np.zeros((n, n)), np.eye(n)
    poles, shapes = eig(np.block([[zero, one], [-K, -C]]), np.block([[one, zero], [zero, M]]))
    found: dict[int, float] = {}
    for i in np.argsort(np.abs(poles.imag)):
        if poles[i].imag > 1.0:
            x, y = shapes[:n:4, i], shapes[1:n:4, i]
            # x = cos, y = sin is the phasor y = -i x
            found.setdefault(int(np.sign(-np.imag(np.conj(x) @ y))), float(poles[i].imag / (2 * np.pi)))
    return found


@pytest.mark.parametrize("sense", [1, -1])
def test_the_forward_mode_rises_with_the_speed_and_the_backward_mode_falls(sense):
    still = whirls(sense, 1e-3)
    turning = whirls(sense, 200.0)
    assert still[1] == pytest.approx(still[-1], rel=1e-4)
    assert turning[sense] > 1.02 * still[sense]
    assert turning[-sense] < 0.98 * still[-sense]


@pytest.mark.parametrize(
    ("answers", "found", "outcome"),
    [
        (("bearing right",), ("recalibrated", "", (), (), ("kxx of the bearing right is 1",)), "place"),
        (("bearing right",), ("recalibrated", "", (), (), ("the bearing right is 1", "Young's modulus is 2")),
         "WRONG place"),
        (("bearing right",), ("recalibrated", "", (), (), ("one of these places: bearing left or bearing right",)),
         "class"),
        (("bearing right",), ("no_disagreement", ""), "false peace"),
        (("nothing",), ("no_disagreement", ""), "nothing"),
        (("shaft_bow",), ("named", "", ("shaft_bow.bow",)), "name"),
        (("shaft_bow",), ("named", "", ("rub",)), "WRONG name"),
        (("shaft_bow",), ("tie", "", ("runout",), ("shaft_bow.bow",)), "class"), (("x",), ("unknown", ""), "silent"),
        (("bearing right", "faint"), ("no_disagreement", ""), "missed"), (("shaft_bow",), ("named", ""), "WRONG name"),
        (("probes: is reversed",), ("refused", "probe 2L is reversed", (), (), (), "probes"), "mistake"),
        (("probes: is reversed",), ("refused", "probe 2L is turned", (), (), (), "probes"), "WRONG mistake"),
        (("speed: turns",), ("refused", "at this speed the shaft turns", (), (), (), "units"), "WRONG mistake"),
    ],
)  # fmt: skip
def test_a_verdict_is_right_by_its_name_its_place_or_its_class_alone(answers, found, outcome):
    assert judged(answers, *found) == outcome


def test_the_truth_holds_all_that_is_drawn_and_every_support_is_off():
    """A sound machine has every number of a support 10 to 20 % off that of the file."""
    case = drawn(FAULTS[0], 1)
    assert case == drawn(FAULTS[0], 1) != drawn(FAULTS[0], 2) and case.truth["rig"]["unbalance"] == case.rig.unbalance
    off = np.abs(np.array(case.rig.bearings) / np.array(BEARINGS)[:, 1:] - 1)
    assert np.all((off > 0.1) & (off < 0.2)) and len({f.name for f in FAULTS}) == len(FAULTS) >= 20


def test_the_truth_of_a_fault_does_not_depend_on_the_others(monkeypatch):
    """Every draw follows from the seed and the fault's name."""
    last = drawn(FAULTS[-1], 1)
    monkeypatch.setattr("studies.benchmarks.foreign_set.FAULTS", FAULTS[-1:])
    assert drawn(FAULTS[-1], 1) == last


@pytest.mark.parametrize(("name", "seed", "shown"), [("left bearing less damped", 1, False), ("bow", 1, True)])
def test_what_a_sound_machine_makes_as_well_is_too_faint_to_be_shown(name, seed, shown):
    """Decided by the generator alone: nothing is left of what a sound machine itself makes."""
    case = drawn(next(f for f in FAULTS if f.name == name), seed)
    assert (FAINT in case.answers) == (not shown)
    assert left_by_sound(TwoDiscRig(case.rig.bearings, case.rig.unbalance)).max() < ACCURACY


def test_a_result_is_kept_for_its_own_truth_and_sources_alone(tmp_path, monkeypatch):
    path, runs = tmp_path / "case.json", []

    def asked(seed):
        return with_result(drawn(FAULTS[0], seed), path, lambda: runs.append(seed) or {"outcome": "place"})

    assert asked(1) == asked(1) == json.loads(path.read_text()) and asked(1)["outcome"] == "place"
    assert runs == [1]
    asked(2)
    monkeypatch.setattr("studies.benchmarks.foreign_set.sources_hash", lambda *places: "others")
    asked(2)
    assert runs == [1, 2, 2]


def test_sizes_of_all_verdicts_count():
    results = [{"outcome": "place", "deviations": {"a": 1.0}}, {"outcome": "WRONG name", "deviations": {"a": -9.0}}]
    assert "1 of 2 sizes within" in summary(results) and summary(results).startswith("1 of 2 right")


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_every_rotor_of_the_set_is_stable(fault):
    """Its records are of a steady motion: of an unstable rotor there is none, though the forced response has one."""
    rig = drawn(fault, 1).rig
    assert min(least_damping(rig, 2 * np.pi * hertz) for hertz in (min(HERTZ), max(HERTZ))) > 1e-3
    assert least_damping(replace(rig, seal=1e6), 2 * np.pi * max(HERTZ)) < 0


def test_a_stop_pushes_only_beyond_its_gap():
    rig, speed = drawn(next(f for f in FAULTS if f.name == "stop"), 1).rig, 2 * np.pi * 43
    free = response(TwoDiscRig(rig.bearings, rig.unbalance), speed)
    far = response(TwoDiscRig(rig.bearings, rig.unbalance, stop=(rig.stop[0], 1e-3)), speed)
    near = response(rig, speed)
    at = 4 * DISCS[1][0] + 1
    assert np.allclose(far[1][1], free[1][1]) and near[0][at] < free[0][at] and abs(near[1][2][at]) > 1e-8
