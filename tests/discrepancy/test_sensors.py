"""Records of laboratories that a diagnosis cannot use end in one sentence."""

import numpy as np
import pytest

from identification import make_record
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data.intake import make_trials
from rotorsim.machine import load_machine

N = 5000
T = np.arange(N) / 5000


def record(attrs=None, **values):
    disc = 1e-6 * np.column_stack([np.cos(100 * np.pi * T), np.sin(100 * np.pi * T)])
    return make_record(T, {"disc_measured": disc} | values, attrs or {})


def single():
    own = {"probe": ["A"], "probe_unit": ["m"]}
    return make_record(T, {"probe_measured": np.zeros((N, 1)), "speed": np.full(N, 314.0)}, probes=own)


@pytest.mark.parametrize(
    ("made", "shown"),
    [
        (record(), "a: has no speed and no keyphasor; map one, or state"),
        (single(), "a: has readings of A, which are not x and y of the disc"),
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
