"""Target platforms of a unit, and their names in LLVM, zig, FMI 2.0 and FMI 3.0."""

from __future__ import annotations

import platform
from dataclasses import dataclass

from rotorsim.base.errors import DataError


@dataclass(frozen=True)
class Target:
    """A platform; `folder2` and `folder3` are its folders below ``binaries`` in FMI 2.0 and 3.0."""

    name: str
    triple: str
    zig: str
    folder2: str
    folder3: str
    suffix: str


TARGETS = {
    t.name: t
    for t in (
        Target("x86_64-linux", "x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17", "linux64", "x86_64-linux", ".so"),
        Target("x86_64-windows", "x86_64-pc-windows-gnu", "x86_64-windows-gnu", "win64", "x86_64-windows", ".dll"),
        Target(
            "aarch64-linux", "aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", "aarch64-linux", "aarch64-linux",
            ".so",
        ),
        Target(
            "x86_64-darwin", "x86_64-apple-macosx11.0.0", "x86_64-macos.11.0", "darwin64", "x86_64-darwin", ".dylib"
        ),
        Target(
            "aarch64-darwin", "arm64-apple-macosx11.0.0", "aarch64-macos.11.0", "aarch64-darwin", "aarch64-darwin",
            ".dylib",
        ),
    )
}  # fmt: skip


def host() -> Target:
    """The platform of this computer."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    name = f"{machine}-{platform.system().lower()}"
    if name not in TARGETS:
        raise DataError(f"targets: this computer is a {name}; choose from {', '.join(TARGETS)}")
    return TARGETS[name]


def choose(names: str) -> tuple[Target, ...]:
    """Targets of a list like ``host,x86_64-windows``, each once, in the order of the table."""
    wanted = [part.strip() for part in names.split(",") if part.strip()]
    for name in wanted:
        if name != "host" and name not in TARGETS:
            raise DataError(f"targets: '{name}' is not known; choose from host, {', '.join(TARGETS)}")
    if not wanted:
        raise DataError(f"targets: none given; choose from host, {', '.join(TARGETS)}")
    chosen = {host().name if name == "host" else name for name in wanted}
    return tuple(target for target in TARGETS.values() if target.name in chosen)
