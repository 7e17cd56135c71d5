from .blind_test.hide import hide as hide
from .diagnose_records import diagnose as diagnose
from .diagnosis import Workshop as Workshop
from .outcome.result import Diagnosis as Diagnosis
