"""Linear analyses of the coupled machine: operating maps, onsets, mode shapes, calibration."""

from rotorsim.analysis.calibrate import Calibration, calibrate, judge
from rotorsim.analysis.critical import critical_speeds
from rotorsim.analysis.lift_off import lift_off
from rotorsim.analysis.mode_shapes import mode_shapes
from rotorsim.analysis.operating_map import operating_map
from rotorsim.analysis.point import Point, operating_point
from rotorsim.analysis.safe_region import safe_region
from rotorsim.analysis.targets import read_targets
from rotorsim.analysis.varied import over_fields
from rotorsim.analysis.whirl_onset import whirl_onset

__all__ = [
    "Calibration",
    "Point",
    "calibrate",
    "critical_speeds",
    "judge",
    "lift_off",
    "mode_shapes",
    "operating_map",
    "operating_point",
    "over_fields",
    "read_targets",
    "safe_region",
    "whirl_onset",
]
