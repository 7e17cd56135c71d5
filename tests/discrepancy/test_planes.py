"""Probes of all planes take part, in their own directions; a plane of the twin is another row of its modes."""

from dataclasses import replace

import numpy as np
import pytest

from identification import make_record
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.changes import MAIN, PLANE, RING_KEY
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.diagnosis import by_probe
from rotorsim.discrepancy.records import make_trials, plane_notes
from rotorsim.machine import load_machine

SPEED, N, TS = 2 * np.pi * 30.0, 6000, 2e-4
SECOND = 0.15
"""Plane [m] of the second pair of probes: a quarter of the span."""
ANGLES = np.deg2rad([45.0, 135.0])


@pytest.fixture(scope="module")
def plain():
    return load_machine("plain_rotor").with_({"effects.gravity.acceleration": 0.0})


@pytest.fixture(scope="module")
def record(plain):
    """Circular motion of 5 um at the disc and of 3 um at the second plane, read by pairs at 45 and 135 deg."""
    t = np.arange(N) * TS
    angle = SPEED * t
    probe = np.column_stack([3e-6 * np.cos(angle - a) for a in ANGLES])
    values = {"disc_measured": 5e-6 * np.column_stack([np.cos(angle), np.sin(angle)]), "angle_measured": angle,
              "speed_measured": np.full(N, SPEED), "probe_measured": probe}  # fmt: skip
    coords = {"probe": ["2L", "2R"], "probe_quantity": ["relative_displacement"] * 2, "probe_unit": ["m"] * 2,
              "probe_position": [SECOND] * 2, "probe_angle": list(ANGLES), "probe_gain": [1.0, 1.0]}  # fmt: skip
    attrs = {"record": "r", "disc_probes": "1L, 1R", "disc_probe_angles": list(ANGLES)}
    return make_record(t, values, attrs, probes=coords)


def test_a_record_of_two_planes_is_two_trials_along_the_probes(plain, record):
    """Along a probe at the angle a the circle of radius r reads r cos(angle - a)."""
    first, second = sorted(make_trials(plain, [("r", record)], None), key=lambda t: t.other_plane)
    assert first.names == ("1L", "1R") and second.names == second.channels == ("2L", "2R")
    assert second.changes == {PLANE: SECOND, RING_KEY: pytest.approx(ANGLES[0])}
    assert first.changes == {RING_KEY: pytest.approx(ANGLES[0])} and not first.stated_changes
    for trial, size in ((first, 5e-6), (second, 3e-6)):
        k = int(np.argmax(np.abs(trial.spectra[0, 0, 1:]))) + 1
        assert np.abs(trial.spectra[0, :, k]) == pytest.approx(size, rel=1e-4)  # no line holds whole turns exactly


def test_the_twin_reads_another_plane_with_the_shape_of_its_shaft(plain, models, record):
    """The static sag of a heavy symmetric rotor at a quarter of the span follows from Euler's beam.

    w(x) / w(L/2) = (3 x / L - 4 (x / L)^3) for a central load on simple supports, here with stiff bearings and shear.
    """
    trials = make_trials(load_machine("plain_rotor"), [("r", record)], None)
    table = {}
    for t in trials:
        rows = np.zeros((200, 6))
        values = {k: v for k, v in t.changes.items() if k == PLANE}
        table[t.other_plane] = models.twin.run(values, rows, 0.0)[-1, 1]
    x = SECOND / 0.6
    assert table[True] / table[False] == pytest.approx(3 * x - 4 * x**3, rel=0.05)


def test_a_gain_of_one_probe_changes_its_plane_alone(plain, models, record):
    trials = make_trials(load_machine("plain_rotor"), [("r", record)], None)
    comparison = TwinComparison(models.twin, trials)
    one = FitParameter("shaft_bow.0.bow~phase.c", 1e-6, plane=SECOND)
    point, there = ParameterPoint(), ParameterPoint({one: 2e-6})
    moved = comparison.predict(there) - comparison.predict(point)
    planes = np.array([t.other_plane for t in trials])[comparison.layout.record]
    assert np.any(moved[planes]) and not np.any(moved[~planes])


def test_sensor_forms_stand_for_every_probe_of_several_planes(models, record):
    machine = load_machine("plain_rotor")
    trials = make_trials(machine, [("r", record)], None)
    forms = by_probe(candidates(models.twin), trials)
    own = {f.key: f.parameters[0].plane for f in forms if f.effect == "runout"}
    assert set(own) and all(" of 1L and 1R" in k or " of 2L and 2R" in k for k in own)
    assert set(own.values()) == {MAIN, SECOND}
    assert by_probe(candidates(models.twin), [t for t in trials if not t.other_plane]) == candidates(models.twin)


def test_probes_without_a_place_are_left_out_in_a_sentence(plain, record):
    lost = record.assign_coords(probe_position=("probe", [np.nan, np.nan]))
    assert len(make_trials(plain, [("r", lost)], None)) == 1
    assert "2L" in plane_notes(plain, [("r", lost)])[0] and not plane_notes(plain, [("r", record)])


def test_other_probes_of_one_plane_are_not_the_same_record(plain, record):
    from rotorsim.discrepancy.data_vector import repeats

    first, second = make_trials(plain, [("r", record)], None)
    assert repeats(first, replace(first, name="again")) and not repeats(first, second)
