"""Classes of effects that no campaign of a rig can distinguish; a diagnosis names the class.

Each effect declares the signature of its forms. Equal ones were derived from the equations: a bow of the shaft and a
runout at 1X both add a constant vector that turns with the shaft; delay and lag of a sensor differ at the second order
in frequency times time; the flow through a choked seat is its area times the pressure; of two sensors' gains only the
ratio shows next to gains of the actuators. Others are beyond any record's resolution.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from rotorsim.effects import REGISTRY
from rotorsim.effects.diagnosis import CandidateForm


def class_of(key: str, known: Iterable[str]) -> tuple[str, ...]:
    """Keys ('effect.parameter') among `known` that cannot be distinguished from `key`, itself included."""
    signature, place = _signature(key)
    if not signature:
        return (key,)
    return tuple(sorted(k for k in {*known} if _signature(k) == (signature, place)))


def alike_by_weight(key: str, found: Mapping[str, float], known: Iterable[str]) -> tuple[str, ...]:
    """Keys among `known` that respond nearly as `key` does in a rotor with a weight, itself included.

    `found` holds the values of its effect's parameters. A shaft of unequal stiffness (asymmetric, cracked) that the
    weight bends by s makes a force of s times half the difference that turns forward at 2X, as a coupling may; the
    probes of one plane distinguish them by little more than their places along the shaft.
    """
    form = _form(key)
    if form is None or not form.with_weight or found.get(form.from_value[0], 0.0) < form.from_value[1]:
        return (key,)
    same = {k for k in known if (other := _form(k)) is not None and other.with_weight == form.with_weight}
    return tuple(sorted(same | {key}))


def same_class(a: str, b: str) -> bool:
    """Whether two keys are of one class: together they can be any size of each, one against the other."""
    signature, _ = _signature(a)
    return bool(signature) and _signature(a) == _signature(b)


def of_one_force(a: str, b: str) -> bool:
    """Whether two keys are forms of one kind of force, of which a diagnosis names one alone."""
    first, second = _form(a), _form(b)
    return first is not None and second is not None and first.alone_of == second.alone_of != ""


def resembles(key: str) -> str:
    """Known cause with the same signature that is not an effect of the catalogue; empty if there is none."""
    form = _form(key)
    return form.resembles if form is not None else ""


def signature_of(key: str) -> str:
    """What forms of its class have in common, in words; empty where it is distinguishable."""
    return _signature(key)[0]


def _signature(key: str) -> tuple[str, str]:
    """Signature of a form, and the injector that it is of."""
    form = _form(key)
    return (form.signature, key.partition(" of ")[2]) if form is not None else ("", "")


def _form(key: str) -> CandidateForm | None:
    name, _, parameter = key.partition(" of ")[0].partition(".")
    forms = REGISTRY[name].forms if name in REGISTRY else ()
    return next((f for f in forms if f.parameter == parameter), None)
