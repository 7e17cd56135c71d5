from .assessment import Assessment as Assessment, assess as assess
from .conditions import Conditions as Conditions, Plane as Plane, Reading as Reading, read_conditions as read_conditions
from .correction import Correction as Correction, correction as correction
from .influence import (
    Estimate as Estimate,
    Influence as Influence,
    LeftOut as LeftOut,
    estimate as estimate,
    fit_influence as fit_influence,
    leave_one_out as leave_one_out,
)
from .physical import fit_physical as fit_physical
