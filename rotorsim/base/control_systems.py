"""Systems of the package `control`, and what an importer does not carry over from any other program's object.

An importer takes each object through a `Foreign`, which counts the attributes that are read. What is left over reaches
the user by `Leftovers.warn` as a `NotCarried` warning, so that a later version of the other program cannot lose a
property here in silence. The package `control` is loaded when a system is made or a transfer function converted.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from rotorsim.base.display import listing
from rotorsim.base.errors import DataError, NotCarried

_REQUIRED: Any = object()
_NAMED = 8
"""Names in a sentence, before the rest is counted."""


class Foreign:
    """One object of another program; `what` names it in sentences."""

    def __init__(self, value: Any, what: str) -> None:
        self.value, self.what = value, what
        self._read: set[str] = set()

    def read(self, name: str, default: Any = _REQUIRED) -> Any:
        """An attribute, counted as read; the default where the object has none.

        Raises
        ------
        AttributeError
            If there is neither the attribute nor a default.
        """
        self._read.add(name)
        return getattr(self.value, name) if default is _REQUIRED else getattr(self.value, name, default)

    def unread(self, derived: Collection[str] = ()) -> tuple[str, ...]:
        """Names of the attributes that hold something, were not read and do not follow from others.

        `derived` lists those that follow from others or only concern drawing.
        """
        found = getattr(self.value, "__dict__", {})
        names = (name for name in found if not name.startswith("_") and name not in self._read)
        return tuple(sorted(name for name in names if name not in derived and not _empty(found[name])))


class Leftovers:
    """Sentences about what an importer did not carry over, the same about many objects in one."""

    def __init__(self, importer: str) -> None:
        self.importer = importer
        self._places: dict[str, list[str]] = {}

    def add(self, what: str, sentence: str) -> None:
        """A sentence about one object."""
        self._places.setdefault(sentence, []).append(what)

    def unread(self, one: Foreign, derived: Collection[str] = ()) -> None:
        """Name the attributes of an object that were not read."""
        if names := one.unread(derived):
            self.add(one.what, f"{_few(names)} of {type(one.value).__name__} not carried over; there is no counterpart")

    def warn(self) -> None:
        """Raise one `NotCarried` warning a sentence, at the caller of the importer."""
        for sentence, places in self._places.items():
            warnings.warn(f"{self.importer}: {_few(dict.fromkeys(places))}: {sentence}.", NotCarried, stacklevel=4)


def _few(names: Iterable[str]) -> str:
    names = list(names)
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more


def _empty(value: Any) -> bool:
    """Whether an attribute holds nothing: None, an empty text, list or table."""
    return value is None or (isinstance(value, (str, list, tuple, dict, set)) and not value)


_READ = {"A", "B", "C", "D", "dt", "name", "ninputs", "noutputs", "nstates", "input_index", "output_index",
         "state_index", "updfcn", "outfcn", "num_array", "den_array", "num", "den", "display_format", "syslist",
         "syslist_index", "connect_map", "connection_type", "input_map", "output_map", "input_offset", "output_offset",
         "state_offset"}  # fmt: skip
"""Attributes of linear systems that are read, or follow from these; connections stand in the matrices already."""
LINEAR = ("StateSpace", "TransferFunction")
HOW = "control.sample_system({system}, {Ts:g}, '{rule}')"
"""Call that samples a continuous system with that package."""


REFERENCES, DISC = ("reference_x", "reference_y"), ("disc_x", "disc_y")
CHANNELS = (*REFERENCES, *DISC, "speed", "pressure")
"""Channels of models and controllers, by whose names the labels of a system are read."""


class Matrices(NamedTuple):
    """A (n, n), B (n, m), C (p, n), D (p, m), Ts [s] (0: continuous, None: not stated) and names of signals."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    Ts: float | None
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


def control_package() -> Any:
    """The package `control`; raises DataError with the way out where it is missing."""
    try:
        import control
    except ImportError as error:
        raise DataError(
            "no package 'control' to convert to or from; pip install control", argument="control"
        ) from error
    return control


def is_control_system(value: Any) -> bool:
    """Whether a value is an input-output system of the package `control`."""
    return any(kind.__module__.split(".")[0] == "control" and kind.__name__ in ("InputOutputSystem", *LINEAR)
               for kind in type(value).__mro__)  # fmt: skip


def is_linear(value: Any) -> bool:
    """Whether a value is a state space or transfer function of the package `control`."""
    return is_control_system(value) and any(kind.__name__ in LINEAR for kind in type(value).__mro__)


def reorder(found: Matrices, inputs: Sequence[str], outputs: Sequence[str]) -> Matrices:
    """Matrices with their channels in the order of the names, where the labels are these."""
    into, out = channel_order(found.inputs, inputs), channel_order(found.outputs, outputs)
    return found._replace(
        B=found.B[:, into], C=found.C[out], D=found.D[np.ix_(out, into)],
        inputs=tuple(found.inputs[i] for i in into), outputs=tuple(found.outputs[i] for i in out),
    )  # fmt: skip


def check_runs(system: Any, what: str) -> None:
    """Raise DataError for frequency response data, which have no states to step."""
    if not (is_linear(system) or hasattr(system, "dynamics")):
        raise DataError(
            f"{what}: is {type(system).__name__}, which does not run in time; give a control.StateSpace or "
            "TransferFunction"
        )


def period(system: Any) -> float | None:
    """Sampling time [s]; 0 for continuous time, None where the system does not state it."""
    return None if system.dt is None or system.dt is True else float(system.dt)


def matrices(system: Any) -> Matrices:
    """Matrices of a linear system; a transfer function of several inputs and outputs entry by entry.

    Raises
    ------
    DataError
        For anything but a proper, linear system.
    """
    if not is_linear(system):
        raise DataError(f"{type(system).__name__}: is not a linear system; give control.StateSpace or TransferFunction")
    _name_rest(system)
    names = tuple(system.input_labels), tuple(system.output_labels)
    if hasattr(system, "A"):
        found = [np.array(getattr(system, letter), float) for letter in "ABCD"]
    else:
        found = _realised(system)
    A, B, C, D = found
    return Matrices(A, B, C, D, period(system), *names)


def _name_rest(system: Any) -> None:
    """Warn of what a system holds besides its matrices, its clock and its signals."""
    one, left = Foreign(system, getattr(system, "name", None) or "system"), Leftovers("from_control")
    labels = getattr(system, "state_labels", ()) if hasattr(system, "A") else ()
    if named := [label for label in labels if "[" not in label]:
        left.add(one.what, f"names of states, {listing(named)}, not carried over")
    left.unread(one, _READ)
    left.warn()


def _realised(system: Any) -> list[np.ndarray]:
    """State space of a transfer function, the states of each entry its own; unreached ones are left in."""
    from scipy.linalg import block_diag
    from scipy.signal import tf2ss

    p, m = system.noutputs, system.ninputs
    A: list[np.ndarray] = []
    B: list[np.ndarray] = []
    C: list[np.ndarray] = []
    D = np.zeros((p, m))
    for i, j in np.ndindex(p, m):
        num, den = (np.trim_zeros(np.atleast_1d(one[i][j]), "f") for one in (system.num, system.den))
        if len(num) > len(den):
            raise DataError(
                f"transfer function from input {j + 1} to output {i + 1}: more zeros than poles, which no sampled "
                "controller can do; add poles"
            )
        if not len(num):
            continue
        a, b, c, D[i : i + 1, j : j + 1] = tf2ss(num, den)
        if len(den) > 1:
            rows, columns = np.zeros((len(a), m)), np.zeros((p, len(a)))
            rows[:, j], columns[i] = b[:, 0], c[0]
            A, B, C = [*A, a], [*B, rows], [*C, columns]
    if not A:
        return [np.zeros((0, 0)), np.zeros((0, m)), np.zeros((p, 0)), D]
    return [block_diag(*A), np.vstack(B), np.hstack(C), D]


def balanced(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same system in states times powers of two, with rows and columns of A of like size; no digit is lost."""
    from scipy.linalg import matrix_balance

    _, (scale, _) = matrix_balance(A, permute=False, separate=True)
    return A * scale / scale[:, None], B / scale[:, None], C * scale


def state_space(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, Ts: float, inputs: Sequence[str],
    outputs: Sequence[str], name: str | None = None,
) -> Any:  # fmt: skip
    """control.StateSpace of matrices with named signals; Ts [s], 0 for continuous time."""
    names: dict[str, Any] = {"inputs": list(inputs), "outputs": list(outputs)}
    return control_package().ss(A, B, C, D, Ts, remove_useless_states=False, name=name, **names)


def check_channels(system: Any, what: str, inputs: Sequence[str], outputs: Sequence[str]) -> None:
    """Raise DataError unless a system has as many inputs and outputs as are named, and labels that allow them."""
    if (system.ninputs, system.noutputs) == (len(inputs), len(outputs)):
        check_labels(system.input_labels, inputs, f"{what}: input")
        check_labels(system.output_labels, outputs, f"{what}: output")
        return
    one = "; combine one of each axis by control.append(x, y)" if system.ninputs == system.noutputs == 1 else ""
    raise DataError(
        f"{what}: has {system.ninputs} inputs and {system.noutputs} outputs; needed are {len(inputs)} inputs, "
        f"{listing(inputs)}, and {len(outputs)} outputs, {listing(outputs)}{one}"
    )


def channel_order(labels: Sequence[str], names: Sequence[str]) -> list[int]:
    """Indices of the channels `names` among a system's labels, or the order as it is where the labels are others."""
    if sorted(labels) != sorted(names):
        return list(range(len(labels)))
    return [list(labels).index(name) for name in names]


def check_labels(labels: Sequence[str], names: Sequence[str], what: str) -> None:
    """Raise DataError where a label names another channel, unless the labels are `names` in another order."""
    if sorted(labels) == sorted(names):
        return
    for number, (label, name) in enumerate(zip(labels, names, strict=True), start=1):
        if label in CHANNELS and label != name:
            raise DataError(
                f"{what} {number} is labelled {label} and would be {name}; label them {listing(names)}, or none of "
                "them by the name of a channel"
            )


def sampling_call(system: Any, Ts: float, rule: str = "tustin") -> str:
    """The call that samples a continuous system: the package samples transfer functions entry by entry alone.

    Examples
    --------
    >>> import control
    >>> sampling_call(control.tf([1.0], [1.0, 2.0]), 2e-4)
    "control.sample_system(system, 0.0002, 'tustin')"
    """
    p, m = system.noutputs, system.ninputs
    if hasattr(system, "num") and (p, m) != (1, 1):
        entry = HOW.format(system="system[i, j]", Ts=Ts, rule=rule)
        return f"control.combine_tf([[{entry} for j in range({m})] for i in range({p})])"
    return HOW.format(system="system", Ts=Ts, rule=rule)


def check_period(system: Any, what: str, Ts: float, order: int, argument: bool = False) -> None:
    """Raise DataError unless a system of `order` states is sampled every Ts [s], with how to make it so.

    `argument` states that the caller also takes Ts, for a continuous system or one whose sampling time is not stated.
    """
    own, call = period(system), sampling_call(system, Ts)
    if own is None and order == 0:
        return
    if system.dt is True:
        also = f", or give Ts={Ts:g}" if argument else ""
        raise DataError(f"{what}: is sampled, but its sampling time is not stated; give it dt={Ts:g}{also}")
    if own is None:
        raise DataError(
            f"{what}: whether it is continuous or sampled is not stated; give it dt=0 (continuous) or dt={Ts:g} "
            "(sampled)"
        )
    if own == 0:
        also = f", or give Ts={Ts:g}, which samples it by Tustin's rule" if argument else ""
        raise DataError(f"{what}: is continuous and runs every {Ts * 1e3:g} ms; sample it: {call}{also}")
    if abs(own / Ts - 1) > 1e-9:
        raise DataError(
            f"{what}: is sampled every {own * 1e3:g} ms and runs every {Ts * 1e3:g} ms; design it for {Ts:g} s, or "
            f"sample the continuous one: {call}"
        )
