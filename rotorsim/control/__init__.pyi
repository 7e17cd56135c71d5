from .designs import (
    h2_scheduled as h2_scheduled,
    hinf as hinf,
    lead as lead,
    lpv as lpv,
    lqr as lqr,
    p as p,
    placement as placement,
    youla as youla,
)
from .errors import DesignError as DesignError, LawError as LawError
from .law import Law as Law, load_law as load_law
