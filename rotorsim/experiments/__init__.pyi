from rotorsim.signals.static_gain import static_gain_map as static_gain_map

from .catalogue.chirp import Chirp as Chirp, chirp as chirp
from .catalogue.coastdown import Coastdown as Coastdown, coastdown as coastdown
from .catalogue.controlled import Controlled as Controlled, controlled as controlled
from .catalogue.impact import Impact as Impact, impact as impact
from .catalogue.multisine import Multisine as Multisine, multisine as multisine
from .catalogue.prbs import Prbs as Prbs, prbs as prbs
from .catalogue.runup import Runup as Runup, runup as runup
from .catalogue.shock import Shock as Shock, shock as shock
from .catalogue.slow_roll import SlowRoll as SlowRoll, slow_roll as slow_roll
from .catalogue.staircase import Staircase as Staircase, staircase as staircase
from .catalogue.steady import Given as Given, Steady as Steady, steady as steady
from .experiment import EXPERIMENTS as EXPERIMENTS, Experiment as Experiment
from .laws import (
    ProportionalLaw as ProportionalLaw,
    WithHarmonics as WithHarmonics,
    harmonics_of as harmonics_of,
    without_orbit as without_orbit,
)
from .running import Outcome as Outcome, record as record, run as run
