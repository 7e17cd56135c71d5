"""Virtual experiments: functions and dataclasses that run a plant and return a record.

Each is a function ``name(plant, ..., seed=0, progress=False) -> Dataset`` and a frozen dataclass of its parameters,
which `run` runs in memory and `record` streams to a file.
"""

from typing import TYPE_CHECKING

from rotorsim.base.public import named
from rotorsim.experiments.calls import chirp, coastdown, impact, multisine, prbs, slow_roll, staircase, steady
from rotorsim.experiments.chirp import Chirp
from rotorsim.experiments.coastdown import Coastdown
from rotorsim.experiments.controlled import Controlled, controlled
from rotorsim.experiments.experiment import Experiment
from rotorsim.experiments.given import Given
from rotorsim.experiments.impact import Impact
from rotorsim.experiments.laws.orbit import WithHarmonics, harmonics_of, without_orbit
from rotorsim.experiments.laws.p_law import ProportionalLaw
from rotorsim.experiments.multisine import Multisine
from rotorsim.experiments.prbs import Prbs
from rotorsim.experiments.running import Outcome, record, run
from rotorsim.experiments.runup import Runup, runup
from rotorsim.experiments.slow_roll import SlowRoll
from rotorsim.experiments.staircase import Staircase
from rotorsim.experiments.steady import Steady
from rotorsim.signals.static_gain import static_gain_map

EXPERIMENTS: dict[str, type[Experiment]] = {
    kind.name: kind
    for kind in (Runup, Coastdown, Steady, SlowRoll, Staircase, Prbs, Chirp, Multisine, Impact, Controlled)
}
"""Every experiment by its name."""

__all__ = [
    "EXPERIMENTS",
    "Chirp",
    "Coastdown",
    "Controlled",
    "Experiment",
    "Given",
    "Impact",
    "Multisine",
    "Outcome",
    "Prbs",
    "ProportionalLaw",
    "Runup",
    "SlowRoll",
    "Staircase",
    "Steady",
    "WithHarmonics",
    "chirp",
    "coastdown",
    "controlled",
    "harmonics_of",
    "impact",
    "multisine",
    "prbs",
    "record",
    "run",
    "runup",
    "slow_roll",
    "staircase",
    "static_gain_map",
    "steady",
    "without_orbit",
]


if not TYPE_CHECKING:
    __getattr__, __dir__ = named(__name__, __all__)
