"""Experiments as functions; `calls.pyi` states their signatures."""

from rotorsim.experiments.chirp import Chirp
from rotorsim.experiments.coastdown import Coastdown
from rotorsim.experiments.functions import as_function
from rotorsim.experiments.impact import Impact
from rotorsim.experiments.multisine import Multisine
from rotorsim.experiments.prbs import Prbs
from rotorsim.experiments.slow_roll import SlowRoll
from rotorsim.experiments.staircase import Staircase
from rotorsim.experiments.steady import Steady

chirp = as_function(Chirp)
coastdown = as_function(Coastdown)
impact = as_function(Impact)
multisine = as_function(Multisine)
prbs = as_function(Prbs)
slow_roll = as_function(SlowRoll)
staircase = as_function(Staircase)
steady = as_function(Steady)
