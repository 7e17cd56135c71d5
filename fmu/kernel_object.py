"""Compiles the machine's step to native object files; the only user of numba's private API.

A child process with numba's own optimiser, CPU and cache switched off compiles the entry point of the composed module
(rotorsim.plant.kernels.entry.serve) to plain LLVM IR; llvmlite turns that into one object per target. Only the
entry is visible to the linker, and hidden in what is linked, because two units in one process must not meet.

Calling convention: ``int32 serve_entry(int64 *result, void **error, ARGUMENTS)``, 0 for success, an array as (meminfo,
parent, items, item size, data, shape..., strides...), a record as its address, a number as itself.
"""

import hashlib
import importlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fmu.archive import temporary_error, workspace
from reynolds.compiler import link_only
from rotorsim.base.cache import in_cache
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.files import WriteError, write_bytes

ENTRY = "rotorsim_serve"
NO_PLACE = 3
"""Exit code of a child whose disk takes no more."""
ISOLATED = {
    "NUMBA_OPT": "0",
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "NUMBA_DISABLE_INTEL_SVML": "1",
    "NUMBA_DISABLE_JIT": "0",
    "NUMBA_DEBUGINFO": "0",
}
"""Set before numba is imported: a cache hit would carry no IR, an optimised one suits one kind of processor only."""
LIBRARY_FUNCTIONS = frozenset(
    {
        "cos", "sin", "sincos", "tan", "tanh", "acos", "asin", "atan", "atan2", "exp", "exp2", "expm1", "log", "log2",
        "log10", "log1p", "pow", "sqrt", "cbrt", "fmod", "floor", "ceil", "trunc", "round", "fabs", "hypot", "fmin",
        "fmax", "memset", "memcpy", "memmove",
    }
)  # fmt: skip
"""Symbols that an object may leave to the C library."""


class KernelExportError(RotorsimError):
    """The kernels cannot be compiled for use outside Python."""


@dataclass(frozen=True)
class ObjectTarget:
    """LLVM triple, processor and features of one object file, or of its assembly."""

    triple: str
    cpu: str = ""
    features: str = ""
    assembly: bool = False

    @property
    def suffix(self) -> str:
        """Ending of its file."""
        return ".s" if self.assembly else ".o"


def write_objects(
    machine_text: str, kernels: str, modules: Sequence[str], jobs: dict[str, ObjectTarget], folder: Path
) -> None:
    """Write ``folder/NAME.o``, or NAME.s, for every job; `modules` are imported first, because they register effects.

    `kernels` names what is compiled (a hash of all sources): objects are kept in the user's cache under it, because
    other values of parameters do not change them. Raises KernelExportError with the last line of the child's error.
    """
    missing = to_compile(kernels, jobs)
    if missing:
        _compile(machine_text, modules, missing, folder)
    for name, target in jobs.items():
        file = _kept(kernels, target)
        if name in missing:
            with suppress(WriteError):  # the cache saves time and nothing else
                write_bytes(file, (folder / f"{name}{target.suffix}").read_bytes())
        else:
            shutil.copy(file, folder / f"{name}{target.suffix}")


def to_compile(kernels: str, jobs: Mapping[str, ObjectTarget]) -> dict[str, ObjectTarget]:
    """Those of the jobs whose object is not kept."""
    return {name: target for name, target in jobs.items() if not _kept(kernels, target).is_file()}


def _kept(kernels: str, target: ObjectTarget) -> Path:
    """Folder that keeps an object, named by everything that it depends on."""
    words = (kernels, repr(target), version("numba"), version("llvmlite"), Path(__file__).read_text(encoding="utf-8"))
    return in_cache("objects") / f"{hashlib.sha256(repr(words).encode()).hexdigest()[:32]}{target.suffix}"


def _compile(machine_text: str, modules: Sequence[str], jobs: dict[str, ObjectTarget], folder: Path) -> None:
    """Run the child process."""
    request = {
        "machine": machine_text,
        "modules": list(modules),
        "path": sys.path,
        "jobs": {name: [job.triple, job.cpu, job.features, job.assembly] for name, job in jobs.items()},
        "folder": str(folder),
    }
    with workspace() as cache:
        environment = os.environ | ISOLATED | {"ROTORSIM_CACHE_DIR": str(cache), "NUMBA_CACHE_DIR": str(cache)}
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
        done = subprocess.run(
            [sys.executable, "-P", "-m", "fmu.kernel_object"],
            input=json.dumps(request), text=True, capture_output=True, env=environment,
        )  # fmt: skip
    if done.returncode:
        lines = done.stderr.strip().splitlines() or [f"the compiler ended with code {done.returncode}"]
        if done.returncode == NO_PLACE:
            raise DataError(lines[-1])
        if done.returncode < 0:  # e.g. by the system, for want of memory
            raise DataError(f"fmu export: signal {-done.returncode} ended the compiling; free memory and export again")
        raise KernelExportError(
            f"fmu: the kernels do not compile outside Python: {lines[-1]}; simplify the effect named"
        )


def _child() -> None:
    """Work of the child process: read a request, compile, write the objects."""
    request = json.load(sys.stdin)
    sys.path[:] = request["path"]
    for module in request["modules"]:
        importlib.import_module(module)
    from rotorsim.machine.schema import Machine
    from rotorsim.plant.assemble import assemble

    link_only()
    assembly = assemble(Machine.from_text(request["machine"]))
    ir = entry_ir(assembly.module.serve, serve_signature(assembly), ENTRY)
    for name, words in request["jobs"].items():
        target = ObjectTarget(*words)
        (Path(request["folder"]) / f"{name}{target.suffix}").write_bytes(emit(ir, ENTRY, target))


def _main() -> None:
    """The child process; a disk that takes no more ends it with a sentence and an exit code of its own."""
    try:
        _child()
    except OSError as error:
        print(temporary_error(error), file=sys.stderr)
        sys.exit(NO_PLACE)


def serve_signature(assembly: Any) -> Any:
    """Types of the arguments of `serve` for a machine."""
    from numba import float64, int64, typeof
    from numba.core.types import Array

    flat = Array(float64, 1, "C")
    return (int64, flat, flat, Array(int64, 1, "C"), typeof(assembly.parameters), flat, Array(float64, 2, "C"), int64)


def entry_ir(dispatcher: Any, arguments: tuple[Any, ...], name: str) -> str:
    """LLVM IR, not optimised, of a compiled function under a new name, with everything it calls."""
    dispatcher.compile(arguments)
    ir: str = dispatcher.inspect_llvm(arguments)
    return ir.replace(dispatcher.overloads[arguments].fndesc.mangled_name, name)


def emit(ir: str, name: str, target: ObjectTarget) -> bytes:
    """Object code, or assembly, of a module of which only the function `name` stays visible, and hidden at that."""
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    module = llvm.parse_assembly(ir)
    machine = llvm.Target.from_triple(target.triple).create_target_machine(
        cpu=target.cpu, features=target.features, opt=3, reloc="pic", codemodel="small"
    )
    module.triple = target.triple
    module.data_layout = str(machine.target_data)
    _hide(module, name)
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = True
    options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    code: bytes = machine.emit_assembly(module).encode() if target.assembly else machine.emit_object(module)
    _check_symbols(module, name)
    return code


def _hide(module: Any, name: str) -> None:
    import llvmlite.binding as llvm

    for item in (*module.functions, *module.global_variables):
        if item.is_declaration:
            continue
        if item.name == name:
            item.linkage, item.visibility = llvm.Linkage.external, llvm.Visibility.hidden
        else:
            item.visibility = llvm.Visibility.default
            item.linkage = llvm.Linkage.internal


def _check_symbols(module: Any, name: str) -> None:
    """Refuse what would need Python, or anything but the C library, in the process that loads the unit."""
    undefined = [f.name for f in module.functions if f.is_declaration and not f.name.startswith("llvm.")]
    foreign = sorted(foreign_symbols(undefined))
    if foreign:
        raise KernelExportError(f"fmu: {name} needs {', '.join(foreign)}, which only Python has")


def foreign_symbols(names: Iterable[str]) -> set[str]:
    """Those of the names that are not in the allow-list."""
    return {n for n in names if n.lstrip("_") not in LIBRARY_FUNCTIONS and n not in LIBRARY_FUNCTIONS}


def host_target(cpu: str = "") -> ObjectTarget:
    """This computer: its own processor for ``cpu = "native"``, else the oldest of its kind."""
    import llvmlite.binding as llvm

    if cpu != "native":
        return ObjectTarget(llvm.get_default_triple())
    features = llvm.get_host_cpu_features().flatten()
    return ObjectTarget(llvm.get_default_triple(), llvm.get_host_cpu_name(), features)


if __name__ == "__main__":
    _main()
