from .data.runup_vectors import runup_vectors as runup_vectors
from .diagnose_records import diagnose as diagnose
from .hidden_machine import hide as hide
from .identifiability import AliasMatrix as AliasMatrix, alias_matrix as alias_matrix, markdown as markdown
from .loop import decide as decide
from .outcome.files import load_diagnosis as load_diagnosis, save_diagnosis as save_diagnosis
from .outcome.gap import reduction as reduction
from .outcome.machine_file import difference as difference
from .outcome.result import Diagnosis as Diagnosis
from .twin.compiled_models import CompiledModels as CompiledModels
