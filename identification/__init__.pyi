from .advice import Advice as Advice, advise as advise
from .comparison import Compared as Compared, Comparison as Comparison, compare_models as compare_models
from .errors import (
    ModelError as ModelError,
    ReadError as ReadError,
    SchemaError as SchemaError,
    UnfitError as UnfitError,
)
from .local.frequency.response_fit import fit_frequency_response as fit_frequency_response
from .local.frequency.response_result import ResponseFit as ResponseFit
from .local.goodness import ceiling as ceiling, fit_of as fit_of, noise_free_fit as noise_free_fit, nrmse as nrmse
from .local.identify import identify as identify
from .local.models import LinearModel as LinearModel
from .local.result import Identification as Identification
from .local.structure import Structure as Structure
from .local.uncertainty.bias import Interval as Interval
from .lpv.coherent import coherent_basis as coherent_basis
from .lpv.fit import fit_lpv as fit_lpv
from .lpv.model import ExtrapolationWarning as ExtrapolationWarning, LpvModel as LpvModel
from .lpv.recursive import RecursiveLpv as RecursiveLpv, Track as Track
from .lpv.recursive_settings import Recursion as Recursion
from .lpv.refine_frequency import distance as distance
from .model_file import load_model as load_model
from .readers import checked as checked, columns as columns, load as load, read as read
from .records.arrays import from_arrays as from_arrays
from .records.examination import Channel as Channel, Examination as Examination, examine as examine
from .records.folder import (
    Source as Source,
    files_of as files_of,
    open_pair as open_pair,
    pair as pair,
    survey as survey,
)
from .records.frf import (
    FrequencyResponse as FrequencyResponse,
    frequency_response as frequency_response,
    measured_response as measured_response,
    periodic_response as periodic_response,
)
from .records.lab.proposal import propose as propose
from .records.lab.resample import resample as resample
from .records.lab.whole_stretches import longest as longest, whole_stretches as whole_stretches
from .records.mapping import Mapping as Mapping, load_mapping as load_mapping
from .records.notes import notes_of as notes_of
from .records.prefilter import Prefilter as Prefilter, Signals as Signals, filtered as filtered, runout_of as runout_of
from .records.runout import Runout as Runout, estimate_runout as estimate_runout, on_angle as on_angle
from .records.sampling import sampling_time as sampling_time
from .records.schema import (
    AXES as AXES,
    PROBE_COORDINATES as PROBE_COORDINATES,
    VARIABLES as VARIABLES,
    Variable as Variable,
    make_record as make_record,
    probe_units as probe_units,
    require as require,
)
from .records.template import mapping_template as mapping_template
from .records.validate import validate as validate
from .records.vectors import VECTORS as VECTORS, make_vectors as make_vectors
from .writers import held as held, save as save, save_timetable as save_timetable, to_pandas as to_pandas
