"""Error of the model's form: its correlation between lines of records and rows of vectors."""

import numpy as np
import pytest

from identification import make_vectors
from rotorsim.discrepancy.data_vector import make_layout
from rotorsim.discrepancy.evidence import BAND, SPEED, lines_of, model_form
from rotorsim.discrepancy.run_ups import make_sweeps
from rotorsim.discrepancy.trial import planned_trial

HZ = 2 * np.pi
SPEEDS = HZ * np.linspace(10.0, 33.0, 24)


def record(hertz):
    """A record of 2 s without excitation at a constant speed [Hz]."""
    rows = np.zeros((10000, 6))
    rows[:, 0] = HZ * hertz
    return planned_trial(f"at {hertz:g} Hz", rows)


def table(speeds):
    """Vectors of 1X, 2X, 3X at speeds [rad/s], all of one use."""
    empty = np.zeros((len(speeds), 3, 2))
    return make_sweeps(make_vectors(speeds, empty + 1e-6, empty, (1, 2, 3), {"rate": 20.0}), "t", False, "fit")[0]


def covariance(trials, of=lambda layout: np.ones(len(layout.record))):
    """Layout, and the covariance (n, n) of the error at a relative size of 1, of responses of one floor each."""
    layout = make_layout(trials)
    form = model_form(layout, trials, np.where(layout.frequency > 0, of(layout), 0.0))
    return layout, (form.directions * form.variances) @ form.directions.T


def real_lines(layout, record):
    """Numbers of the real parts of a record's lines of x, in the order of the lines."""
    own = np.flatnonzero((layout.record == record) & (layout.channel == 0) & (layout.frequency > 0))
    return own[: len(own) // 2]


def test_a_row_lies_at_its_speed_and_at_that_times_its_order():
    trials = [record(20.0), table(SPEEDS)]
    layout = make_layout(trials)
    lines, own = lines_of(layout, trials), real_lines(layout, 1)
    np.testing.assert_allclose(lines.frequency[own].reshape(3, 24), np.outer([1, 2, 3], SPEEDS) / HZ)
    np.testing.assert_allclose(lines.points[lines.point[own], 0] * SPEED, np.tile(SPEEDS, 3))
    of_record = layout.record == 0
    np.testing.assert_array_equal(lines.frequency[of_record], layout.frequency[of_record])
    assert np.ptp(lines.point[of_record]) == 0


def test_records_alone_lie_where_their_layout_states():
    trials = [record(20.0), record(30.0)]
    layout = make_layout(trials)
    lines = lines_of(layout, trials)
    np.testing.assert_array_equal(lines.frequency, layout.frequency)
    np.testing.assert_array_equal(lines.point, layout.record)
    assert not lines.has_rows


@pytest.mark.parametrize("rows", [[*range(0, 24, 2), 23], list(range(24))[::-1]], ids=["every second", "falling"])
def test_the_error_of_rows_depends_on_their_speed_and_not_on_their_number(rows):
    """Up to the directions that are left out, a millionth of the largest."""
    layout, all_rows = covariance([table(SPEEDS)])
    chosen = real_lines(layout, 0).reshape(3, 24)[:, rows].ravel()
    layout, own = covariance([table(SPEEDS[rows])])
    mine = real_lines(layout, 0)
    np.testing.assert_allclose(own[np.ix_(mine, mine)], all_rows[np.ix_(chosen, chosen)], atol=1e-3)


def share_of(f, g, between, highest):
    """Correlation of the error at two frequencies [Hz] of points `between` [Hz] apart in speed, by hand."""
    nodes = np.linspace(0.0, highest, int(np.ceil(highest / BAND)) + 1)
    a, b = (np.array([np.interp(one, nodes, row) for row in np.eye(len(nodes))]) for one in (f, g))
    return a @ b / np.sqrt((a @ a) * (b @ b)) * np.exp(-0.5 * (HZ * between / SPEED) ** 2)


def test_rows_close_in_speed_share_their_error_and_rows_far_apart_less():
    layout, C = covariance([table(SPEEDS)])
    first = real_lines(layout, 0)[:24]  # 1X, a row each Hz
    share = C[first[0], first] / np.sqrt(C[first[0], first[0]] * np.diag(C)[first])
    expected = [share_of(10.0, 10.0 + k, k, 99.0) for k in range(24)]
    np.testing.assert_allclose(share, expected, atol=1e-3)
    assert share[1] > 0.99 and share[-1] < 0.4


def test_a_row_shares_its_error_with_the_line_of_a_record_at_its_speed():
    trials = [record(20.0), table(SPEEDS)]
    layout, C = covariance(trials)
    line = next(i for i in real_lines(layout, 0) if layout.frequency[i] == 20.0)
    of_rows = real_lines(layout, 1).reshape(3, 24)
    share = C[line, of_rows] / np.sqrt(C[line, line] * np.diag(C)[of_rows])
    at = int(np.argmin(np.abs(SPEEDS - HZ * 20.0)))
    assert share[0, at] == pytest.approx(1.0, abs=1e-3) and share[0].argmax() == at
    assert share[1, at] == pytest.approx(share_of(20.0, 40.0, 0.0, 300.0), abs=1e-3)


def test_rows_without_a_response_leave_the_records_their_error():
    records = [record(20.0), record(40.0)]
    layout, alone = covariance(records)
    mixed_layout, mixed = covariance([*records, table(SPEEDS)], lambda one: one.record < 2)
    n = len(layout.record)
    np.testing.assert_allclose(mixed[:n, :n], alone, atol=1e-3)
    assert not mixed[n:].any() and len(mixed_layout.record) > n
