"""State-space systems of other programs: those of the package `control`, and MATLAB files.

An importer takes each object through a `Foreign`, which counts the attributes that are read. What is left over reaches
the user by `Leftovers.warn` as a `NotCarried` warning, so that a later version of the other program cannot lose a
property here in silence. The package `control` is loaded when a system is made or a transfer function converted.

A MATLAB file (v5) holds A, B, C, D and Ts as `ss(A, B, C, D, Ts)` takes them, and names as cells.
"""

import struct
import warnings
import zlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rotorsim.base.display import listing, quote
from rotorsim.base.errors import DataError, NotCarried
from rotorsim.base.files import replacing
from rotorsim.base.units import TABLE

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

        Raises AttributeError if there is neither the attribute nor a default.
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

    Raises DataError for anything but a proper, linear system.
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


SYSTEM = ("A", "B", "C", "D")
DELAYS = ("InputDelay", "OutputDelay", "IODelay", "ioDelay", "InternalDelay")
"""Delays of a system of MATLAB, which no matrix here has."""
SAVE = "[A, B, C, D, Ts] = ssdata(sys); save('system.mat', 'A', 'B', 'C', 'D', 'Ts', '-v7')"
"""MATLAB commands that save a system so that it can be read here."""
LARGEST = 100_000_000
"""Largest size [byte] of a file, packed or unpacked: a system of 1000 states takes 8 MB."""
HEADER = 128
"""Size [byte] of the head of a v5 file, before its first variable."""
COMPRESSED = 15
"""Type number of a packed variable in a v5 file."""
CHUNK = 1_000_000
"""Size [byte] of a piece that is unpacked at once."""


def is_mat(path: str | Path) -> bool:
    """Whether a name ends as MATLAB files do."""
    return Path(path).suffix.lower() == ".mat"


def cells(texts: Sequence[str]) -> np.ndarray:
    """Texts as a row of cells."""
    found = np.empty((1, len(texts)), object)
    found[0] = list(texts)
    return found


def write_mat(path: str | Path, content: Mapping[str, Any]) -> None:
    """Write variables as a .mat file (v5), complete or not at all; raises WriteError."""
    from scipy.io import savemat

    with replacing(path) as part, part.open("wb") as file:
        savemat(file, dict(content), long_field_names=True, oned_as="row")


def read_mat(path: str | Path) -> dict[str, Any]:
    """Variables of a .mat file with a state-space system; texts are str, cells of texts lists, the rest arrays.

    Raises
    ------
    DataError
        With a sentence that does not begin with the file's name, if it cannot be read or lacks A, B, C, D or Ts.
    """
    from scipy.io import loadmat

    large = Path(path).stat().st_size > LARGEST
    data = b"" if large else Path(path).read_bytes()
    if large or _unpacked(data) > LARGEST:
        raise DataError(f"unpacks to more than {LARGEST / 1e6:g} MB; save the system alone: {SAVE}")
    try:
        raw = loadmat(BytesIO(data), mat_dtype=True)
    except NotImplementedError as error:
        raise DataError("is a MATLAB file of version 7.3; save it with the option '-v7'") from error
    except Exception as error:  # damage ends in anything from IndexError to zlib.error
        raise DataError(f"cannot be read as a MATLAB file ({str(error)[:200]}); save it in MATLAB by {SAVE}") from error
    found = {name: _plain(value) for name, value in raw.items() if not name.startswith("__")}
    wrong = [n for n in SYSTEM if not isinstance(found.get(n), np.ndarray) or found[n].dtype.kind not in "fiu"]
    if wrong:
        raise DataError(f"holds no matrix {', '.join(wrong)}; save it in MATLAB by {SAVE}")
    if "Ts" not in found:
        raise DataError(f"holds no Ts; save Ts too (0 for continuous): {SAVE}")
    return found


def _unpacked(data: bytes) -> int:
    """Bytes of the packed variables of a v5 file, counted no further than beyond `LARGEST`."""
    order, total, place = ("<" if data[126:128] == b"IM" else ">"), 0, HEADER
    while place + 8 <= len(data) and total <= LARGEST:
        kind, size = struct.unpack_from(f"{order}II", data, place)
        packed = data[place + 8 : place + 8 + size]
        place += 8 + size
        if kind != COMPRESSED:
            continue
        stream = zlib.decompressobj()
        with suppress(zlib.error):  # which loadmat will meet again
            while packed and total <= LARGEST:
                total += len(stream.decompress(packed, CHUNK))
                packed = stream.unconsumed_tail
    return total


def number(content: Mapping[str, Any], name: str, default: float) -> float:
    """A scalar of a file; the default where it is missing; raises DataError for anything else."""
    value = content.get(name)
    if value is None:
        return default
    if not isinstance(value, np.ndarray) or value.size != 1 or value.dtype.kind not in "fiub":
        raise DataError(f"{name} is not a number; give one")
    return float(value.flat[0])


def check_rest(content: Mapping[str, Any], read: Collection[str]) -> None:
    """Name what a file states of its system besides what is `read`.

    Raises
    ------
    DataError
        For what changes the motion: delays, a descriptor matrix E, another unit of time than seconds.

    Warns
    -----
    NotCarried
        For everything else.
    """
    for name in DELAYS:
        if np.any(content.get(name, 0.0)):
            raise DataError(f"{name} is not 0, which has no counterpart; put it into the states: absorbDelay or pade")
    E = content.get("E")
    if isinstance(E, np.ndarray) and E.size and not (E.ndim == 2 and np.array_equal(E, np.eye(len(E)))):
        raise DataError("E is not the unit matrix; save the explicit system: sys = ss(sys, 'explicit')")
    if (unit := content.get("TimeUnit", "")) not in ("", "s", "seconds"):
        raise DataError(f"TimeUnit is {quote(unit)}; save it in seconds: sys = chgTimeUnit(sys, 'seconds')")
    name_rest(set(content) - {*read, *DELAYS, *SYSTEM, "E", "TimeUnit", "Ts", "kind"})


def name_rest(names: Collection[str]) -> None:
    """Warn, as `NotCarried`, of entries of a file of a system that no reader takes."""
    if names:
        text = f"{listing(sorted(names))} of the file not carried over; there is no counterpart"
        warnings.warn(text, NotCarried, stacklevel=3)


def in_si(
    content: Mapping[str, Any], B: np.ndarray, C: np.ndarray, D: np.ndarray, inputs: str, outputs: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """B, C, D between SI units, from those that InputUnit and OutputUnit state; without these they are SI already.

    Raises DataError for a unit of another quantity.
    """
    into = [_factor(unit, inputs) for unit in _units(content, "InputUnit", D.shape[1])]
    out = [_factor(unit, outputs) for unit in _units(content, "OutputUnit", D.shape[0])]
    if set(into) | set(out) <= {1.0}:
        return B, C, D
    more = (1,) * (D.ndim - 2)  # operating points
    columns, rows = np.reshape(into, (1, -1, *more)), np.reshape(out, (-1, 1, *more))
    return B / columns, C * rows, D * rows / columns


def _units(content: Mapping[str, Any], name: str, count: int) -> list[str]:
    value = content.get(name)
    found = [value] * count if isinstance(value, str) else value
    return found if isinstance(found, list) and len(found) == count else [""] * count


def _factor(unit: str, si: str) -> float:
    known = TABLE[si].factors | TABLE[si].recorded
    if unit and unit not in known:
        raise DataError(f"unit {quote(unit)} is not one of {TABLE[si].name}; give the system's signals in V and m")
    return float(known[unit]) if unit else 1.0


def texts(content: Mapping[str, Any], name: str, default: Sequence[str]) -> tuple[str, ...]:
    """Cells of texts, or the default where they are missing or empty."""
    value = content.get(name)
    found = [value] if isinstance(value, str) else value
    return tuple(found) if isinstance(found, list) and all(found) and len(found) == len(default) else tuple(default)


def _plain(value: Any) -> Any:
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype.kind == "U":
        return str(value.flat[0]) if value.size else ""
    if value.dtype.kind == "O":
        parts = [_plain(one) for one in value.ravel()]
        return parts if all(isinstance(one, str) for one in parts) else value
    return value
