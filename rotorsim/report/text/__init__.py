"""Captions and tables of reports."""
