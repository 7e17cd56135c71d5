"""Sources of the effects' equations: whole references by the keys that effects cite."""

import tomllib
from functools import lru_cache
from importlib.resources import files


@lru_cache(maxsize=1)
def references() -> dict[str, str]:
    """Every reference of the shipped effects by key."""
    return dict(tomllib.loads((files("rotorsim.effects") / "references.toml").read_text(encoding="utf-8")))
