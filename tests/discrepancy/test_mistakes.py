"""Mistakes with probes: named before anything is fitted, by the shape of the motion at all planes."""

import numpy as np
import pytest

from identification import make_record
from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.mistakes import check_probes
from rotorsim.discrepancy.records import make_trials
from rotorsim.machine import load_machine

N, TS, SECOND = 6000, 2e-4, 0.15
SPEEDS = (20.0, 30.0, 37.0)
OFF = ParameterPoint({FitParameter(f"bearing.{i}.k{a}", 0.1): v for (i, a), v in
                      {(0, "x"): -0.2, (0, "y"): 0.15, (1, "x"): 0.1, (1, "y"): -0.1}.items()}
                     | {FitParameter("unbalance.0.me~phase.s", 1e-6): 2e-5})  # fmt: skip
"""Supports that are 10 to 20 % off, and another unbalance."""


@pytest.fixture(scope="module")
def comparison(models):
    """Steady records of two planes at three speeds, without numbers yet."""
    opened = []
    for i, hertz in enumerate(SPEEDS):
        t = np.arange(N) * TS
        angle = 2 * np.pi * hertz * t
        circle = np.column_stack([np.cos(angle), np.sin(angle)])
        values = {"disc_measured": circle, "angle_measured": angle, "speed_measured": np.full(N, 2 * np.pi * hertz),
                  "probe_measured": circle}  # fmt: skip
        coords = {"probe": ["2X", "2Y"], "probe_quantity": ["relative_displacement"] * 2, "probe_unit": ["m"] * 2,
                  "probe_position": [SECOND] * 2, "probe_angle": [0.0, np.pi / 2], "probe_gain": [1, 1]}  # fmt: skip
        attrs = {"record": f"r{i}", "disc_probes": "1X, 1Y", "disc_probe_angles": [0.0, np.pi / 2]}
        opened.append((f"r{i}", make_record(t, values, attrs, probes=coords)))
    return TwinComparison(models.twin, make_trials(load_machine("plain_rotor"), opened, None))


def measured(comparison, change, plane, point=OFF):
    """The twin's readings at a point, those of a plane (0, 1; None for both) through a change (2, 2)."""
    y = comparison.predict(point)
    out = y.copy()
    for i, trial in enumerate(comparison.trials):
        if plane is None or trial.other_plane == bool(plane):
            for own, lines in zip(comparison.numbers_of(i), change @ comparison.lines_of(i, y), strict=True):
                out[own] = np.concatenate([lines.real, lines.imag])
    return out


SWAP, QUARTER = np.array([[0, 1], [1, 0]]), np.array([[0, 1], [-1, 0]])
CASES = {
    "2X and 2Y are exchanged": (SWAP, 1), "1X and 1Y are exchanged": (SWAP, 0),
    "probe 1Y is reversed": (np.diag([1, -1]), 0), "probe 2X is reversed": (np.diag([-1, 1]), 1),
    "2X and 2Y are turned by": (QUARTER, 1), "2X and 2Y are both reversed": (-np.eye(2), 1),
}  # fmt: skip


@pytest.mark.parametrize("sentence", CASES)
def test_a_mistake_with_the_probes_of_a_plane_is_named(comparison, sentence):
    comparison.measured = measured(comparison, *CASES[sentence])
    with refused(DataError, "probes", lambda value: bool(value)) as found:
        check_probes(comparison, comparison.predict(ParameterPoint()))
    assert sentence in str(found.value)


@pytest.mark.parametrize("factor", [1.0, 0.4, 2.5])
def test_supports_that_are_far_off_are_no_mistake_with_the_probes(comparison, factor):
    point = ParameterPoint({**OFF.values, FitParameter("bearing.1.kx", 0.1): 1 - 1 / factor,
                            FitParameter("bearing.1.ky", 0.1): 1 - 1 / factor})  # fmt: skip
    comparison.measured = measured(comparison, np.eye(2), None, point)
    check_probes(comparison, comparison.predict(ParameterPoint()))


def test_a_shaft_that_turns_the_other_way_is_named(comparison):
    """In both planes the orbit is mirrored, which no mistake with one plane does."""
    comparison.measured = measured(comparison, np.diag([1, -1]), None)
    with refused(DataError, "probes", "the rotation is in the other sense"):
        check_probes(comparison, comparison.predict(ParameterPoint()))
