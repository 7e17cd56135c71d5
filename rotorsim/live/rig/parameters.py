"""Change of an effect's parameter in a running plant: parameter record and derived numbers."""

from __future__ import annotations

from collections.abc import Callable
from math import prod
from typing import Any

from rotorsim.effects import Effect
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.compose import Call
from rotorsim.plant.kernels.modal_rotor import build_support


def write_effect(a: Assembly, record: str, effect: Effect, parameter: str) -> None:
    """Write an effect's parameter and its derived numbers into the parameter record."""
    row = a.record[record]
    for name, value in ({parameter: getattr(effect, parameter)} | effect.derived(a.machine)).items():
        row[name] = value


def update_derived(a: Assembly, w: Any) -> None:
    """Recompute the numbers derived from parameters: supports, plena, rotor matrix."""
    for call in a.calls:
        if call.effect.port == "support":
            _pure(build_support)(w, a.rotor, a.rotor.n_shaft + 2 * call.order, *_pure(_kernel(call))(_row(a, call)))
    plena = [call for call in a.calls if call.effect.port == "plenum"]
    for k in range(a.film.n_inj if a.film_model is not None else 0):
        w[a.film.capacity + k] = a.P.capacity[k] * prod(_pure(_kernel(c))(k, _row(a, c)) for c in plena)
    w[a.rotor.matrix_step] = 0.0


def _row(a: Assembly, call: Call) -> Any:
    return getattr(a.P, call.record)


def _kernel(call: Call) -> Callable[..., Any]:
    return type(call.effect).kernel


def _pure(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """The Python of a kernel: once in a while it is quicker than compiling."""
    return getattr(kernel, "py_func", kernel)
