"""Physical effects, one file each; importing this package registers the shipped ones."""

from rotorsim.effects.base import REGISTRY, Effect, numeric_fields, param, register
from rotorsim.effects.contact import Contact
from rotorsim.effects.coupling import Coupling
from rotorsim.effects.gravity import Gravity
from rotorsim.effects.unbalance import Unbalance

__all__ = [
    "REGISTRY",
    "Contact",
    "Coupling",
    "Effect",
    "Gravity",
    "Unbalance",
    "numeric_fields",
    "param",
    "register",
]
