"""Effects of installed packages: loading of the modules that their entry points name.

Whoever installs a package chose to run it; nothing that a machine file or a record names is ever imported.
"""

import warnings
from functools import cache
from importlib.metadata import EntryPoint, entry_points

from rotorsim.base.errors import PackageLeftOut
from rotorsim.effects.base import REGISTRY, Effect

LEFT_OUT: dict[str, str] = {}
"""Why the package of an effect could not be loaded, by the name of its entry point."""


def registry() -> dict[str, type[Effect]]:
    """Every effect by name, with those of installed packages."""
    while points := _waiting():
        load_installed(points.pop())
    return REGISTRY


@cache
def _waiting() -> list[EntryPoint]:
    """Entry points that are not loaded yet; whoever loads one takes it away."""
    return sorted(entry_points(group="rotorsim.effects"), reverse=True)


def load_installed(point: EntryPoint) -> None:
    """Import the module of an entry point, which registers its effects.

    One that fails, such as a package written for another version, is a warning: everything else works without it, and
    a machine file that has its effect is answered with the package and the reason.
    """
    try:
        point.load()
    except Exception as error:  # whatever foreign code raises when it is imported
        package = point.dist.name if point.dist else point.module
        text = str(error).partition(" (")[0] if isinstance(error, ImportError) else str(error)  # without the file
        reason = f"{type(error).__name__}: {text}".splitlines()[0]
        LEFT_OUT[point.name] = f"its package {package} could not be loaded ({reason}); update or uninstall it"
        warnings.warn(
            f"effect '{point.name}' of the package {package} is left out ({reason}); update or uninstall the package",
            PackageLeftOut,
            stacklevel=2,
        )
