from .blind_test.hide import hide as hide
from .diagnosis import Workshop as Workshop, diagnose as diagnose
from .outcome.result import Diagnosis as Diagnosis
