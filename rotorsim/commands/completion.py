"""Values that the shell completes: machines, effects, designs, shipped targets and plans, with files where they may be.

Install with `rotorsim --install-completion`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from importlib.resources import files
from pathlib import Path


def laws() -> list[str]:
    """Names of the designs that write a law, from the simplest on."""
    from rotorsim.control import designs as found

    names = sorted(name for name in dir(found) if name not in found.IN_PYTHON)
    return sorted(names, key=lambda name: [*found.IN_ORDER, name].index(name))


def _matching(names: Iterable[str], incomplete: str) -> list[str]:
    return sorted(name for name in names if name.startswith(incomplete))


def _shipped(package: str, folder: str, ending: str = ".toml") -> list[str]:
    """Names of the files of a folder of a package, unimported where it is not yet."""
    place = files("rotorsim").joinpath(*package.split("/"), folder)
    return [one.name.removesuffix(ending) for one in place.iterdir() if one.name.endswith(ending)]


def _near(incomplete: str, *endings: str) -> list[str]:
    """Files with these endings, and folders, that begin so."""
    given = Path(incomplete)
    folder = given if incomplete.endswith("/") else given.parent
    if not folder.is_dir():
        return []
    found = (one for one in folder.iterdir() if one.suffix in endings or (one.is_dir() and one.name[0] != "."))
    return _matching((f"{one}/" if one.is_dir() else str(one) for one in found), incomplete)


def machines(incomplete: str) -> list[str]:
    """Shipped machines and machine files."""
    return _matching(_shipped("machine", "rigs"), incomplete) + _near(incomplete, ".toml")


def plans(incomplete: str) -> list[str]:
    """Shipped plans of campaigns and plan files."""
    return _matching(_shipped("campaign", "plans"), incomplete) + _near(incomplete, ".toml")


def targets(incomplete: str) -> list[str]:
    """Shipped targets of a calibration and files of them."""
    return _matching(_shipped("analysis", "shipped"), incomplete) + _near(incomplete, ".toml")


def effects(incomplete: str) -> list[str]:
    """Names of effects, of installed packages too."""
    from rotorsim.effects import REGISTRY

    return _matching(REGISTRY, incomplete)


def parameters(incomplete: str) -> list[str]:
    """Names of effects, and their parameters after a dot."""
    from rotorsim.effects import REGISTRY

    name, dot, _ = incomplete.partition(".")
    if not dot or name not in REGISTRY:
        return effects(incomplete)
    return _matching((f"{name}.{entry.name}" for entry in fields(REGISTRY[name])), incomplete)


def designs(incomplete: str) -> list[str]:
    """Names of controller designs."""
    return _matching(laws(), incomplete)
