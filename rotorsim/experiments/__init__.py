"""Virtual experiments: a plant in, a record of the schema out."""

from rotorsim.experiments.runup import coastdown, runup

__all__ = ["coastdown", "runup"]
