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
            dof = a.rotor.n_machine + 2 * call.order
            _pure(build_support)(w, a.rotor, call.film or 0, dof, *_pure(_kernel(call))(_row(a, call)))
    for f, film in enumerate(a.films):
        plena = [c for c in a.calls if c.effect.port == "plenum" and c.film in (None, f)]
        capacity = a.film_part(w, f)[a.film.capacity :]
        for k in range(len(film.injectors)):
            factor = prod(_pure(_kernel(c))(k, _row(a, c)) for c in plena)
            capacity[k] = a.P.capacity[f * a.film.n_inj + k] * factor
    w[a.rotor.matrix_step] = 0.0


def _row(a: Assembly, call: Call) -> Any:
    return getattr(a.P, call.record)


def _kernel(call: Call) -> Callable[..., Any]:
    return type(call.effect).kernel


def _pure(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """The Python of a kernel: once in a while it is quicker than compiling."""
    return getattr(kernel, "py_func", kernel)
