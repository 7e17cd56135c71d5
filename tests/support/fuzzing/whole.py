"""Random whole machines of any structure, too many to compile: shaft, bearings, film and effects."""

from dataclasses import fields
from typing import Any, get_args

import tomlkit
from hypothesis import strategies as st

from fuzzing.values import legal, text_of
from rotorsim.base.quantity import Quantity, quantity_of
from rotorsim.base.units import show
from rotorsim.effects import REGISTRY, Effect
from rotorsim.machine import (
    GasFilm,
    Grid,
    HousingAcceleration,
    HousingVelocity,
    Injection,
    LinearBearing,
    Shaft,
    ShaftProbe,
)
from rotorsim.machine.gas_film import Actuators, Gas, PinnedInjector
from rotorsim.machine.numerics import Solver
from rotorsim.machine.part import Part
from rotorsim.machine.rotor import Disc, Drive, ShaftMaterial

LIKELY = {
    "youngs_modulus": 2e11, "density": 7850.0, "damping_ratio": 0.01, "kxx": 1e7, "mass": 2.0, "polar_inertia": 0.01,
    "diametral_inertia": 0.01, "seat_gap": 4e-5, "pin_diameter": 2e-3, "orifice_diameter": 2e-3,
}  # fmt: skip


def value(draw: Any, name: str, spec: Quantity) -> Any:
    """Text or number of a legal value."""
    text = text_of(draw(legal(spec, LIKELY.get(name))), spec)
    return (int(text) if spec.multiple else float(text)) if spec.unit == "1" else text


def table(draw: Any, part: type[Part], skip: tuple[str, ...] = (), must: tuple[str, ...] = ()) -> dict[str, Any]:
    """The quantities of a part: those it must have, and some of the others."""
    drawn = {}
    for name, info in part.model_fields.items():
        spec = quantity_of(info)
        if spec and name not in skip and (info.is_required() or name in must or draw(st.integers(0, 3)) == 3):
            drawn[name] = value(draw, name, spec)
    return drawn


@st.composite
def shafts(draw: Any) -> tuple[dict[str, Any], float, float]:
    """A shaft, where it starts and how long it is [m]."""
    start, lengths = draw(st.floats(-2, 2)), draw(st.lists(st.floats(0.02, 1), min_size=1, max_size=4))
    pieces = []
    for length in lengths:
        outer = draw(st.floats(0.005, 0.2))
        bore = draw(st.sampled_from([0.0, 0.0, 0.5, 0.99])) * outer
        pieces.append(
            {
                key: show(v, "m")
                for key, v in zip(("length", "outer_diameter", "inner_diameter"), (length, outer, bore), strict=True)
            }
        )
    shaft = table(draw, Shaft, ("start", "max_element_length"))
    material = table(draw, ShaftMaterial)
    return shaft | {"start": show(start, "m"), "material": material, "sections": pieces}, start, sum(lengths)


@st.composite
def films(draw: Any, start: float, length: float) -> dict[str, Any]:
    """A gas film near the middle of the shaft, and what feeds it."""
    diameter = draw(st.floats(0.005, 0.2))
    film = table(draw, GasFilm, ("position", "diameter", "length", "clearance")) | {"kind": "gas_film"}
    sizes = {
        "position": start + length * draw(st.floats(0.4, 0.6)),
        "diameter": diameter,
        "length": length * draw(st.floats(0.05, 0.6)),
        "clearance": diameter * 10 ** draw(st.floats(-4, -2)),
    }
    film |= {name: show(size, "m") for name, size in sizes.items()}
    law = draw(st.sampled_from(["orifice", "loss_factor"]))
    needed = ("pin_discharge",) if law == "orifice" else ("loss_factor",)
    injection = table(draw, Injection, ("minimum_gap",), needed) | {"law": law, "minimum_gap": "0 m"}
    injectors = [
        table(draw, PinnedInjector, ("offset",), ("pd_gain", "pd_zero"))
        | {"reference": draw(st.sampled_from(["+x", "-x", "+y", "-y", "none"]))}
        for _ in range(draw(st.integers(0, 5)))
    ]
    made: dict[str, Any] = {"bearing": film, "gas": table(draw, Gas)}
    if injectors:
        made |= {"injection": injection, "injectors": injectors}
        mode = draw(st.sampled_from(["ideal", "voltage", "reference", ""]))
        made |= {"actuators": table(draw, Actuators, ("lowest", "highest")) | {"mode": mode}} if mode else {}
    return made


def effect(draw: Any, kind: type[Effect], start: float, length: float) -> dict[str, Any]:
    """Some of the parameters of an effect."""
    drawn: dict[str, Any] = {}
    for field in fields(kind):
        spec = quantity_of(field)
        if field.name == "position":
            drawn["position"] = show(start + length * draw(st.floats(0.05, 0.95)), "m")
        elif spec and draw(st.booleans()):
            drawn[field.name] = draw(st.integers(1, 4)) if spec.multiple else value(draw, field.name, spec)
    return drawn


def probe(draw: Any, number: int, start: float, length: float) -> dict[str, Any]:
    """A probe of any kind; one of the housing is refused where nothing moves it."""
    kind = draw(st.sampled_from([ShaftProbe, ShaftProbe, HousingVelocity, HousingAcceleration]))
    drawn = table(draw, kind, ("position",)) | {"name": f"P{number}", "sense": draw(st.sampled_from("+-"))}
    drawn["quantity"] = draw(st.sampled_from(get_args(kind.model_fields["quantity"].annotation)))
    return drawn | {"position": show(start + length * draw(st.floats(0, 1)), "m")}


@st.composite
def whole_machines(draw: Any) -> str:
    """TOML text of a machine; legal but for what only shows when its parts meet."""
    shaft, start, length = draw(shafts())
    places = st.floats(0, 1).map(lambda share: show(start + share * length, "m"))
    made: dict[str, Any] = {
        "name": draw(st.text(max_size=12)),
        "description": draw(st.text(max_size=12)),
        "shaft": shaft,
    }
    made["discs"] = [
        table(draw, Disc, ("position",)) | {"position": draw(places)} for _ in range(draw(st.integers(0, 2)))
    ]
    made["bearings"] = [
        table(draw, LinearBearing, ("position",)) | {"kind": "linear", "position": place}
        for place in draw(st.lists(places, min_size=1, max_size=3, unique=True))
    ]
    if draw(st.booleans()):
        film = draw(films(start, length))
        made["bearings"].append(film.pop("bearing"))
        made |= film
    made["probes"] = [probe(draw, k, start, length) for k in range(draw(st.integers(0, 3)))]
    made["drive"] = table(draw, Drive)
    made["solver"] = table(draw, Solver, ("time_step",)) | {
        "time_step": draw(st.sampled_from(["0.2 ms", "0.1 ms", "50 us", "1 us"]))
    }
    made["grid"] = {"n_theta": draw(st.sampled_from([8, 12, 32])), "n_z": draw(st.sampled_from([4, 6, 16]))}
    assert set(made["grid"]) < set(Grid.model_fields)
    kinds = draw(st.lists(st.sampled_from(sorted(REGISTRY)), max_size=4, unique=True))
    made["effects"] = {name: effect(draw, REGISTRY[name], start, length) for name in kinds}
    return tomlkit.dumps(made)
