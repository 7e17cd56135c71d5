from rotorsim.base.errors import DesignError as DesignError, LawError as LawError

from .catalogue import DESIGNS as DESIGNS, design as design, field_rows as field_rows, make_spec as make_spec
from .designs import *  # noqa: F403
from .designs.hinf import uncertainty_between as uncertainty_between
from .law import Law as Law, load_law as load_law
from .law_from_system import biased as biased, without_dc as without_dc
from .plausibility import (
    Plausibility as Plausibility,
    Predictors as Predictors,
    plausibility_of as plausibility_of,
)
from .runout import (
    RunoutCheck as RunoutCheck,
    RunoutTable as RunoutTable,
    check_runout as check_runout,
    runout_table as runout_table,
)
from .sampled_loop import (
    Loop as Loop,
    Sweep as Sweep,
    check_loop as check_loop,
    hit_ratios as hit_ratios,
    loop_of as loop_of,
    model_loop as model_loop,
    overview as overview,
    sweep as sweep,
)
