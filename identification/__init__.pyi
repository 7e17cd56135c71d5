from rotorsim.base.errors import (
    ModelError as ModelError,
    ReadError as ReadError,
    SchemaError as SchemaError,
    UnfitError as UnfitError,
)

from .campaign import (
    Source as Source,
    files_of as files_of,
    open_pair as open_pair,
    pair as pair,
    survey as survey,
)
from .local.bias import Interval as Interval
from .local.confidence import ceiling as ceiling, fit_of as fit_of, noise_free_fit as noise_free_fit, nrmse as nrmse
from .local.identify import identify as identify
from .local.models import LinearModel as LinearModel
from .local.response_fit import ResponseFit as ResponseFit, fit_frequency_response as fit_frequency_response
from .local.result import Identification as Identification
from .local.structures import Structure as Structure
from .lpv_fit import coherent_basis as coherent_basis, distance as distance, fit_lpv as fit_lpv
from .lpv_model import ExtrapolationWarning as ExtrapolationWarning, LpvModel as LpvModel, load_model as load_model
from .model_choice import (
    Advice as Advice,
    Compared as Compared,
    Comparison as Comparison,
    advise as advise,
    compare_models as compare_models,
)
from .readers import checked as checked, columns as columns, load as load, read as read
from .records.examination import Channel as Channel, Examination as Examination, examine as examine
from .records.frequency_response import (
    FrequencyResponse as FrequencyResponse,
    frequency_response as frequency_response,
    measured_response as measured_response,
    periodic_response as periodic_response,
)
from .records.mapping import Mapping as Mapping, load_mapping as load_mapping
from .records.prefilter import (
    Prefilter as Prefilter,
    Signals as Signals,
    filtered as filtered,
    longest as longest,
    runout_of as runout_of,
    whole_stretches as whole_stretches,
)
from .records.proposal import mapping_template as mapping_template, propose as propose
from .records.sampling import resample as resample, sampling_time as sampling_time
from .records.schema import (
    AXES as AXES,
    PROBE_COORDINATES as PROBE_COORDINATES,
    VARIABLES as VARIABLES,
    VECTORS as VECTORS,
    Variable as Variable,
    from_arrays as from_arrays,
    make_record as make_record,
    make_vectors as make_vectors,
    notes_of as notes_of,
    probe_units as probe_units,
    require as require,
    validate as validate,
)
from .records.sensors import Runout as Runout, estimate_runout as estimate_runout, on_angle as on_angle
from .writers import held as held, save as save, save_timetable as save_timetable, to_pandas as to_pandas
