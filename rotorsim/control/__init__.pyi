from .catalogue import DESIGNS as DESIGNS, design as design, field_rows as field_rows, make_spec as make_spec
from .designs import *  # noqa: F403
from .designs.uncertain import uncertainty_between as uncertainty_between
from .errors import DesignError as DesignError, LawError as LawError
from .law import Law as Law, load_law as load_law
from .loop.analysis import overview as overview
from .loop.impacts import hit_ratios as hit_ratios
from .loop.sampled_loop import (
    Loop as Loop,
    Sweep as Sweep,
    loop_of as loop_of,
    model_loop as model_loop,
    sweep as sweep,
)
from .loop.stability_check import check_loop as check_loop
from .plausibility import Plausibility as Plausibility, Predictors as Predictors
from .plausibility_of_model import plausibility_of as plausibility_of
from .variants import biased as biased, without_dc as without_dc
