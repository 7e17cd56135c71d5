import fe_shaft as fe_shaft
import identification as identification
import reynolds as reynolds
from identification import (
    LinearModel as LinearModel,
    LpvModel as LpvModel,
    fit_lpv as fit_lpv,
    from_arrays as from_arrays,
    identify as identify,
    load_model as load_model,
    read as read,
)

from . import (
    analysis as analysis,
    balance as balance,
    campaign as campaign,
    control as control,
    desk as desk,
    discrepancy as discrepancy,
    effects as effects,
    errors as errors,
    experiments as experiments,
    fmu as fmu,
    live as live,
    machine as machine,
    plant as plant,
    report as report,
    signals as signals,
    study as study,
    verify as verify,
)
from .base.cache import __version__ as __version__
from .base.errors import RotorsimError as RotorsimError
from .control import Law as Law, design as design, load_law as load_law
from .discrepancy import Diagnosis as Diagnosis, diagnose as diagnose, hide as hide
from .experiments import record as record, run as run
from .machine import (
    Machine as Machine,
    load_machine as load_machine,
    machine_text as machine_text,
    shipped_machines as shipped_machines,
)
from .plant import Plant as Plant, compile_kernels as compile_kernels
from .report import write_report as write_report
from .signals import open_record as open_record
from .study.identify_records import identify_records as identify_records
from .verify import closed_loop as closed_loop
