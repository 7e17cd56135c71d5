from .axes import Field as Field, over_fields as over_fields, read_axis as read_axis, read_field as read_field
from .axial import (
    AxialState as AxialState,
    axial_forces as axial_forces,
    axial_state as axial_state,
    thrust_films as thrust_films,
)
from .calibrate import (
    Calibration as Calibration,
    calibrate as calibrate,
    calibration_numbers as calibration_numbers,
    judge as judge,
    save_calibrated as save_calibrated,
)
from .campbell import (
    campbell as campbell,
    critical_speed_map as critical_speed_map,
    critical_speeds as critical_speeds,
    safe_region as safe_region,
)
from .citations import cite as cite
from .design_review import (
    DesignReview as DesignReview,
    design_review as design_review,
    reserve_slopes as reserve_slopes,
    static_deflection as static_deflection,
)
from .operating_map import (
    OperatingPoint as OperatingPoint,
    map_machine as map_machine,
    operating_map as operating_map,
    operating_point as operating_point,
)
from .optimise import Optimisation as Optimisation, optimise as optimise
from .shaft_motion import (
    mode_shapes as mode_shapes,
    passed_too_fast as passed_too_fast,
    shaft_motion as shaft_motion,
    unbalance_response as unbalance_response,
)
from .supply import lift_off as lift_off, load_capacity as load_capacity
from .sweep import SweepResult as SweepResult, sweep as sweep
from .targets import read_targets as read_targets
from .tolerances import RandomResult as RandomResult, random_machines as random_machines
from .whirl_onset import whirl_onset as whirl_onset
