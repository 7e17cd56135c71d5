"""Structure of the packages: no circles of files, places of numba's private parts, local imports."""

import ast
from collections import Counter
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from rotorsim.effects import REGISTRY

ROOT = Path(__file__).parents[2]
PACKAGES = ("reynolds", "fe_shaft", "identification", "rotorsim", "fmu")
FILES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
PRIVATE = {
    "fmu/kernel_object.py",
    "reynolds/jit.py",
    "reynolds/kernel_cache.py",
    "reynolds/lanes.py",
    "reynolds/compiler.py",
}
"""Files that may use numba.core or llvmlite."""
MOST_LOCAL_IMPORTS = 150
BY_NAME = {
    "fmu/kernel_object.py",
    "identification/readers/__init__.py",
    "rotorsim/base/public.py",
    "rotorsim/campaign/worker.py",
    "rotorsim/effects/__init__.py",
    "rotorsim/experiments/catalogue/__init__.py",
}
"""Files that may import a module by a name: tables of public names, effects, readers, commands, cases of workers."""
CLOCKS = {"monotonic", "perf_counter", "process_time", "thread_time", "time"}
WAITING = ("tests/support/waiting.py", "tests/faults", "tests/live/clicker.py", "tests/live/live_browser.py")
"""Tests that read a clock: they wait for what must come, or disturb a command at random moments."""
ROOMS = ("rotorsim.effects", "rotorsim.live", "rotorsim.machine", "rotorsim.plant")
"""Rooms whose folders import one way."""
OWN_MACHINES = ("rotorsim/effects",)
"""Folders whose files may set effects by name."""


def name_of(path):
    """Where a file is, for messages."""
    return path.relative_to(ROOT).as_posix()


def imports(tree):
    """Import statements of a file."""
    return [node for node in ast.walk(tree) if isinstance(node, (ast.Import, ast.ImportFrom))]


@pytest.fixture(scope="module")
def trees():
    return {name_of(path): ast.parse(path.read_text(encoding="utf-8")) for path in FILES}


def test_no_files_import_each_other_in_a_circle():
    """Imports inside functions and under TYPE_CHECKING count."""
    grimp = pytest.importorskip("grimp")
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    TopologicalSorter({m: graph.find_modules_directly_imported_by(m) for m in graph.modules}).prepare()


@pytest.mark.parametrize("room", ROOMS)
def test_folders_of_a_room_import_one_way(room):
    """A module counts for its folder, an `__init__` for neither: it lists public names."""
    grimp = pytest.importorskip("grimp")
    graph = grimp.build_graph("rotorsim", cache_dir=None)
    modules = {m for m in graph.modules if m.startswith(f"{room}.") and not graph.find_children(m)}
    imported = {}
    for module in modules:
        own = module.rpartition(".")[0]
        folders = {m.rpartition(".")[0] for m in graph.find_modules_directly_imported_by(module) & modules}
        imported.setdefault(own, set()).update(folders - {own})
    assert len(modules) > 10
    TopologicalSorter(imported).prepare()


def test_modules_are_imported_by_their_names_in_tables_only(trees):
    """`import_module` follows tables of modules of the same room; the linter does not see what it imports."""
    named = {name for name, tree in trees.items() if "import_module" in ast.unparse(tree)}
    assert named <= BY_NAME


def test_private_parts_of_numba_stay_where_they_are_allowed(trees):
    def private(node):
        modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
        return any(module.startswith(("numba.core", "llvmlite")) for module in modules)

    assert {name for name, tree in trees.items() if any(map(private, imports(tree)))} <= PRIVATE


def test_imports_inside_functions_are_few(trees):
    """Commands import what they run when they run it, so that their help loads nothing."""
    local = Counter()
    for name, tree in trees.items():
        if name.startswith("rotorsim/commands/"):
            continue
        functions = [n for n in ast.walk(tree) if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef))]
        local[name] = len({node.lineno for function in functions for node in imports(function)})
    assert local.total() <= MOST_LOCAL_IMPORTS, local.most_common(10)


def test_no_test_reads_a_clock():
    """A test decides by what happens: how long that takes depends on the computer and on what else it does."""
    files = [path for path in sorted((ROOT / "tests").rglob("*.py")) if not name_of(path).startswith(WAITING)]
    read = set()
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            named = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "time"
            if named and node.attr in CLOCKS:
                read.add(name_of(path))
            if isinstance(node, ast.ImportFrom) and node.module == "time":
                read.add(name_of(path))
            if isinstance(node, ast.Import) and any(n.name == "time" and n.asname for n in node.names):
                read.add(name_of(path))
    assert len(files) > 200 and not read


def test_an_effects_parameters_are_named_in_its_own_file_only(trees):
    """A key such as 'runout.amplitude_1x' in the code: help and docstrings are sentences."""
    keys = {f"{name}.{key}" for name, effect in REGISTRY.items() for key in effect.__dataclass_fields__}
    named = {
        (name, node.value)
        for name, tree in trees.items()
        if not name.startswith(OWN_MACHINES)
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and node.value.removeprefix("effects.") in keys
    }
    assert not named
