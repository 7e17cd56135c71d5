"""Names that are imported on first use: those of a package, as its stub lists them, and those of a registry.

The stub `__init__.pyi` is what type checkers read and what Python imports by, so the two cannot differ; a misspelt name
gets the nearest one. A registry has what its modules register, each under the name of its module.
"""

import ast
import sys
from collections.abc import Callable, Container, Iterable, Iterator, MutableMapping
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType
from typing import Any, NoReturn, TypeVar

from rotorsim.base.display import closest

Value = TypeVar("Value")
Access = tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]


def lazy(package: str, file: str) -> Access:
    """`__getattr__`, `__dir__`, `__all__` of a package (`__name__`, `__file__`); each name loads when used.

    Its stub, the file of the same name with the ending .pyi, holds nothing but imports.
    """
    places = dict(_places(package, Path(file).with_suffix(".pyi").read_text(encoding="utf-8")))
    names = sorted(places)
    functions = {name for name, place in places.items() if place != (package, name)}
    sys.modules[package].__class__ = _package_class(functions)

    def find(name: str) -> Any:
        if name not in places:
            refuse(package, name, names, _of_packages(package, places))
        module, attribute = places[name]
        value = _load(package, module, attribute)
        vars(sys.modules[package])[name] = value
        return value

    return find, lambda: list(names), names


def refuse_hidden(root: Path, names: Iterable[str]) -> None:
    """Refuse a foreign file or folder that Python imports in place of a package of the same name in `root`.

    A package of ours, which has a `py.typed`, may stand elsewhere.

    Raises ImportError; a command, which has no use for a traceback, ends with the sentence and exit code 2.
    """
    for name in names:
        spec = getattr(sys.modules[name], "__spec__", None) if name in sys.modules else find_spec(name)
        if spec is None:
            continue
        places = [Path(place) for place in (spec.submodule_search_locations or [spec.origin or ""])]
        ours = any(place.resolve() == root / name or (place / "py.typed").is_file() for place in places)
        if ours or not (root / name).is_dir():
            continue
        sentence = (
            f"{places[0]} hides the package {name!r} that rotorsim needs; rename it, or work in another folder and "
            "leave its own out of PYTHONPATH"
        )
        if sys.argv[0] == "-m" or Path(sys.argv[0]).stem == "rotorsim":
            print(sentence, file=sys.stderr)
            raise SystemExit(2)
        raise ImportError(sentence)


def named(package: str, names: Iterable[str]) -> tuple[Callable[[str], NoReturn], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package that has imported its public names, its `__all__`, already."""
    known = sorted(names)
    return lambda name: refuse(package, name, known), lambda: list(known)


def refuse(package: str, name: str, known: Iterable[str], below: Callable[[], dict[str, str]] = dict) -> NoReturn:
    """Raise AttributeError for a name that a package does not have, with the nearest one that it has.

    `below` gives by name the place of what its packages have: one of the same name is nearer than any other. A module
    gets no suggestion: ``from package import module`` asks for it here, before Python imports it.
    """
    if not name.startswith("_") and find_spec(f"{package}.{name}") is not None:
        raise AttributeError(f"{package}.{name} is a module; import it", name=name)
    near = ""
    if not name.startswith("_"):
        places = below()
        near = places.get(name) or closest(name, known) or places.get(closest(name, places), "")
    hint = f"did you mean '{near}'?" if near else f"dir({package}) lists its names"
    raise AttributeError(f"{package} has no '{name}'; {hint}", name=name)


def _package_class(names: Container[str]) -> type[ModuleType]:
    """Class of a package in which these names never become its modules of the same name when those are imported."""

    class Package(ModuleType):
        """Package whose public function `campbell` stands before its module `campbell`."""

        def __setattr__(self, name: str, value: Any) -> None:
            """Set an attribute, unless the import of a module would hide a public name."""
            if not (name in names and isinstance(value, ModuleType) and value.__name__ == f"{self.__name__}.{name}"):
                super().__setattr__(name, value)

    Package.__name__ = "module"
    return Package


def _places(package: str, stub: str) -> Iterable[tuple[str, tuple[str, str]]]:
    """Module and attribute of every public name; the attribute is empty for the module itself."""
    for node in ast.parse(stub).body:
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.asname or alias.name, (alias.name, "")
        elif isinstance(node, ast.ImportFrom):
            module = ".".join(filter(None, (package if node.level else "", node.module)))
            for name in _listed(module) if node.names[0].name == "*" else ():
                yield name, (module, name)
            for alias in (one for one in node.names if one.name != "*"):
                yield alias.asname or alias.name, (module, alias.name)


def _of_packages(package: str, places: dict[str, tuple[str, str]]) -> Callable[[], dict[str, str]]:
    """Function that gives by name the place, 'plant.LinearPlant', of every public name of a package's packages."""
    modules = {name: f"{package}.{attribute}" if module == package else module
               for name, (module, attribute) in places.items() if module == package or not attribute}  # fmt: skip
    return lambda: {one: f"{package}.{name}.{one}" for name in reversed(modules) for one in _listed(modules[name])}


def _listed(module: str) -> list[str]:
    """Public names of a module by its stub or its `__all__`, read from the file: nothing is imported."""
    spec = find_spec(module)
    path = Path(spec.origin) if spec is not None and spec.origin else Path()
    if (stub := path.with_suffix(".pyi")).is_file():
        return [name for name, _ in _places(module, stub.read_text(encoding="utf-8"))]
    body = ast.parse(path.read_text(encoding="utf-8")).body if path.is_file() else []
    lists = [one.value for one in body if isinstance(one, ast.Assign) and ast.unparse(one.targets[0]) == "__all__"]
    return [str(name) for one in lists if isinstance(one, ast.List) for name in ast.literal_eval(one)]


def _load(package: str, module: str, attribute: str) -> Any:
    """An attribute of a module, a module of a package, or a module itself where the attribute is empty."""
    if module == package:
        return import_module(f"{module}.{attribute}")
    loaded = import_module(module)
    if not attribute:
        return loaded
    return getattr(loaded, attribute) if hasattr(loaded, attribute) else import_module(f"{module}.{attribute}")


class Registry(MutableMapping[str, Value]):
    """Values by name, which modules put in when they are imported: a module of `shipped` when its name is asked for.

    Parameters
    ----------
    shipped : dict of str
        Modules by the names of what they register, as `modules_below` lists them.
    """

    def __init__(self, shipped: dict[str, str]) -> None:
        self._shipped, self._values = dict(shipped), dict[str, Value]()

    def __getitem__(self, name: str) -> Value:
        if name not in self._values and name in self._shipped:
            import_module(self._shipped[name])
        return self._values[name]

    def __setitem__(self, name: str, value: Value) -> None:
        self._values[name] = value

    def __delitem__(self, name: str) -> None:
        del self._values[name]
        self._shipped.pop(name, None)

    def __contains__(self, name: object) -> bool:
        return name in self._values or name in self._shipped

    def __iter__(self) -> Iterator[str]:
        return iter(list(dict.fromkeys((*self._shipped, *self._values))))

    def __len__(self) -> int:
        return len(self._shipped.keys() | self._values.keys())


def modules_below(package: str, folder: str | Path) -> dict[str, str]:
    """Modules of a package and its packages by their own names, in the order of the files; nothing is imported."""
    found: dict[str, str] = {}
    for one in iter_modules([str(folder)]):
        name = f"{package}.{one.name}"
        found |= modules_below(name, Path(folder) / one.name) if one.ispkg else {one.name: name}
    return found
