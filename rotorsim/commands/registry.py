"""Registry of commands: a function marked with `command` is a command of `rotorsim`, with an example and a Python call.

The head of a chapter of commands imports what declares options; a function imports what it computes with, after it has
read its input. So lists of commands, help and refusals of a machine file load no numba, scipy, xarray or plotly.

`app` is the application with all commands, which the chapters of this folder register.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from functools import wraps
from importlib import import_module
from inspect import Parameter, Signature, signature
from typing import Annotated, Any, ClassVar, TypeVar, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup

from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import DataError
from rotorsim.base.interrupt import interrupted

Function = TypeVar("Function", bound=Callable[..., None])
GroupClass = TypeVar("GroupClass", bound="type[CommandGroup]")
COMMANDS: dict[str, dict[str, Callable[..., None]]] = {"": {}}
"""Functions by the name of their group, which is empty for commands of `rotorsim` itself, and by their own name."""
GROUPS: dict[str, type[CommandGroup]] = {}
"""Classes of command groups by name."""


class CommandGroup(TyperGroup):
    """Group of commands; a click command is made of its function when it is asked for.

    The docstring of a subclass is the group's help, the registry has its functions.
    """

    group: ClassVar[str] = ""
    epilog: str | None = None

    def names(self) -> Iterable[str]:
        """Names of the commands, without the groups below."""
        return COMMANDS[self.group]

    def function(self, name: str) -> Callable[..., None] | None:
        """Function of a command, or None."""
        return COMMANDS[self.group].get(name)

    def panel(self, name: str) -> str | None:
        """Title under which the help lists a command."""
        return None

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of the commands and of the groups below."""
        return [*self.names(), *self.commands]

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that the first word names; raises DataError with the nearest one where there is none."""
        name = args[0]
        if not name.startswith("-") and self.get_command(ctx, name) is None:
            near = did_you_mean(name, self.list_commands(ctx))
            raise DataError(f"{ctx.command_path}: no command '{name}'; {near}", argument="command", value=name)
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of a name, or None."""
        function = self.function(cmd_name)
        if function is None:
            return super().get_command(ctx, cmd_name)
        return click_command(cmd_name, function, self.panel(cmd_name))


class OneCommand(TyperCommand):
    """Command that answers an unknown option with the nearest of its own."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words of the command line; raises DataError for an option that there is not."""
        try:
            return super().parse_args(ctx, args)
        except Exception as error:  # NoSuchOption of click or of typer's own copy of it, which has no public name
            name = str(getattr(error, "option_name", ""))
            if not hasattr(error, "possibilities"):
                raise
            known = [option for parameter in self.params for option in parameter.opts if option.startswith("--")]
            same = [option for option in known if option.rstrip("s") == name.rstrip("s")]
            near = same or get_close_matches(name, known)
            hint = f"did you mean {' or '.join(near)}? " * bool(near) + f"'{ctx.command_path} --help' lists its options"
            raise DataError(f"{ctx.command_path}: no option {name}; {hint}", argument=name) from None


def command(words: str, text: str, python: str) -> Callable[[Function], Function]:
    """Decorator: make a function the command `rotorsim WORDS`, with an example and the same in Python for its help."""

    def register(function: Function) -> Function:
        group, _, name = words.rpartition(" ")
        COMMANDS[group][name] = example(text, python)(function)
        return function

    return register


def group(name: str, epilog: str = "") -> Callable[[GroupClass], GroupClass]:
    """Decorator: make a class the group `rotorsim NAME` of commands; `epilog` is the last line of its help."""

    def register(kind: GroupClass) -> GroupClass:
        kind.group, kind.epilog = name, epilog or None
        GROUPS[name] = kind
        COMMANDS[name] = {}
        return kind

    return register


def example(text: str, python: str) -> Callable[[Function], Function]:
    """Decorator: the last lines of the command's help, an example and the same in Python (`import rotorsim as rs`)."""

    def mark(function: Function) -> Function:
        vars(function).update(example=text, python=python)
        return function

    return mark


def click_command(name: str, function: Callable[..., None], panel: str | None = None) -> Any:
    """Click command of a function marked with `example`; a parameter that is a dataclass stands for its fields.

    `panel` is the title under which the help of its group lists it.
    """
    made = typer.Typer(add_completion=False)
    marks = vars(function)
    epilog = f"Example: {marks['example']}\n\nIn Python: {marks['python']}"
    made.command(name, cls=OneCommand, epilog=epilog, rich_help_panel=panel)(_of_single_options(function))
    command = typer.main.get_command(made)
    command.python = marks["python"]  # type: ignore[attr-defined]
    return command


def single(function: Callable[..., None]) -> typer.Typer:
    """Application of one command, a function marked with `example`, for a script."""
    name = str(vars(function)["example"]).partition(".py ")[0] + ".py"
    app = typer.Typer(name=name, add_completion=False, pretty_exceptions_enable=False)
    app.command(cls=OneCommand, epilog=f"Example: {vars(function)['example']}")(_of_single_options(function))
    return app


def _of_single_options(function: Callable[..., None]) -> Callable[..., None]:
    """The function with the fields of its dataclasses, and of those in them, as options of its own."""
    hints = get_type_hints(function, include_extras=True)
    given = signature(function).parameters

    @wraps(function)
    def command(**values: Any) -> None:
        function(**{name: _value_of(name, hints[name], values) for name in given})

    options: dict[str, tuple[Any, Any]] = {}
    for name, parameter in given.items():
        options |= _single_options(name, hints[name], parameter.default)
    return with_options(command, options)


def _single_options(name: str, kind: Any, default: Any) -> dict[str, tuple[Any, Any]]:
    """Annotation and default of a parameter, or of each field of its dataclass, by name."""
    if not is_dataclass(kind):
        return {name: (kind, default)}
    own = get_type_hints(kind, include_extras=True)
    found: dict[str, tuple[Any, Any]] = {}
    for field in fields(kind):
        found |= _single_options(field.name, own[field.name], field.default)
    return found


def _value_of(name: str, kind: Any, values: Mapping[str, Any]) -> Any:
    """Value of a parameter from those of all single options."""
    if not is_dataclass(kind):
        return values[name]
    own = get_type_hints(kind, include_extras=True)
    return kind(**{field.name: _value_of(field.name, own[field.name], values) for field in fields(kind)})  # type: ignore[operator]


def with_options(command: Callable[..., None], options: Mapping[str, tuple[Any, Any]]) -> Callable[..., None]:
    """A function of keywords with the signature that typer reads: by name an annotation and a default."""
    command.__annotations__ = {name: kind for name, (kind, _) in options.items()}
    parameters = [Parameter(n, Parameter.KEYWORD_ONLY, annotation=a, default=d) for n, (a, d) in options.items()]
    command.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return command


PANELS = {
    "Simulate in time": {"runup": "experiment", "experiment": "experiment", "campaign": "campaign", "live": "live"},
    "Without time simulation": {
        "map": "map", "sweep": "map", "optimise": "map", "response": "linear", "campbell": "linear", "modes": "linear",
    },
    "Machine files": {"machine": "machine", "desk": "desk", "cite": "machine"},
    "Measured data": {
        "data": "data", "compare": "compare", "balance": "compare", "diagnose": "diagnosis", "hide": "diagnosis",
        "report": "report",
    },
    "Models, control, other simulators": {
        "identify": "identification", "study": "identification", "design": "control", "verify": "control", "fmu": "fmu",
    },
    "This installation": {"warm": "machine"},
}  # fmt: skip
"""Chapter that registers each command or group, by the title under which the help lists them."""
TITLES = {name: title for title, names in PANELS.items() for name in names}
CHAPTERS = {name: chapter for names in PANELS.values() for name, chapter in names.items()}


class Commands(CommandGroup):
    """Top-level command group; Ctrl-C in any command ends with one sentence.

    A chapter is imported when one of its commands is asked for, so help of one loads no other.
    """

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all commands and groups, title by title."""
        return list(TITLES)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command or group of a name, or None."""
        if cmd_name not in CHAPTERS:
            return super().get_command(ctx, cmd_name)
        chapter = import_module(f"rotorsim.commands.{CHAPTERS[cmd_name]}")
        if cmd_name == "runup":
            return click_command(cmd_name, chapter.experiment_function(cmd_name, cmd_name), TITLES[cmd_name])
        return _group(cmd_name) if cmd_name in GROUPS else super().get_command(ctx, cmd_name)

    def panel(self, name: str) -> str | None:
        """Title under which the help lists a command."""
        return TITLES[name]

    def make_context(self, *arguments: Any, **options: Any) -> Any:
        """Read the command line."""
        try:
            return super().make_context(*arguments, **options)
        except KeyboardInterrupt:
            interrupted()

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            interrupted()


def _group(name: str) -> Any:
    """Click group of a registered class of commands."""
    kind, holder = GROUPS[name], typer.Typer()
    own = typer.Typer(cls=kind, help=kind.__doc__, epilog=kind.epilog, no_args_is_help=True)
    holder.add_typer(own, name=name, rich_help_panel=TITLES[name])
    return typer.main.get_group(holder).commands[name]


app = typer.Typer(
    cls=Commands,
    name="rotorsim",
    help="Simulate rotors on gas bearings.\n\nMACHINE is a shipped machine, such as dtu_gas_bearing or plain_rotor, "
    "or a machine file of your own. 'rotorsim COMMAND --help' shows the options of a command and an example.",
    epilog="Example: rotorsim runup\n\nExample: rotorsim experiment impact plain_rotor --out impact --open",
    context_settings={"help_option_names": ["-h", "--help"]},
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _version(asked: bool) -> None:
    """Print name and version, and end."""
    if asked:
        from rotorsim.base.cache import installed

        typer.echo(f"rotorsim {installed('rotorsim')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and end.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error; may stand anywhere.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Run with unusual values too; may stand anywhere.")] = False,
) -> None:
    pass
