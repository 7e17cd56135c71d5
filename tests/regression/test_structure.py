"""Structure of the packages: no circles of files, places of numba's private parts, local imports."""

import ast
from collections import Counter
from graphlib import TopologicalSorter
from itertools import pairwise
from pathlib import Path

import pytest

from rotorsim.effects import REGISTRY

ROOT = Path(__file__).parents[2]
PACKAGES = ("reynolds", "fe_shaft", "identification", "rotorsim", "fmu")
FILES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
PRIVATE = {
    "fmu/kernel_object.py",
    "reynolds/addressed_calls.py",
    "reynolds/jit.py",
    "reynolds/compiler.py",
    "reynolds/kernel_cache.py",
    "reynolds/kernel_expressions.py",
    "reynolds/kernel_writer.py",
    "reynolds/vectors.py",
}
"""Files that may use numba.core or llvmlite."""
MOST_LOCAL_IMPORTS = 150
BY_NAME = {
    "fmu/kernel_object.py",
    "identification/readers/__init__.py",
    "rotorsim/base/public.py",
    "rotorsim/commands/registry.py",
}
"""Files that may import a module by a name: tables of public names, effects, readers, commands, cases of workers."""
CLOCKS = {"monotonic", "perf_counter", "process_time", "thread_time", "time"}
WAITING = ("tests/support/waiting.py", "tests/faults", "tests/live/clicker.py", "tests/live/live_browser.py",
           "tests/support/compare_modes.py")  # fmt: skip
"""Files that read a clock: they wait for what must come, disturb a command at random moments, or print times."""
OWN_MACHINES = ("rotorsim/effects",)
"""Folders whose files may set effects by name."""


def name_of(path):
    """Path of a file below the root, for messages."""
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


def test_modules_are_imported_by_their_names_in_tables_only():
    """`import_module` follows tables of modules of the same room; the linter does not see what it imports."""
    assert {name_of(path) for path in FILES if "import_module" in path.read_text(encoding="utf-8")} == BY_NAME


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


OPENINGS = ("Of ", "By ", "What ", "Where ", "With ", "For ", "How ", "As much", "So many")
"""Beginnings of a docstring that name neither an actor nor a thing."""
AROUND = ("studies", "docs", "tests")
"""Folders outside the packages whose docstrings follow the same rule."""


def docstrings(tree):
    """Docstrings of modules, classes and functions, and of constants below their assignments."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            yield ast.get_docstring(node) or ""
        body = getattr(node, "body", None)
        for before, after in pairwise(body) if isinstance(body, list) else ():
            if isinstance(before, (ast.Assign, ast.AnnAssign)) and isinstance(after, ast.Expr):
                yield after.value.value if isinstance(after.value, ast.Constant) else ""


def test_a_docstring_begins_with_a_subject(trees):
    around = [path for folder in AROUND for path in sorted((ROOT / folder).rglob("*.py"))]
    every = trees | {name_of(path): ast.parse(path.read_text(encoding="utf-8")) for path in around}
    found = [(name, text[:60]) for name, tree in every.items() for text in docstrings(tree) if text]
    assert len(found) > 7500 and all(any(name.startswith(folder) for name, _ in found) for folder in AROUND)
    assert [one for one in found if str(one[1]).startswith(OPENINGS)] == []


def test_a_name_of_a_class_exists_once(trees):
    """Neither product nor studies have two classes of one name."""
    studies = [ast.parse(path.read_text(encoding="utf-8")) for path in sorted((ROOT / "studies").rglob("*.py"))]
    every = [*trees.values(), *studies]
    classes = Counter(n.name for tree in every for n in ast.walk(tree) if isinstance(n, ast.ClassDef))
    assert len(classes) > 540 and len(studies) > 60
    assert [name for name, times in classes.items() if times > 1] == []
