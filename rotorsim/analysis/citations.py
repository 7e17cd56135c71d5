"""Sources that a machine, a record, a model, a law or a folder of them stands on."""

import tomllib
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import identification as idn
from rotorsim.base.errors import DataError
from rotorsim.base.foreign_systems import is_mat, read_mat
from rotorsim.base.input_files import parse_json
from rotorsim.base.references import cited_by, sorted_keys
from rotorsim.control import load_law
from rotorsim.effects import REGISTRY
from rotorsim.machine import Machine, load_machine

RESULTS = (".json", ".mat")
KINDS = ("law", "linear", "lpv")
"""Endings of files of models and laws, and what they call themselves."""
SHAFT = ("elements", "rotor", "modal", "assembly")
"""Modules of `fe_shaft` from which a plant takes its rotor."""
FILM = ("film", "residual", "transient", "newton", "ring")
"""Modules of `reynolds` with which a plant solves its film."""


def cite(what: str | Path) -> dict[str, list[str]]:
    """Return keys of sources by part, of a machine, a file of results or all results in a folder.

    Parameters
    ----------
    what : str or Path
        Shipped machine or machine file; record .nc, model or law .json or .mat; folder of such results.

    Returns
    -------
    dict of str to list of str
        By part (shaft, film, effects.NAME, experiment NAME, law NAME, ...) the keys in the bibliography.

    Raises
    ------
    DataError
        For a folder without results and a record that states no machine.
    MachineFileError, LawError, ModelError
        For files that cannot be read.

    Examples
    --------
    >>> from rotorsim.analysis import cite
    >>> cite("plain_rotor")["effects.unbalance"]
    ['thesis', 'friswell_2010']
    """
    path = Path(what)
    if path.is_dir():
        return _of_folder(path)
    if path.suffix == ".nc":
        return _of_record(path)
    if path.suffix in RESULTS:
        return _of_result(path)
    return _of_machine(load_machine(what))


def _of_folder(folder: Path) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    records = (p for p in folder.iterdir() if p.suffix == ".nc" or (p.suffix in RESULTS and _kind(p) in KINDS))
    for path in sorted(records):
        for part, keys in cite(path).items():
            found[part] = sorted_keys([*found.get(part, []), *keys])
    if not found:
        raise DataError(
            f"{folder}: holds no record (.nc), model or law (.json, .mat); give a machine, a file or their folder"
        )
    return found


def _kind(path: Path) -> str:
    """Return the kind that a .json or .mat file states, empty for none."""
    try:
        data: Any = read_mat(path) if is_mat(path) else parse_json(path.read_text(encoding="utf-8-sig"))
    except (ValueError, DataError):
        return ""
    return str(data.get("kind", "")) if isinstance(data, dict) else ""


def _of_record(path: Path) -> dict[str, list[str]]:
    """Return the sources of a record: of its machine and of its experiment."""
    attrs = idn.load(path).attrs
    if "machine" not in attrs:
        raise DataError(f"{path}: states no machine, as measured records do; give the machine that it is compared with")
    parts = _of_machine(Machine.from_text(str(attrs["machine"])))
    experiment = str(attrs.get("experiment", ""))
    keys = _keys(f"rotorsim.experiments.catalogue.{experiment}") if experiment.isidentifier() else []
    return parts | ({f"experiment {experiment}": keys} if keys else {})


def _of_result(path: Path) -> dict[str, list[str]]:
    """Return the sources of an identified model or of a law."""
    kind = _kind(path)
    if is_mat(path) and path.is_file() and kind not in KINDS:
        raise DataError(f"{path}: states neither model nor law; give a file that model.save or law.save wrote")
    if kind == "law":
        law = load_law(path)
        design = _keys(f"rotorsim.control.designs.{law.name}")
        return {f"law {law.name}": sorted_keys([*design, *cited_by("rotorsim.control.law")])}
    model = idn.load_model(path)
    local = cited_by("identification.local")
    surfaces = cited_by("identification.lpv_fit") if isinstance(model, idn.LpvModel) else ()
    return {"identification": sorted_keys([*local, *surfaces])}


def _keys(module: str) -> list[str]:
    """Return the keys that a module cites, none where there is no such module."""
    try:
        return list(cited_by(module))
    except ModuleNotFoundError:
        return []


@cache
def machine_sources() -> dict[str, list[str]]:
    """Return the keys of the sources of the shipped machines, by name."""
    text = (files("rotorsim.machine") / "sources.toml").read_text(encoding="utf-8")
    return dict(tomllib.loads(text))


def _of_machine(machine: Machine) -> dict[str, list[str]]:
    """Return keys of sources by the part of the machine that stands on them, parts without a source left out.

    A key is one of `rotorsim.base.references.references`, or a whole reference that a user's own effect gives.
    """
    found = {"machine file": machine_sources().get(machine.name, [])}
    found["shaft"] = _cited("fe_shaft", SHAFT)
    found["coupled step"] = list(cited_by("rotorsim.plant.kernels.modal_rotor"))
    if machine.film is not None:
        found["film"] = _cited("reynolds", FILM)
        found["sleeves"] = _cited(
            "reynolds", dict.fromkeys(name for film in machine.films for name in film.sleeve.modules)
        )
        found["equilibrium"] = list(cited_by("rotorsim.plant.kernels.equilibrium_kernel"))
    if machine.thrust_bearings:
        found["thrust bearings"] = _cited("reynolds", ["thrust"])
    if machine.injectors:
        found["injectors"] = list(cited_by("reynolds.injector"))
    if machine.actuators is not None:
        found["actuators"] = list(cited_by("rotorsim.plant.kernels.injectors"))
    found |= {f"effects.{name}": list(REGISTRY[name].cites) for name in machine.effects}
    return {part: sorted_keys(keys) for part, keys in found.items() if keys}


def _cited(package: str, modules: Iterable[str]) -> list[str]:
    return [key for module in modules for key in cited_by(f"{package}.{module}")]
