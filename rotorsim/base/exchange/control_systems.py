"""Linear and other systems of the package `control`: recognition without import, matrices, construction.

The package is loaded when a system is made or a transfer function converted, never by `import rotorsim`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.base.sentences import listing

LINEAR = ("StateSpace", "TransferFunction")
HOW = "control.sample_system(system, {Ts:g}, 'tustin')"
"""How a continuous system is sampled with that package."""


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
        raise DataError("no package 'control' to convert to or from; pip install control") from error
    return control


def is_control_system(value: Any) -> bool:
    """Whether a value is an input-output system of the package `control`."""
    return any(kind.__module__.split(".")[0] == "control" and kind.__name__ in ("InputOutputSystem", *LINEAR)
               for kind in type(value).__mro__)  # fmt: skip


def is_linear(value: Any) -> bool:
    """Whether a value is a state space or transfer function of the package `control`."""
    return is_control_system(value) and any(kind.__name__ in LINEAR for kind in type(value).__mro__)


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
    names = tuple(system.input_labels), tuple(system.output_labels)
    if hasattr(system, "A"):
        found = [np.array(getattr(system, letter), float) for letter in "ABCD"]
    else:
        found = _realised(system)
    A, B, C, D = found
    return Matrices(A, B, C, D, period(system), *names)


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


def state_space(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, Ts: float, inputs: Sequence[str],
    outputs: Sequence[str], name: str | None = None,
) -> Any:  # fmt: skip
    """control.StateSpace of matrices with named signals; Ts [s], 0 for continuous time."""
    names: dict[str, Any] = {"inputs": list(inputs), "outputs": list(outputs)}
    return control_package().ss(A, B, C, D, Ts, remove_useless_states=False, name=name, **names)


def check_channels(system: Any, what: str, inputs: Sequence[str], outputs: Sequence[str]) -> None:
    """Raise DataError unless a system has as many inputs and outputs as are named."""
    if (system.ninputs, system.noutputs) == (len(inputs), len(outputs)):
        return
    one = "; combine one of each axis by control.append(x, y)" if system.ninputs == system.noutputs == 1 else ""
    raise DataError(
        f"{what}: has {system.ninputs} inputs and {system.noutputs} outputs; needed are {len(inputs)} inputs, "
        f"{listing(inputs)}, and {len(outputs)} outputs, {listing(outputs)}{one}"
    )


def check_period(system: Any, what: str, Ts: float, give: str = "") -> None:
    """Raise DataError unless a system is sampled every Ts [s], with how to make it so; `give` is another way."""
    own, call = period(system), HOW.format(Ts=Ts)
    if own is None and getattr(system, "nstates", None) == 0:
        return
    if own is None:
        raise DataError(f"{what}: its sampling time is not stated; give it dt={Ts:g}{give}")
    if own == 0:
        raise DataError(f"{what}: is continuous and runs every {Ts * 1e3:g} ms; sample it: {call}{give}")
    if abs(own / Ts - 1) > 1e-9:
        raise DataError(
            f"{what}: is sampled every {own * 1e3:g} ms and runs every {Ts * 1e3:g} ms; design it for {Ts:g} s, or "
            f"sample the continuous one: {call}"
        )
