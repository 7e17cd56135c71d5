"""Data in, models out. Never imports the plant, so that identification against physics cannot cheat.

So far it holds the schema of records, which virtual and measured data share.
"""

from identification.dataset import AXES, VARIABLES, SchemaError, Variable, make_record, validate

__all__ = ["AXES", "VARIABLES", "SchemaError", "Variable", "make_record", "validate"]
