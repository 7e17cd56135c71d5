"""Data in, models out. Never imports the plant, so that identification against physics cannot cheat.

The schema that virtual and measured data share, readers and writers of files, a check of what a record is fit for;
then the thesis' method, one step a file: prefilter, frequency responses, start values, grey-box and black-box fits,
confidence, residual tests, surfaces over the operating point and their refinement.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from identification.arrays import from_arrays
from identification.dataset import AXES, VARIABLES, Variable, make_record, require, validate
from identification.errors import ModelError, ReadError, SchemaError, UnfitError
from identification.examination import Channel, Examination, examine
from identification.mapping import Mapping, load_mapping
from identification.readers import columns, load, read
from identification.sampling import sampling_time
from identification.template import mapping_template
from identification.vectors import VECTORS, make_vectors
from identification.writers import save

if TYPE_CHECKING:
    from identification.coherent import coherent_basis
    from identification.folder import Source, files_of, open_pair, pair, survey
    from identification.frf import FrequencyResponse, frequency_response
    from identification.goodness import ceiling, fit_of, noise_free_fit, nrmse
    from identification.local import identify
    from identification.lpv import ExtrapolationWarning, LpvModel
    from identification.lpv_fit import fit_lpv
    from identification.models import LinearModel, load_model
    from identification.prefilter import Prefilter, Signals, filtered, runout_of
    from identification.refine_frequency import distance
    from identification.result import Identification
    from identification.runout import Runout, estimate_runout, on_angle

_LATER = {
    "coherent_basis": "coherent",
    "Source": "folder",
    "files_of": "folder",
    "open_pair": "folder",
    "pair": "folder",
    "survey": "folder",
    "FrequencyResponse": "frf",
    "frequency_response": "frf",
    "ceiling": "goodness",
    "fit_of": "goodness",
    "noise_free_fit": "goodness",
    "nrmse": "goodness",
    "identify": "local",
    "ExtrapolationWarning": "lpv",
    "LpvModel": "lpv",
    "fit_lpv": "lpv_fit",
    "LinearModel": "models",
    "load_model": "models",
    "Prefilter": "prefilter",
    "Signals": "prefilter",
    "filtered": "prefilter",
    "runout_of": "prefilter",
    "distance": "refine_frequency",
    "Identification": "result",
    "Runout": "runout",
    "estimate_runout": "runout",
    "on_angle": "runout",
}
"""Where the names live that need scipy and numba; they are imported when first asked for."""


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module 'identification' has no attribute {name!r}")
    return getattr(import_module(f"identification.{_LATER[name]}"), name)


__all__ = [
    "AXES",
    "VARIABLES",
    "VECTORS",
    "Channel",
    "Examination",
    "ExtrapolationWarning",
    "FrequencyResponse",
    "Identification",
    "LinearModel",
    "LpvModel",
    "Mapping",
    "ModelError",
    "Prefilter",
    "ReadError",
    "Runout",
    "SchemaError",
    "Signals",
    "Source",
    "UnfitError",
    "Variable",
    "ceiling",
    "coherent_basis",
    "columns",
    "distance",
    "estimate_runout",
    "examine",
    "files_of",
    "filtered",
    "fit_lpv",
    "fit_of",
    "frequency_response",
    "from_arrays",
    "identify",
    "load",
    "load_mapping",
    "load_model",
    "make_record",
    "make_vectors",
    "mapping_template",
    "noise_free_fit",
    "nrmse",
    "on_angle",
    "open_pair",
    "pair",
    "read",
    "require",
    "runout_of",
    "sampling_time",
    "save",
    "survey",
    "validate",
]
