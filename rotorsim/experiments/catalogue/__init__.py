"""Catalogue of experiments, one file each; importing this package registers them by their names."""

from importlib import import_module
from pkgutil import walk_packages

from rotorsim.experiments.experiment import EXPERIMENTS

for _module in walk_packages(__path__, f"{__name__}."):
    import_module(_module.name)
MET = ("slow_roll", "runup", "coastdown", "steady", "impact", "staircase", "prbs", "multisine", "chirp", "controlled")
"""Experiments in the order in which a rig meets them; others follow by their names."""
for _name in [*MET, *sorted(set(EXPERIMENTS) - set(MET))]:
    EXPERIMENTS[_name] = EXPERIMENTS.pop(_name)

__all__ = ["EXPERIMENTS"]
