"""Orders in periods of the excitation that hold no whole turns: on one line, alike in all blocks."""

import numpy as np
import pytest

from rotorsim.base.units import RIG_SAMPLE
from rotorsim.discrepancy.trial import HIGHEST, block_lines, broken_orders, on_lines

LENGTH, BLOCKS, START = 2000, 4, 300
WINDOW = (START, LENGTH, BLOCKS)


def displacement(speed):
    """Lines of the excitation, an offset, and 1X (3 um) and 2X (1 um) with their phases."""
    k = np.arange(START + BLOCKS * LENGTH)
    excited = 1e-6 * (5 + np.cos(2 * np.pi * 11 * k / LENGTH) + np.sin(2 * np.pi * 59 * k / LENGTH + 0.3))
    a = 0.4 + speed * RIG_SAMPLE * k
    return np.column_stack([excited + 3e-6 * np.cos(a - 0.5), excited + 1e-6 * np.sin(2 * a)])


@pytest.mark.parametrize("hertz", [41.3, 20.83, 66.0])
def test_orders_off_the_lines_come_to_one_line_and_leave_the_others_alone(hertz):
    speed = 2 * np.pi * hertz
    orders = broken_orders(speed, LENGTH, BLOCKS, HIGHEST)
    assert {1, 2} <= set(orders.tolist())
    moved = on_lines(displacement(speed), WINDOW, speed, 0.4, orders)
    lines = block_lines(moved, *WINDOW, 121)
    np.testing.assert_allclose(lines - lines.mean(axis=0), 0.0, atol=1e-12)
    own = [round(hertz * LENGTH * RIG_SAMPLE), round(2 * hertz * LENGTH * RIG_SAMPLE)]
    assert abs(lines[0, 0, own[0]]) == pytest.approx(3e-6, rel=1e-6)
    assert abs(lines[0, 1, own[1]]) == pytest.approx(1e-6, rel=1e-6)
    assert abs(lines[0, 0, 11]) == pytest.approx(1e-6, rel=1e-6)
    quiet = np.setdiff1d(np.arange(121), [0, 11, 59, *own])
    assert np.abs(lines[:, :, quiet]).max() < 1e-12


def test_whole_turns_are_left_as_they_are():
    speed = 2 * np.pi * 42.5
    assert not len(broken_orders(speed, LENGTH, BLOCKS, HIGHEST))
    y = displacement(speed)
    assert on_lines(y, WINDOW, speed, 0.4, np.zeros(0)) is y
