"""Linking of objects and C wrapper to shared libraries: gcc for this computer, zig for every target.

The table of targets holds the names of each platform in LLVM, zig, FMI 2.0 and FMI 3.0.
"""

from __future__ import annotations

import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fmu.kernel_object import ObjectTarget, host_target, to_compile
from fmu.kinds import write_sources
from fmu.model import PlantUnit, Unit
from rotorsim.base.errors import DataError

FLAGS = ("-std=c11", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off", "-g0", "-s", "-Wall")
GNU = ("-Wl,--build-id=none", "-Wl,--gc-sections", "-Wl,-z,noexecstack")
EXTRA = "pip install 'rotorsim[fmu]'"


def build(model: Unit, targets: Sequence[Platform], cpu: str, folder: Path) -> dict[str, Path]:
    """Shared library of each target by its name, built in `folder`."""
    commands = compilers(targets)
    headers = fmi_headers()
    sources = write_sources(model, _jobs(targets, cpu), folder)
    return {t.name: _link(t, commands[t.name], headers, sources, folder) for t in targets}


def compilers(targets: Sequence[Platform]) -> dict[str, list[str]]:
    """Command of the compiler for each target by its name; raises DataError for one that has none."""
    return {target.name: compiler(target, len(targets) == 1) for target in targets}


def compiles(model: Unit, targets: Sequence[Platform], cpu: str) -> bool:
    """Whether an export has to compile kernels, which takes about 20 s; objects of earlier ones are kept."""
    return isinstance(model, PlantUnit) and bool(to_compile(model.assembly.module.__name__, _jobs(targets, cpu)))


def _jobs(targets: Sequence[Platform], cpu: str) -> dict[str, ObjectTarget]:
    return {target.name: _object_target(target, cpu) for target in targets}


def _object_target(target: Platform, cpu: str) -> ObjectTarget:
    if cpu == "native" and target == host():
        native = host_target("native")
        return ObjectTarget(target.triple, native.cpu, native.features)
    return ObjectTarget(target.triple, "generic" if target.name.startswith("aarch64") else "x86-64")


def compiler(target: Platform, alone: bool) -> list[str]:
    """Command of the compiler for a target; gcc only where nothing but this computer is asked for (`alone`).

    Raises DataError that names what to install: gcc builds for this one only.
    """
    gcc = os.environ.get("CC") or shutil.which("gcc") or shutil.which("cc")
    if alone and target == host() and gcc:
        return shlex.split(gcc)
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc", "-target", target.zig]
    if alone and target == host():
        raise DataError(f"fmu export: no compiler for {target.name} is here; install gcc, or {EXTRA}")
    raise DataError(f"targets: other platforms than this one need zig, which is not here; install it with {EXTRA}")


def fmi_headers() -> Path:
    """Folder of the standard's C headers, which fmpy carries."""
    spec = importlib.util.find_spec("fmpy")
    folder = Path(str(spec.origin)).parent / "c-code" if spec and spec.origin else Path()
    if not (folder / "fmi3Functions.h").is_file():
        raise DataError(f"fmu export: the FMI headers of fmpy are not here; install them with {EXTRA}")
    return folder


def _link(target: Platform, command: Sequence[str], headers: Path, sources: Sequence[str], folder: Path) -> Path:
    library = folder / f"{target.name}{target.suffix}"
    linux = target.name.endswith("linux")
    kernels = [f"{target.name}.o"] if (folder / f"{target.name}.o").is_file() else []
    arguments = [
        *command, *FLAGS, *(GNU if linux else ()), "-I.", f"-I{headers}", *sources, *kernels, "-o", library.name,
        *(("-lm",) if linux else ()),
    ]  # fmt: skip
    try:
        done = subprocess.run(arguments, cwd=folder, capture_output=True, text=True)
    except OSError as error:
        raise DataError(
            f"fmu export: the compiler '{command[0]}' cannot be run ({error.strerror}); check CC"
        ) from error
    if done.returncode or not library.is_file():
        lines = (
            [line for line in done.stderr.splitlines() if "error" in line] or done.stderr.splitlines() or ["no output"]
        )
        raise DataError(f"fmu export: linking for {target.name} failed: {lines[0][:300]}; check the compiler")
    return library


@dataclass(frozen=True)
class Platform:
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
        Platform("x86_64-linux", "x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17", "linux64", "x86_64-linux", ".so"),
        Platform("x86_64-windows", "x86_64-pc-windows-gnu", "x86_64-windows-gnu", "win64", "x86_64-windows", ".dll"),
        Platform(
            "aarch64-linux", "aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", "aarch64-linux", "aarch64-linux",
            ".so",
        ),
        Platform(
            "x86_64-darwin", "x86_64-apple-macosx11.0.0", "x86_64-macos.11.0", "darwin64", "x86_64-darwin", ".dylib"
        ),
        Platform(
            "aarch64-darwin", "arm64-apple-macosx11.0.0", "aarch64-macos.11.0", "aarch64-darwin", "aarch64-darwin",
            ".dylib",
        ),
    )
}  # fmt: skip


def host() -> Platform:
    """The platform of this computer."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    name = f"{machine}-{platform.system().lower()}"
    if name not in TARGETS:
        raise DataError(f"targets: this computer is a {name}; choose from {', '.join(TARGETS)}")
    return TARGETS[name]


def choose(names: str) -> tuple[Platform, ...]:
    """Targets of a list like ``host,x86_64-windows``, each once, in the order of the table."""
    wanted = [part.strip() for part in names.split(",") if part.strip()]
    for name in wanted:
        if name != "host" and name not in TARGETS:
            raise DataError(f"targets: '{name}' is not known; choose from host, {', '.join(TARGETS)}")
    if not wanted:
        raise DataError(f"targets: none given; choose from host, {', '.join(TARGETS)}")
    chosen = {host().name if name == "host" else name for name in wanted}
    return tuple(target for target in TARGETS.values() if target.name in chosen)
