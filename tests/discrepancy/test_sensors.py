"""Records of laboratories that a diagnosis cannot use end in one sentence."""

import numpy as np
import pytest

from identification import make_record
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.records import make_trials, record_notes
from rotorsim.machine import load_machine

N = 5000
T = np.arange(N) / 5000


def record(attrs=None, **values):
    disc = 1e-6 * np.column_stack([np.cos(100 * np.pi * T), np.sin(100 * np.pi * T)])
    return make_record(T, {"disc_measured": disc} | values, attrs or {})


PROBE = {"probe_quantity": "relative_displacement", "probe_angle": 0.5, "probe_gain": 1.0, "probe_position": 0.3}


def probes(*names, **more):
    own = {"probe": list(names), "probe_unit": ["m"] * len(names)} | {k: [v] * len(names) for k, v in more.items()}
    reading = 1e-6 * np.tile(np.cos(100 * np.pi * T)[:, None], (1, len(names)))
    return make_record(T, {"probe_measured": reading, "speed": np.full(N, 100 * np.pi)}, probes=own)


@pytest.mark.parametrize(
    ("made", "shown"),
    [
        (record(), "a: has no speed and no keyphasor; map one, or state"),
        (probes("A"), "a: has readings of A, which are not x and y of the disc.*with its angle"),
        (probes("A", "B", **PROBE), "a: has readings of A, B, which are not x and y of the disc"),
        (probes("A", **PROBE | {"probe_quantity": "housing_velocity"}), "a: has readings of A, which are not"),
        (probes("A", **PROBE | {"probe_position": 0.1}), "a: its probes stand at 100 mm, the machine file's at 300 mm"),
        (
            record({"disc_position": 0.52}, speed=np.full(N, 100 * np.pi)),
            "a: its probes stand at 520 mm, the machine file's at 300 mm; set",
        ),
    ],
)
def test_a_record_that_does_not_fit_is_refused(made, shown):
    with pytest.raises(DataError, match=shown):
        make_trials(load_machine("plain_rotor"), [("a", made)], None)


def test_a_record_of_the_probes_plane_is_taken():
    made = record({"disc_position": 0.3}, speed=np.full(N, 100 * np.pi))
    assert len(make_trials(load_machine("plain_rotor"), [("a", made)], None)) == 1


def test_a_single_probe_reads_its_direction_of_the_motion():
    (trial,) = make_trials(load_machine("plain_rotor"), [("a", probes("A", **PROBE))], None)
    assert trial.channels == ("probe at 28.65 deg",)
    motion = 1e-6 * np.column_stack([np.cos(100 * np.pi * T), np.sin(100 * np.pi * T)])
    seen = trial.lines(motion)
    order = np.argmin(np.abs(trial.frequencies - 50))
    assert abs(seen[0, 0, order]) == pytest.approx(1e-6, rel=1e-6)
    assert np.angle(seen[0, 0, order] / trial.spectra[0, 0, order]) == pytest.approx(-0.5, abs=1e-6)
    assert not seen[:, 1].any() and not trial.spectra[:, 1].any()


def test_notes_of_records_are_told_once():
    first, second = (record({"notes": notes}) for notes in (["A is dead", "cut"], "cut"))
    assert record_notes([("a", first), ("b", second)]) == ["'a': A is dead", "every record: cut"]
