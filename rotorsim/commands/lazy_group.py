"""Command group that imports the module of a command when the command, or its own help, is asked for."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from functools import cache, wraps
from importlib import import_module
from importlib.util import find_spec
from inspect import Parameter, Signature, signature
from typing import Any, ClassVar, TypeVar, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup

Function = TypeVar("Function", bound=Callable[..., None])
FOLDER = "rotorsim.commands"


class LazyGroup(TyperGroup):
    """Command group by a table; lists in help and completion take the docstrings from the sources, unimported."""

    epilog: str | None = None
    places: ClassVar[Mapping[str, str]] = {}
    """By name of a command: its module below `rotorsim.commands` and its function, as "module.function"."""
    panels: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Names of commands by the title under which the help lists them."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.listing = False
        self.commands = {name: TyperCommand(name) for name in self.places} | dict(self.commands)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command; in a list, one that has nothing but its help."""
        if cmd_name not in self.places:
            return super().get_command(ctx, cmd_name)
        place = self.places[cmd_name]
        return self._listed(cmd_name) if self.listing else load(cmd_name, place)

    def _listed(self, name: str) -> TyperCommand:
        panel = next((title for title, names in self.panels.items() if name in names), None)
        return TyperCommand(name, help=docstring(self.places[name]), rich_help_panel=panel)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help with its list of commands."""
        with self.listed():
            super().format_help(ctx, formatter)

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Names for the shell's completion."""
        with self.listed():
            return super().shell_complete(ctx, incomplete)

    @contextmanager
    def listed(self) -> Iterator[None]:
        """While this holds, commands have nothing but their help."""
        self.listing = True
        try:
            yield
        finally:
            self.listing = False


def example(text: str, python: str) -> Callable[[Function], Function]:
    """Decorator: the last lines of the command's help, an example and the same in Python (`import rotorsim as rs`)."""

    def mark(command: Function) -> Function:
        vars(command).update(example=text, python=python)
        return command

    return mark


@cache
def load(name: str, place: str) -> Any:
    """Click command of a function, imported."""
    module, function = place.rsplit(".", 1)
    return click_command(name, getattr(import_module(f"{FOLDER}.{module}"), function))


def click_command(name: str, function: Callable[..., None]) -> Any:
    """Click command of a function marked with `example`; a parameter that is a dataclass stands for its fields."""
    made = typer.Typer(add_completion=False)
    marks = vars(function)
    made.command(name, epilog=f"Example: {marks['example']}\n\nIn Python: {marks['python']}")(
        _of_single_options(function)
    )
    command = typer.main.get_command(made)
    command.python = marks["python"]  # type: ignore[attr-defined]
    return command


def single(function: Callable[..., None]) -> typer.Typer:
    """Application of one command, a function marked with `example`, for a script."""
    name = str(vars(function)["example"]).partition(".py ")[0] + ".py"
    app = typer.Typer(name=name, add_completion=False, pretty_exceptions_enable=False)
    app.command(epilog=f"Example: {vars(function)['example']}")(_of_single_options(function))
    return app


def _of_single_options(function: Callable[..., None]) -> Callable[..., None]:
    """The function with the fields of its dataclasses as options of its own."""
    hints = get_type_hints(function, include_extras=True)
    groups: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}

    @wraps(function)
    def command(**values: Any) -> None:
        for name, kind in groups.items():
            values[name] = kind(**{field.name: values.pop(field.name) for field in fields(kind)})
        function(**values)

    options: dict[str, tuple[Any, Any]] = {}
    for name, given in signature(function).parameters.items():
        if name in groups:
            own = get_type_hints(groups[name], include_extras=True)
            options |= {field.name: (own[field.name], field.default) for field in fields(groups[name])}
        else:
            options[name] = hints[name], given.default
    return with_options(command, options)


def with_options(command: Callable[..., None], options: Mapping[str, tuple[Any, Any]]) -> Callable[..., None]:
    """A function of keywords with the signature that typer reads: by name an annotation and a default."""
    command.__annotations__ = {name: kind for name, (kind, _) in options.items()}
    parameters = [Parameter(n, Parameter.KEYWORD_ONLY, annotation=a, default=d) for n, (a, d) in options.items()]
    command.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return command


def docstring(place: str) -> str:
    """Docstring of a function, read from the source of its module."""
    module, function = place.rsplit(".", 1)
    spec: Any = find_spec(f"{FOLDER}.{module}")
    for node in ast.parse(spec.loader.get_source(spec.name)).body:
        if isinstance(node, ast.FunctionDef) and node.name == function:
            return ast.get_docstring(node) or ""
    return ""
