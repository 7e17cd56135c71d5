"""Exceptions of rotorsim, each with a one-sentence message: thing, value, limit and remedy."""

from __future__ import annotations

from typing import Any


class RotorsimError(Exception):
    """Base of every error raised for a fault that a user can correct; `where` holds numbers for programs."""

    def __init__(self, message: str, **where: Any) -> None:
        super().__init__(message)
        self.where = where


class MachineFileError(RotorsimError):
    """A machine file that cannot be read or does not describe a machine; one line per problem."""

    @property
    def problems(self) -> tuple[str, ...]:
        """The sentences, one per problem."""
        return tuple(str(self).splitlines())


class ContactError(RotorsimError):
    """The journal touches its sleeve where no contact is allowed."""


class NoLiftOffError(RotorsimError):
    """The film cannot carry the rotor at this speed and supply pressure."""


class ConvergenceError(RotorsimError):
    """An iteration ended without reaching its tolerance."""


class DataError(RotorsimError):
    """A record that lacks a channel, has wrong units or cannot be read."""


class ControllerError(DataError):
    """A controller that gave anything but two finite voltages; `where` holds the samples done before."""


class Unusual(UserWarning):
    """A value far from all that is built; the command line asks for --yes, in Python it is a warning as any other."""


class LeftOut(UserWarning):
    """An installed package that could not be loaded; the command line prints its sentence alone."""
