from . import experiments as experiments
from .base.errors import RotorsimError as RotorsimError
from .control import load_law as load_law
from .machine import Machine as Machine, load_machine as load_machine
from .plant import Plant as Plant
