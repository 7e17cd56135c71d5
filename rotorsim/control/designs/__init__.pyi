from . import (
    h2_scheduled as h2_scheduled,
    hinf as hinf,
    lead as lead,
    lpv as lpv,
    lqr as lqr,
    mpc as mpc,
    p as p,
    placement as placement,
    youla as youla,
)

MET: tuple[str, ...]
IN_PYTHON: tuple[str, ...]
IN_ORDER: tuple[str, ...]
