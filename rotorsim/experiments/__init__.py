"""Virtual experiments: functions and dataclasses that run a plant and return a record.

Each is a function ``name(plant, ..., seed=0, progress=False) -> Dataset`` and a frozen dataclass of its parameters,
which `run` runs in memory and `record` streams to a file.
"""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
