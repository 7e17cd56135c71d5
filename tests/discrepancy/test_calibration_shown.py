"""Calibration as a diagnosis shows it: numbers of the machine file before and after, and what else was fitted."""

from math import pi

import numpy as np
import pytest

from rotorsim.discrepancy.machine_file import CLOCK, Findings
from rotorsim.discrepancy.twin import of_bearing
from rotorsim.machine import Machine, load_machine
from rotorsim.machine.file_text import without
from rotorsim.report.diagnosis import diagnosis_page
from small_diagnosis import small_diagnosis

PLAIN = load_machine("plain_rotor")


def found(calibration):
    return Findings("named", PLAIN, (), (), calibration, {}, "")


def rows(calibration):
    return {row.path or row.place: row for row in found(calibration).changes()}


def test_a_bearing_is_shown_by_its_numbers_in_the_file_and_not_by_compliance_and_loss():
    """A compliance that falls is a stiffness that rises, and a loss c / k^2 has that stiffness in it."""
    bearing = PLAIN.bearings[0]
    k, c = (float(one[0]) for one in of_bearing(np.array([bearing.kxx]), np.array([bearing.cxx]), 0.0867, 0.4))
    shown = rows({"bearing.0.kx": (0.0867, 0.002), "bearing.0.cx": (0.4, 0.02)})
    for name, value, before in (("kxx", k, bearing.kxx), ("cxx", c, bearing.cxx)):
        row = shown[f"bearings.0.{name}"]
        assert (row.value, row.before) == pytest.approx((value, before))
        assert float(row.cells[4].removesuffix(" %")) == pytest.approx(100 * (value / before - 1), abs=0.051)
    assert k > bearing.kxx and c > bearing.cxx


def test_an_unbalance_is_shown_by_size_and_angle_also_where_the_file_has_none():
    """The angle of parts across the file's own along 0 deg is atan(s / me); at another plane they are the whole."""
    (own,) = PLAIN.effects["unbalance"]
    shown = rows({"unbalance.1.me~phase.c": (0.0, 1e-7), "unbalance.1.me~phase.s": (own.me, 1e-7)})
    size, angle = shown["effects.unbalance.0.me"], shown["effects.unbalance.0.phase"]
    assert (size.value, angle.value) == pytest.approx((own.me * 2**0.5, pi / 4))
    assert size.cells[4] == "+41.4 %" and angle.cells[1:3] == ("0 deg", "45 deg") and angle.cells[4] == "+45.0 deg"
    bare = Findings(
        "named",
        Machine.from_text(without(PLAIN.text, "effects.unbalance")),
        (),
        (),
        {"unbalance.0.me~phase.s": (2e-6, 1e-7)},
        {},
        "",
    )
    assert [row.cells[1:3] for row in bare.changes()] == [("none", "2 g*mm"), ("none", "90 deg")]


def test_what_is_no_number_of_the_file_is_shown_apart_with_its_unit():
    calibration = {"offset_x": (2e-6, 1e-7), "unbalance.1.me~phase.c": (2.5e-6, 1e-7), "shaft_damping": (0.1, 0.02),
                   "bearing.0.cx": (0.0, 0.49), f"{CLOCK}run 1.csv": (1e-4, 1e-5), "mesh": (-0.5, 0.1)}  # fmt: skip
    one = found(calibration)
    assert {row.key for row in one.changes()} == {"unbalance.1.me~phase", "shaft_damping"}
    numbers = [numbers for _, *numbers in one.other_changes()]
    assert numbers == [["2 um", "0.1 um"], ["0", "0.49"], ["0.0001 s", "1e-05 s"], ["-0.5", "0.1"]]


def test_the_page_has_the_numbers_of_the_file_in_one_table_and_the_others_in_another():
    one = small_diagnosis()
    blocks = {block.title: block for block in diagnosis_page(one).blocks if not isinstance(block, tuple)}
    assert [row[1:] for row in blocks["Re-calibration"].rows] == [("0.002", "0.0018", "4e-05", "-10.0 %")]
    assert [row[1:] for row in blocks["What was fitted besides"].rows] == [("1 um", "0.02 um")]
