"""Calibration as a diagnosis shows it: changes with the unit of what they change, relative ones without."""

from rotorsim.discrepancy.machine_file import CLOCK, Findings
from rotorsim.machine import load_machine


def test_changes_have_their_units():
    calibration = {"offset_x": (2e-6, 1e-7), "unbalance.1.me~phase.c": (2.5e-6, 1e-7), "shaft_damping": (0.1, 0.02),
                   "bearing.0.kx": (-0.05, 0.2), f"{CLOCK}run 1": (1e-4, 1e-5)}  # fmt: skip
    found = Findings("named", load_machine("plain_rotor"), (), (), calibration, {}, "")
    assert list(found.changes()) == [
        ("offset_x", "2 um", "0.1 um"),
        ("unbalance.1.me~phase.c", "2.5 g mm", "0.1 g mm"),
        ("shaft_damping", "0.1", "0.02"),
        ("bearing.0.kx", "-0.05", "0.2"),
        (f"{CLOCK}run 1", "0.0001 s", "1e-05 s"),
    ]
