"""Export to .fmu files: kernels, wrapper, model description, documentation and reference in one archive each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from fmu.archive import check_place, workspace, write_archive
from fmu.binaries import Platform, build, compilers, compiles, host
from fmu.contents import contents
from fmu.description import DESCRIPTIONS, text
from fmu.model import PlantUnit, Unit, identifier
from fmu.reference import Reference, make_reference
from rotorsim.base.errors import DataError

COMPILING = "compiling the kernels for use outside Python: about 20 s, once for this kind of machine"


def versions(words: str) -> tuple[int, ...]:
    """FMI versions of a list like ``2,3``."""
    wanted = [word.strip().removesuffix(".0") for word in words.split(",") if word.strip()]
    wrong = [word for word in wanted if word not in ("2", "3")]
    if wrong or not wanted:
        raise DataError(f"fmi: '{','.join(wrong) or words}' is not known; choose 2, 3 or 2,3")
    return tuple(sorted({int(word) for word in wanted}))


def file_names(out: Path, chosen: Sequence[int]) -> dict[int, Path]:
    """File of each version: `out` itself, or with both ``NAME_fmi2.fmu`` and ``NAME_fmi3.fmu``; .fmu is added."""
    out = out if out.suffix.lower() == ".fmu" else out.with_name(f"{out.name}.fmu")
    if len(chosen) == 1:
        return {chosen[0]: out}
    return {v: out.with_name(f"{out.stem}_fmi{v}{out.suffix}") for v in chosen}


def export(
    model: Unit,
    out: Path,
    chosen: Sequence[int],
    targets: Sequence[Platform],
    cpu: str = "portable",
    announce: Callable[[str], None] | None = None,
) -> dict[int, Path]:
    """Write the .fmu files and return where they are; `announce` is given a sentence before kernels are compiled.

    Raises DataError for what cannot be written or compiled, NoLiftOffError where the plant has no equilibrium to start
    from.
    """
    if cpu not in ("portable", "native"):
        raise DataError(f"cpu: '{cpu}' is not known; choose portable or native")
    paths = file_names(out, chosen)
    for path in paths.values():
        check_place(path)
    compilers(targets)
    if announce is not None and compiles(model, targets, cpu):
        announce(COMPILING)
    if host() not in targets:
        _try_start(model)
    with workspace() as folder:
        libraries = {name: file.read_bytes() for name, file in build(model, targets, cpu, folder).items()}
        reference = None
        if host() in targets:
            trial = folder / "trial.fmu"
            write_archive(trial, core(model, max(chosen), [host()], libraries))
            reference = _reference(model, trial)
    for version, path in paths.items():
        more = contents(model, version, reference, [t.name for t in targets], cpu)
        write_archive(path, core(model, version, targets, libraries) | more)
    return paths


def _reference(model: Unit, trial: Path) -> Reference:
    """Run of the unit itself; where it finds no start, the Python plant gives the reason."""
    try:
        return make_reference(model, trial)
    except Exception as error:  # FMPy has several
        _try_start(model)
        raise DataError(
            f"fmu export: the unit that was built does not run here ({error}); check the compiler and the point"
        ) from error


def _try_start(model: Unit) -> None:
    if isinstance(model, PlantUnit):
        model.plant.equilibrium(model.speed, model.pressure)


def core(model: Unit, version: int, targets: Sequence[Platform], libraries: dict[str, bytes]) -> dict[str, bytes]:
    """Parts of an archive that are needed to run it: description and binaries."""
    found = {"modelDescription.xml": text(DESCRIPTIONS[version](model)).encode()}
    for target in targets:
        folder = target.folder2 if version == 2 else target.folder3
        found[f"binaries/{folder}/{identifier(model)}{target.suffix}"] = libraries[target.name]
    return found
