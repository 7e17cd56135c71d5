"""Export to .fmu files: units of a plant, a linear model or a law, their C sources, binaries and archives.

Objects and the C wrapper are linked to shared libraries by gcc for this computer, by zig for every target. The table of
targets holds the names of each platform in LLVM, zig, FMI 2.0 and FMI 3.0.
"""

import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

from fmu.archive import DESCRIPTIONS, check_place, text, workspace, write_archive
from fmu.contents import contents
from fmu.importer import ImportedUnit, Reference, make_reference
from fmu.kernel_object import ObjectTarget, host_target, to_compile, write_objects
from fmu.law_code import write_law
from fmu.linear_units import LawUnit, LinearUnit
from fmu.model import PlantUnit, Unit, as_identifier, check_name, header, identifier, source
from fmu.sources import SHARED, build_description, list_sources, source_files
from fmu.turned import Over, listed, read_choices
from identification.lpv_model import LpvModel, load_model
from rotorsim.base.errors import DataError, ModelError
from rotorsim.base.files import write_text
from rotorsim.base.units import MPA, TO_RPM
from rotorsim.control import Law, load_law
from rotorsim.machine.limits import check_speed, speed_limit
from rotorsim.plant import Plant

AnyUnit = TypeVar("AnyUnit", bound=PlantUnit | LinearUnit | LawUnit)
VACUUM = 101325.0
"""Gauge pressure [Pa] below the standard atmosphere at which nothing is left."""
CORRECTIONS = 50
"""Corrections of a time step in hard real time, a factorisation counted as ten."""
START = (0.0, 0.3e6)
"""Speed [rad/s] and gauge pressure [Pa] at which a plant starts unless another is asked for."""


def plant_unit(
    plant: Plant, speed: float | None = None, pressure: float | None = None, over: Over | None = None
) -> PlantUnit:
    """A plant that starts at a speed [rad/s] and gauge pressure [Pa], by default `START`, with values that it offers.

    Raises DataError beyond the machine's limits, and for a pressure where gas is supplied to no film.
    """
    fed = bool(plant.assembly.film.n_inj)
    if pressure and not fed:
        raise DataError(
            f"pressure: {pressure / MPA:.4g} MPa is asked for, and gas is supplied to no film of {plant.machine.name}, "
            "whose unit has no input for it; leave it out"
        )
    speed = START[0] if speed is None else speed
    check_speed(plant.machine, speed)
    limit, why = speed_limit(plant.machine)
    if abs(speed) > limit:
        raise DataError(f"speed: {speed * TO_RPM:.6g} rpm is above {limit * TO_RPM:.6g} rpm ({why}); start lower")
    offered = tuple((path, listed(path, values)) for path, values in (over or {}).items())
    read_choices(plant.assembly, dict(offered))  # refuses before anything is compiled
    return PlantUnit(plant, speed, (START[1] if pressure is None else pressure) if fed else 0.0, over=offered)


def bounded(plant: Plant) -> Plant:
    """The plant for hard real time: with `CORRECTIONS` a step at most, unless its machine file states a bound."""
    if plant.machine.solver.corrections:
        return plant
    return Plant(plant.machine.with_({"solver.corrections": CORRECTIONS}))


def named(unit: AnyUnit, name: str | None) -> AnyUnit:
    """A unit under a chosen name, which also names its libraries; raises DataError for one that is no identifier."""
    return unit if name is None else replace(unit, chosen_name=check_name(name))


def linear_unit(given: LpvModel | str | Path, speed: float | None = None, pressure: float | None = None) -> LinearUnit:
    """An identified model, or that of a file, at a point [rad/s], [Pa] or in the middle of its range; DataError."""
    path = Path("model" if isinstance(given, LpvModel) else given)
    try:
        model = given if isinstance(given, LpvModel) else load_model(path)
    except ModelError as error:
        raise DataError(f"model: {error}, or take 'plant'") from error
    if not isinstance(model, LpvModel):
        raise DataError(
            f"model: {path}: is a model of one operating point; give an LPV model, which 'rotorsim identify' "
            "writes of records at several points"
        )
    middle = model.basis.middle
    start = [float(m) if v is None else v for m, v in zip(middle, (speed, pressure), strict=True)]
    if start[1] < -VACUUM:
        raise DataError(f"pressure: {start[1] / MPA:.4g} MPa gauge is below vacuum; give more than -0.1013 MPa")
    return LinearUnit(model, path.stem, start[0], start[1])


def law_unit(given: Law | str | Path, speed: float | None = None, pressure: float | None = None) -> LawUnit:
    """A control law, or that of a file; speed [rad/s] and gauge pressure [Pa] are start values; raises LawError."""
    starts: dict[str, Any] = {name: v for name, v in (("speed", speed), ("pressure", pressure)) if v is not None}
    return LawUnit(given if isinstance(given, Law) else load_law(given), **starts)


def clocked(unit: Unit) -> LawUnit:
    """A law's unit that answers at the ticks of a periodic clock; raises DataError for one that holds no law."""
    if isinstance(unit, LawUnit):
        return replace(unit, clocked=True)
    raise DataError("clocked: only a law has a clock; a plant and a model are stepped", argument="clocked")


@dataclass(frozen=True)
class Platform:
    """A platform; `folder2` and `folder3` are its folders below ``binaries`` in FMI 2.0 and 3.0.

    `cpu` and `features` are the oldest processor that its code is for.
    """

    name: str
    triple: str
    zig: str
    folder2: str
    folder3: str
    suffix: str = ".so"
    cpu: str = "x86-64"
    features: str = ""

    @property
    def linux(self) -> bool:
        """Whether it is a Linux."""
        return self.name.endswith("linux")


TARGETS = {
    t.name: t
    for t in (
        Platform("x86_64-linux", "x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17", "linux64", "x86_64-linux"),
        Platform("x86_64-windows", "x86_64-pc-windows-gnu", "x86_64-windows-gnu", "win64", "x86_64-windows", ".dll"),
        Platform(
            "aarch64-linux", "aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", "aarch64-linux", "aarch64-linux",
            cpu="generic",
        ),
        Platform(
            "x86_64-darwin", "x86_64-apple-macosx11.0.0", "x86_64-macos.11.0", "darwin64", "x86_64-darwin", ".dylib"
        ),
        Platform(
            "aarch64-darwin", "arm64-apple-macosx11.0.0", "aarch64-macos.11.0", "aarch64-darwin", "aarch64-darwin",
            ".dylib", "generic",
        ),
        Platform("x86-linux", "i686-unknown-linux-gnu", "x86-linux-gnu.2.17", "linux32", "x86-linux", cpu="pentium4"),
        Platform(
            "aarch32-linux", "armv7-unknown-linux-gnueabihf", "arm-linux-gnueabihf.2.17", "aarch32-linux",
            "aarch32-linux", cpu="generic", features="+vfp3d16",
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


FLAGS = ("-std=c11", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off", "-g0", "-s", "-Wall")
GNU = ("-Wl,--build-id=none", "-Wl,--gc-sections", "-Wl,-z,noexecstack")
EXTRA = "pip install 'rotorsim[fmu]'"


def compilers(targets: Sequence[Platform]) -> dict[str, list[str]]:
    """Command of the compiler for each target by its name; raises DataError for one that has none."""
    return {target.name: compiler(target, len(targets) == 1) for target in targets}


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


def compiles(model: Unit, targets: Sequence[Platform], cpu: str) -> bool:
    """Whether an export has to compile kernels, which takes about 20 s; objects of earlier ones are kept."""
    return isinstance(model, PlantUnit) and bool(to_compile(model.assembly.module.__name__, _jobs(targets, cpu)))


def _jobs(targets: Sequence[Platform], cpu: str) -> dict[str, ObjectTarget]:
    """Processor of each target by its name: this computer's own where `cpu` is native, else the oldest of its kind."""
    found = {}
    for target in targets:
        found[target.name] = ObjectTarget(target.triple, target.cpu, target.features)
        if cpu == "native" and target == host():
            found[target.name] = replace(host_target("native"), triple=target.triple)
    return found


def fmi_headers() -> Path:
    """Folder of the standard's C headers, which fmpy carries."""
    spec = importlib.util.find_spec("fmpy")
    folder = Path(str(spec.origin)).parent / "c-code" if spec and spec.origin else Path()
    if not (folder / "fmi3Functions.h").is_file():
        raise DataError(f"fmu export: the FMI headers of fmpy are not here; install them with {EXTRA}")
    return folder


def write_sources(unit: Unit, jobs: Mapping[str, ObjectTarget], folder: Path) -> tuple[str, ...]:
    """Write all C files and the objects NAME.o of the jobs; returns the names of the C files to be linked."""
    if isinstance(unit, PlantUnit):
        write_objects(unit.plant.machine.text, unit.assembly.module.__name__, unit.modules, dict(jobs), folder)
    texts = header(unit), source(unit)
    for name, content in zip(("tables.h", "tables.c"), texts, strict=True):
        (folder / name).write_text(content, encoding="utf-8")
    for file in (Path(__file__).parent / "c").iterdir():
        shutil.copy(file, folder)
    return (*SHARED, "fmi2.c", "fmi3.c", *unit.core)


def write_assembly(unit: Unit, targets: Sequence[Platform], cpu: str, folder: Path) -> dict[str, bytes]:
    """Assembly of a plant's kernels by its files, for the targets and every Linux; none of another unit.

    The objects of the targets are compiled with it, in one go.
    """
    if not isinstance(unit, PlantUnit):
        return {}
    known = [target for target in TARGETS.values() if target.linux or target in targets]
    jobs = {f"kernels_{name}": replace(job, assembly=True) for name, job in _jobs(known, "portable").items()}
    both = jobs | _jobs(targets, cpu)
    write_objects(unit.plant.machine.text, unit.assembly.module.__name__, unit.modules, both, folder)
    return {name: (folder / f"{name}.s").read_bytes() for name in jobs}


def build(model: Unit, targets: Sequence[Platform], cpu: str, folder: Path) -> dict[str, Path]:
    """Shared library of each target by its name, built in `folder`."""
    commands = compilers(targets)
    headers = fmi_headers()
    sources = write_sources(model, _jobs(targets, cpu), folder)
    return {t.name: _link(t, commands[t.name], headers, sources, folder) for t in targets}


def _link(target: Platform, command: Sequence[str], headers: Path, sources: Sequence[str], folder: Path) -> Path:
    library = folder / f"{target.name}{target.suffix}"
    kernels = [f"{target.name}.o"] if (folder / f"{target.name}.o").is_file() else []
    arguments = [
        *command, *FLAGS, *(GNU if target.linux else ()), "-I.", f"-I{headers}", *sources, *kernels, "-o", library.name,
        *(("-lm",) if target.linux else ()),
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


COMPILING = "compiling the kernels for use outside Python; later units of this kind of machine take them from the cache"


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
    with_sources: bool = False,
) -> dict[int, Path]:
    """Write the .fmu files and return where they are; `announce` is given a sentence before kernels are compiled.

    `with_sources` puts the unit's sources next to its binaries.

    Raises DataError for what cannot be written or compiled, NoLiftOffError where the plant has no equilibrium to start
    from.
    """
    if cpu not in ("portable", "native"):
        raise DataError(f"cpu: '{cpu}' is not known; choose portable or native")
    paths = file_names(out, chosen)
    if isinstance(model, LawUnit) and model.clocked and 2 in chosen:
        raise DataError("clocked: FMI 2.0 has no clocks; choose --fmi 3", argument="clocked")
    for path in paths.values():
        check_place(path)
    compilers(targets)
    if announce is not None and compiles(model, targets, cpu):
        announce(COMPILING)
    if host() not in targets:
        _try_start(model)
    with workspace() as folder:
        assembly = write_assembly(model, targets, cpu, folder) if with_sources else {}
        libraries = {name: file.read_bytes() for name, file in build(model, targets, cpu, folder).items()}
        reference = None
        if host() in targets:
            trial = folder / "trial.fmu"
            write_archive(trial, core(model, max(chosen), [host()], libraries))
            reference = _reference(model, trial)
            if announce is not None:
                for sentence in without_start(model, trial):
                    announce(sentence)
    for version, path in paths.items():
        more = contents(model, version, reference, [t.name for t in targets], cpu)
        if with_sources:
            more |= source_files(model, version, fmi_headers(), assembly)
            if version == 3:
                more["sources/buildDescription.xml"] = text(build_description(model)).encode()
        write_archive(path, core(model, version, targets, libraries, with_sources) | more)
    return paths


def code_names(out: Path) -> tuple[Path, Path]:
    """Header and source of a law for a microcontroller: `out` with the endings .h and .c in place of its own."""
    stem = out.with_suffix("") if out.suffix.lower() in (".c", ".h", ".fmu") else out
    return stem.with_name(f"{stem.name}.h"), stem.with_name(f"{stem.name}.c")


def export_code(unit: LawUnit, out: Path, precision: str = "float64") -> tuple[Path, Path]:
    """Write a law as C99 without FMI, a header and a source, and return where they are.

    Names in C begin with the chosen name, else with that of the files. Raises DataError for a precision that the law
    cannot have, and where the files cannot be written.
    """
    paths = code_names(out)
    name = unit.chosen_name or as_identifier(paths[0].stem)
    texts = write_law(unit.law, name, paths[0].stem, precision)
    for path, content in zip(paths, texts, strict=True):
        check_place(path)
        write_text(path, content)
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


def without_start(model: Unit, trial: Path) -> Iterator[str]:
    """Sentences about machines that a plant's unit offers and with which it does not start."""
    if not isinstance(model, PlantUnit) or not model.choices:
        return
    names = [one.name for one in model.choices]
    own, *others = product(*(one.values for one in model.choices))
    with ImportedUnit(trial) as unit:
        for values in others:
            instance = unit.instance()
            try:
                instance.initialise(dict(zip(names, values, strict=True)))
            except Exception as error:  # FMPy has several
                changed = [f"{name} = {x:g}" for name, x, start in zip(names, values, own, strict=True) if x != start]
                why = next(reversed(instance.messages), str(error))
                yield f"over: {', '.join(changed)}: the unit does not start ({why})"
            instance.slave.freeInstance()


def _try_start(model: Unit) -> None:
    if isinstance(model, PlantUnit):
        model.plant.equilibrium(model.speed, model.pressure)


def core(
    model: Unit, version: int, targets: Sequence[Platform], libraries: dict[str, bytes], with_sources: bool = False
) -> dict[str, bytes]:
    """Parts of an archive that are needed to run it: description and binaries."""
    root = DESCRIPTIONS[version](model)
    if with_sources and version == 2:
        list_sources(root, model)
    found = {"modelDescription.xml": text(root).encode()}
    for target in targets:
        folder = target.folder2 if version == 2 else target.folder3
        found[f"binaries/{folder}/{identifier(model)}{target.suffix}"] = libraries[target.name]
    return found
