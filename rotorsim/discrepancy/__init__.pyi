from .calibration import CompiledModels as CompiledModels
from .candidates import AliasMatrix as AliasMatrix, alias_matrix as alias_matrix, markdown as markdown
from .diagnosis import diagnose as diagnose
from .files import load_diagnosis as load_diagnosis, save_diagnosis as save_diagnosis
from .gap import reduction as reduction
from .hidden_machine import hide as hide
from .loop import decide as decide
from .machine_file import difference as difference
from .result import Diagnosis as Diagnosis
from .run_ups import runup_vectors as runup_vectors
