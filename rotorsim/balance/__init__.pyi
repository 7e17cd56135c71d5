from .conditions import Conditions as Conditions, Plane as Plane, Reading as Reading, read_conditions as read_conditions
from .unbalance import (
    Assessment as Assessment,
    Correction as Correction,
    Estimate as Estimate,
    Influence as Influence,
    LeftOut as LeftOut,
    assess as assess,
    correction as correction,
    estimate as estimate,
    fit_amplitudes as fit_amplitudes,
    fit_influence as fit_influence,
    fit_physical as fit_physical,
    leave_one_out as leave_one_out,
)
