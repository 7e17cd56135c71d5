"""Versions of installed packages."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version


def installed(name: str) -> str:
    """Version of an installed package; 'source' if it runs from its source tree."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "source"


__version__ = installed("rotorsim")
