"""Linear analyses of the coupled machine: operating maps, onsets, mode shapes, calibration."""

from typing import TYPE_CHECKING

from rotorsim.analysis.axes import Field, read_axis, read_field
from rotorsim.analysis.calibrate import Calibration, calibrate, judge
from rotorsim.analysis.calibrated import calibration_numbers, save_calibrated
from rotorsim.analysis.campbell import campbell, critical_speed_map, critical_speeds
from rotorsim.analysis.citations import cite
from rotorsim.analysis.lift_off import lift_off
from rotorsim.analysis.load_capacity import load_capacity
from rotorsim.analysis.machine_map import map_machine
from rotorsim.analysis.mode_shapes import mode_shapes
from rotorsim.analysis.operating_map import operating_map
from rotorsim.analysis.point import Point, operating_point
from rotorsim.analysis.safe_region import safe_region
from rotorsim.analysis.shaft_motion import shaft_motion
from rotorsim.analysis.sweeps.sweep import SweepResult, sweep
from rotorsim.analysis.targets import read_targets
from rotorsim.analysis.unbalance_response import unbalance_response
from rotorsim.analysis.varied import over_fields
from rotorsim.analysis.whirl_onset import whirl_onset
from rotorsim.base.public import named

__all__ = [
    "Calibration",
    "Field",
    "Point",
    "SweepResult",
    "calibrate",
    "calibration_numbers",
    "campbell",
    "cite",
    "critical_speed_map",
    "critical_speeds",
    "judge",
    "lift_off",
    "load_capacity",
    "map_machine",
    "mode_shapes",
    "operating_map",
    "operating_point",
    "over_fields",
    "read_axis",
    "read_field",
    "read_targets",
    "safe_region",
    "save_calibrated",
    "shaft_motion",
    "sweep",
    "unbalance_response",
    "whirl_onset",
]


if not TYPE_CHECKING:
    __getattr__, __dir__ = named(__name__, __all__)
