"""First-principles simulation of rotors on active gas bearings.

    import rotorsim as rs
    plant = rs.Plant(rs.load_machine("dtu_gas_bearing"))
    record = rs.experiments.runup(plant, 0.0, 628.3, 10.5, 0.3e6)

Names are imported when they are first used, so that ``import rotorsim`` is quick and silent.
"""

from pathlib import Path as _Path

from rotorsim import report as _report
from rotorsim.base.display import Reported as _Reported
from rotorsim.base.public import lazy, refuse_hidden as _refuse_hidden

_refuse_hidden(_Path(__file__).resolve().parents[1], ("fe_shaft", "fmu", "identification", "reynolds"))
_Reported.writer = lambda result, path: _report.write(result, path)
__getattr__, __dir__, __all__ = lazy(__name__, __file__)
