"""Blind tests of a diagnosis: records of a machine with hidden effects."""
