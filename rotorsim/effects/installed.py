"""Effects of installed packages: loading of the modules that their entry points name.

Whoever installs a package chose to run it; nothing that a machine file or a record names is ever imported.
"""

import warnings
from importlib.metadata import EntryPoint


def load_installed(point: EntryPoint) -> None:
    """Import the module of an entry point, which registers its effects.

    One that fails, such as a package written for another version, is a warning: everything else works without it, and
    a machine file that has its effect is answered with the effect's name.
    """
    try:
        point.load()
    except Exception as error:  # whatever foreign code raises when it is imported
        package = point.dist.name if point.dist else point.module
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        warnings.warn(
            f"effect '{point.name}' of the package {package} is left out ({reason}); update or uninstall the package",
            stacklevel=2,
        )
