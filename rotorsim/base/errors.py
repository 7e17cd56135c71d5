"""Exceptions of rotorsim, each with a one-sentence message: thing, value, limit and remedy."""

from typing import Any


class RotorsimError(Exception):
    """Base of every error raised for a fault that a user can correct.

    Attributes
    ----------
    argument : dotted name of the argument or field that is at fault; empty where it is none
    value : the refused value
    where : numbers for programs

    An error that is raised from another one, as with the name of a file before the sentence, is about its argument.
    """

    def __init__(self, message: str, *, argument: str = "", value: Any = None, **where: Any) -> None:
        super().__init__(message)
        self.where = where
        self._fault = (argument, value)

    @property
    def argument(self) -> str:
        """Name of the argument or field."""
        return self._of_cause()[0]

    @property
    def value(self) -> Any:
        """The refused value."""
        return self._of_cause()[1]

    def _of_cause(self) -> tuple[str, Any]:
        cause = self.__cause__
        return cause._of_cause() if not self._fault[0] and isinstance(cause, RotorsimError) else self._fault


class MachineFileError(RotorsimError):
    """Raised for a machine file that cannot be read or does not describe a machine; one line per problem."""

    @property
    def problems(self) -> tuple[str, ...]:
        """The sentences, one per problem."""
        return tuple(str(self).splitlines())


class ContactError(RotorsimError):
    """Raised where the journal touches its sleeve and no contact is allowed."""


class NoLiftOffError(RotorsimError):
    """Raised where the film cannot carry the rotor at a speed and supply pressure."""


class ConvergenceError(RotorsimError):
    """Raised where an iteration ended without reaching its tolerance."""


class NoAnswerError(RotorsimError):
    """Raised for linear algebra without an answer in finite numbers."""


class LimitError(RotorsimError):
    """Raised for a run that begins beyond a limit of its machine; one that reaches it later ends there, recorded."""


class DataError(RotorsimError):
    """Raised for what cannot be used: a record that lacks a channel or has wrong units, a value, file or option."""


class ControllerError(DataError):
    """Raised for a controller that cannot run or gave anything but two finite voltages.

    `where` holds the samples done before.
    """


class DesignError(RotorsimError):
    """Raised for a specification that no controller meets or a model that a design cannot use; names the limit."""


class LawError(RotorsimError):
    """Raised for a control law that cannot be read, or does not fit the plant it is to run on."""


class SchemaError(RotorsimError, ValueError):
    """Raised for a record that does not fit the schema; the message names variable, problem and way out."""


class ReadError(RotorsimError, ValueError):
    """Raised for a file or a mapping that cannot be read; the message names file, place and way out."""


class UnfitError(SchemaError):
    """Raised for a record, or a set of records, that fits the schema but not the identification asked for."""


class ModelError(RotorsimError, ValueError):
    """Raised for a model that cannot be read, converted or made; the message names what, why and the way out."""


class Unusual(UserWarning):
    """Warning, raised for a value far from all that is built: the command line asks for --yes.

    In Python it is a warning as any other, filtered by `warnings`.
    """


class OtherMachine(UserWarning):
    """Warning, raised for a law on a machine of another name than that of its design; its sentence alone is printed."""


class UnstableLaw(UserWarning):
    """Warning, raised for a law of another program whose own states grow; its sentence alone is printed."""


class PackageLeftOut(UserWarning):
    """Warning, raised for an installed package that could not be loaded; the command line prints its sentence alone."""


class NotCarried(UserWarning):
    """Warning, raised for a part of a foreign object or file that has no counterpart; its sentence alone is printed."""


class NoCache(UserWarning):
    """Warning, raised where no folder is safe for compiled kernels; the command line prints its sentence alone."""
