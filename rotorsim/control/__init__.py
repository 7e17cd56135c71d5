"""Controllers: one file per design, ``design(model, Spec()) -> Law``, and the law that each becomes."""

from rotorsim.control.errors import DesignError, LawError
from rotorsim.control.law import Law, load_law

__all__ = ["DesignError", "Law", "LawError", "load_law"]
