"""Sources of a unit in its archive: C99, a build description, CMakeLists.txt and a one-line call of gcc.

Laws and linear models are C alone. The step of a plant is compiled from the plant's own kernels by LLVM, so what a unit
carries of it is the assembly of each target, which a C file includes by the compiler's own macros: any gcc or clang for
that target builds it, and it has the bits and the speed of the unit's binary.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from string import Template
from xml.etree.ElementTree import Element, SubElement

from fmu.model import PlantUnit, Unit, header, identifier, source

SHARED = ("unit.c", "values.c", "state.c", "tables.c")
"""C files of every unit besides its face of FMI 2.0 or 3.0 and its core."""
KERNELS = "kernels.c"
HEADERS = ("fmi{0}Functions.h", "fmi{0}FunctionTypes.h")
PLATFORM_TYPES = {2: "fmi2TypesPlatform.h", 3: "fmi3PlatformTypes.h"}
LANGUAGE, OPTIONS = "C99", "-ffp-contract=off"
MACROS = {
    "x86_64-linux": "defined __x86_64__ && defined __linux__",
    "x86-linux": "defined __i386__ && defined __linux__",
    "aarch64-linux": "defined __aarch64__ && defined __linux__",
    "aarch32-linux": "defined __arm__ && defined __linux__",
    "x86_64-windows": "defined __x86_64__ && defined _WIN32",
    "x86_64-darwin": "defined __x86_64__ && defined __APPLE__",
    "aarch64-darwin": "defined __aarch64__ && defined __APPLE__",
}
"""Condition of C under which a compiler builds for a target."""
CMAKE = Template("""# The unit as a shared library: cmake -B build && make -C build
# or, with one call in this folder:
# gcc -std=c99 -O2 $options -fPIC -shared -fvisibility=hidden -I. $files -o $name.so -lm
cmake_minimum_required(VERSION 3.15)
project($name C)
add_library($name SHARED $files)
set_target_properties($name PROPERTIES PREFIX "" C_STANDARD 99 C_VISIBILITY_PRESET hidden)
target_include_directories($name PRIVATE $${CMAKE_CURRENT_SOURCE_DIR})
if(NOT MSVC)
  target_compile_options($name PRIVATE $options)
endif()
if(UNIX)
  target_link_libraries($name PRIVATE m)
endif()
""")


def c_files(unit: Unit, version: int) -> tuple[str, ...]:
    """Names of the files that are compiled."""
    return (*SHARED, f"fmi{version}.c", *unit.core, *((KERNELS,) if isinstance(unit, PlantUnit) else ()))


def source_files(unit: Unit, version: int, headers: Path, assembly: dict[str, bytes]) -> dict[str, bytes]:
    """Files below sources/ by their names; `headers`: folder of the standard's, `assembly`: a plant's by its files."""
    folder, own = Path(__file__).parent / "c", set(c_files(unit, version))
    texts = {"tables.h": header(unit), "tables.c": source(unit), "CMakeLists.txt": cmake(unit, version)}
    if assembly:
        texts[KERNELS] = kernels(list(assembly))
    found = {name: text.encode() for name, text in texts.items()}
    found |= {f"{name}.s": text for name, text in assembly.items()}
    for file in (*(name.format(version) for name in HEADERS), PLATFORM_TYPES[version]):
        found[file] = (headers / file).read_bytes()
    missing = sorted(own - found.keys())
    while missing:  # and what they include
        name = missing.pop()
        found[name] = (folder / name).read_bytes()
        needed = set(re.findall(rb'#include "(\w+\.h)"', found[name]))
        missing += [
            n for n in map(bytes.decode, needed) if n not in found and n not in missing and (folder / n).is_file()
        ]
    return {f"sources/{name}": content for name, content in found.items()}


def kernels(names: Sequence[str]) -> str:
    """C file that includes the assembly, kernels_TARGET, of the target it is compiled for."""
    targets = [name.removeprefix("kernels_") for name in names]
    lines = ["/* The plant's step, compiled from its kernels: assembly by the target. */"]
    for k, target in enumerate(targets):
        lines += [
            f"#{'elif' if k else 'if'} {MACROS[target]}",
            f'__asm__(".include \\"kernels_{target}.s\\"\\n.text");',
        ]
    return "\n".join([*lines, "#else", f'#error "there are kernels for {", ".join(targets)} only"', "#endif", ""])


def cmake(unit: Unit, version: int) -> str:
    """Text of CMakeLists.txt."""
    return CMAKE.substitute(name=identifier(unit), files=" ".join(c_files(unit, version)), options=OPTIONS)


def build_description(unit: Unit) -> Element:
    """sources/buildDescription.xml of FMI 3.0."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    one = SubElement(root, "BuildConfiguration", modelIdentifier=identifier(unit))
    files = SubElement(one, "SourceFileSet", language=LANGUAGE, compilerOptions=OPTIONS)
    for name in c_files(unit, 3):
        SubElement(files, "SourceFile", name=name)
    SubElement(one, "Library", name="m", external="true", description="Mathematics of the C library.")
    return root


def list_sources(root: Element, unit: Unit) -> None:
    """Name the files in a model description of FMI 2.0."""
    for kind in (root.find("ModelExchange"), root.find("CoSimulation")):
        if kind is not None:
            files = SubElement(kind, "SourceFiles")
            for name in c_files(unit, 2):
                SubElement(files, "File", name=name)


def oldest_library(binary: bytes) -> str | None:
    """Version of glibc that a library for Linux asks for, such as '2.29'; None where it asks for none."""
    found = {tuple(map(int, match.split(b"."))) for match in re.findall(rb"GLIBC_(\d+\.\d+(?:\.\d+)?)\0", binary)}
    return ".".join(map(str, max(found))) if found else None
