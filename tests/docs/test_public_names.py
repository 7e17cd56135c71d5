"""Every public name has a docstring, complete types, a place in the API reference and an example.

A class may leave its example to a public function, method or class method with one that returns it; an error and a
warning state when they are raised instead.
"""

import inspect
import re
import sys
from pathlib import Path
from types import ModuleType

import rotorsim as rs

sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))
import site_pages

PACKAGES = (rs, *(one for name in dir(rs) if isinstance(one := getattr(rs, name), ModuleType)))


def public_names():
    """Everything that the packages list but packages and dunder names, once, by the name it is reached by."""
    found = {}
    for package in PACKAGES[1:] + PACKAGES[:1]:
        for name in dir(package):
            value = getattr(package, name)
            if not isinstance(value, ModuleType) and not name.startswith("__"):
                found.setdefault(id(value), (f"{package.__name__}.{name}", value))
    return dict(found.values())


NAMES = public_names()
CLASSES = {name: one for name, one in NAMES.items() if inspect.isclass(one)}
CALLED = {name: one for name, one in NAMES.items() if callable(one) and not inspect.isclass(one)}
VALUES = {name: one for name, one in NAMES.items() if not callable(one)}


def own_methods(kind):
    """Methods and properties that a class of ours defines or inherits from ours, without those with an underscore."""
    for owner in kind.__mro__:
        if owner.__module__.split(".")[0] not in ("rotorsim", "identification", "fe_shaft", "reynolds"):
            continue
        for name, value in vars(owner).items():
            one = value.fget if isinstance(value, property) else getattr(value, "func", value)
            one = inspect.unwrap(getattr(one, "__func__", one))
            home = Path(inspect.getfile(owner)).parent
            written = inspect.isfunction(one) and Path(one.__code__.co_filename).parent == home
            if written and (name == "__init__" or not name.startswith("_")):
                yield f"{owner.__name__}.{name}", one


def untyped(one):
    """Parameters of a function without an annotation, and 'return'; self and cls have none."""
    signature = inspect.signature(one)
    missing = [name for name, p in signature.parameters.items() if p.annotation is p.empty]
    if "." in one.__qualname__ and "<locals>" not in one.__qualname__ and missing[:1] in (["self"], ["cls"]):
        missing = missing[1:]
    return missing + ["return"] * (signature.return_annotation is signature.empty)


def has_example(one):
    """Whether the docstring of a name itself (an inherited one does not count) has an example."""
    text = vars(one).get("__doc__") if inspect.isclass(one) else one.__doc__
    return bool(re.search(r"Examples\n\s*-+\n(.*\n)*\s*>>> (?!import |from )", text or ""))


def shown_classes():
    """Classes that functions and methods with an example return, alone or in a list, a tuple or a dict."""
    functions = [(one, one) for one in CALLED.values()]
    functions += [(method, kind) for kind in CLASSES.values() for _, method in own_methods(kind)]
    found = set()
    for one, owner in functions:
        if has_example(one):
            words = set(re.findall(r"\w+", str(one.__annotations__.get("return", ""))))
            found |= {name for name, kind in CLASSES.items() if kind.__name__ in words and same(one, owner, kind)}
    return found


def same(function, owner, kind):
    """Whether a class is the one that a function's file means by its name (several packages have an Outcome)."""
    meant = function.__globals__.get(kind.__name__)
    return meant is kind if inspect.isclass(meant) else package_of(owner) == package_of(kind)


def package_of(one):
    """The public package of a function or class: rotorsim.control, fe_shaft, ..."""
    parts = one.__module__.split(".")
    return parts[:2] if parts[0] == "rotorsim" else parts[:1]


SHOWN = shown_classes()


def on_page(name):
    """Whether the page of the reference lists a name: autodoc's rule, and the values that it leaves out."""
    package, _, own = name.rpartition(".")
    if package not in site_pages.API:
        return False
    value = NAMES[name]
    if callable(value):
        return own in sys.modules[package].__all__ and bool(value.__doc__)
    listed = {**site_pages._sentences(sys.modules[package]), **site_pages.constants(package)}
    return bool(listed.get(own))


def test_the_packages_have_some_three_hundred_public_names():
    assert len(CALLED) > 120 and len(CLASSES) > 100 and len(VALUES) > 5


def own_docstring(one):
    """Whether a name has a docstring that is not generated from its signature."""
    text = (vars(one).get("__doc__") if inspect.isclass(one) else one.__doc__) or ""
    return len(text.split()) > 2 and not text.startswith(f"{one.__name__}(")


def test_a_public_name_has_a_docstring_of_its_own():
    assert [name for name, one in (CALLED | CLASSES).items() if not own_docstring(one)] == []


def test_a_public_function_has_types_throughout():
    assert {name: untyped(one) for name, one in CALLED.items() if untyped(one)} == {}


def test_methods_of_a_public_class_have_types_and_docstrings():
    methods = {f"{name}: {key}": one for name, kind in CLASSES.items() for key, one in own_methods(kind)}
    assert {key: untyped(one) for key, one in methods.items() if untyped(one)} == {}
    assert [key for key, one in methods.items() if not one.__doc__ and not key.endswith(".__init__")] == []


def test_a_public_name_is_on_a_page_of_the_reference():
    assert [name for name in NAMES if not on_page(name)] == []


def test_a_public_function_has_an_example():
    assert [name for name, one in CALLED.items() if not has_example(one)] == []


def test_a_public_class_has_an_example_or_is_returned_in_one_and_an_error_states_when_it_is_raised():
    errors = {name: kind for name, kind in CLASSES.items() if issubclass(kind, BaseException)}
    assert [name for name, kind in errors.items() if not re.search(r"\braised\b", kind.__doc__, re.IGNORECASE)] == []
    assert [name for name in CLASSES.keys() - errors if not has_example(CLASSES[name]) and name not in SHOWN] == []
