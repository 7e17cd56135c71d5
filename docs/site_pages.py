"""Pages of the site that follow from the sources: API reference, examples, gallery, bibliography.

The repository holds them too, but for those of single modules, so that links work where the docs are read as files.
After a change of an example's text or of the references, write them again: `python docs/site_pages.py`.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any, get_args, get_origin

from rotorsim.base.references import entries, shown

DOCS = Path(__file__).parent
API = {
    "rotorsim": "Everything by tab from `import rotorsim as rs`",
    "rotorsim.experiments": "Virtual experiments",
    "rotorsim.analysis": "Equilibria, maps, critical speeds, calibration",
    "rotorsim.control": "Control laws and their design",
    "rotorsim.verify": "Verification of a law on the nonlinear plant",
    "rotorsim.discrepancy": "The gap between a machine file and records",
    "rotorsim.balance": "Balancing from 1X vectors",
    "rotorsim.campaign": "Many experiments by one plan",
    "rotorsim.report": "Figures and reports",
    "rotorsim.signals": "Orders, spectra, frequency responses, ring-downs",
    "rotorsim.fmu": "Functional mock-up units",
    "rotorsim.desk": "A rotor designed in the browser",
    "rotorsim.live": "The rig in the browser",
    "rotorsim.study": "Identification against physics",
    "rotorsim.machine": "Machine files",
    "rotorsim.errors": "Errors and warnings that calls raise",
    "rotorsim.plant": "The coupled plant",
    "rotorsim.effects": "Physical effects",
    "identification": "Records in, models out",
    "fe_shaft": "The shaft alone",
    "reynolds": "The gas film alone",
}
"""Modules of the API reference and what they are for."""
STALE = "*.md"


def write_pages() -> None:
    """Write every generated page, and remove those of folders that are no more; nothing is touched whose text stays."""
    pages = stored_pages() | {f"api/{module}.md": _api(module, about) for module, about in API.items()}
    for folder in ("api", "examples"):
        (DOCS / folder).mkdir(exist_ok=True)
        for old in (DOCS / folder).glob(STALE):
            if f"{folder}/{old.name}" not in pages:
                old.unlink()
    for name, text in pages.items():
        _put(DOCS / name, text)


def stored_pages() -> dict[str, str]:
    """Text of every generated page that the repository holds, by its path in docs/."""
    examples = sorted((DOCS / "examples").glob("*.py"))
    pages = {f"examples/{path.stem}.md": example_page(path) for path in examples}
    return pages | {"gallery.md": gallery(examples), "api.md": _api_index(), "bibliography.md": bibliography(),
                    "machine_fields.md": machine_fields()}  # fmt: skip


FIELDS = """# Every field of a machine file

Made from the schema that reads the files. A field may be left out unless its default is `required`; a table in double
brackets may stand several times. What the tables are for: [machine files](machine_files.md); `[effects.NAME]`:
[effects](effects.md).
"""


def machine_fields() -> str:
    """Page of all fields of a machine file, by table: unit, default, limits, sentence."""
    from rotorsim.machine import Machine

    return "\n\n".join([FIELDS.strip(), *_tables_below(Machine, "", False)]) + "\n"


def _tables_below(part: Any, path: str, several: bool) -> Iterator[str]:
    """The table of a part and those of the parts in it."""
    from rotorsim.machine.part import choices

    rows, below = [], []
    for name, info in part.model_fields.items():
        if name == "effects":
            continue
        kinds = choices(info.annotation)
        many = get_origin(kinds[0]) is tuple
        kinds = choices(get_args(kinds[0])[0]) if many else kinds
        if parts := [kind for kind in kinds if hasattr(kind, "model_fields")]:
            below += [(kind, f"{path}.{name}".lstrip("."), many) for kind in parts]
        else:
            rows.append(_field_row(name, info, many))
    title = "Top of the file" if not path else f"`[[{path}]]`" if several else f"`[{path}]`"
    words = {one for tag in ("kind", "quantity") if tag in part.model_fields
             for one in get_args(part.model_fields[tag].annotation)}  # fmt: skip
    title += f", {next(iter(words))}" if len(words) == 1 else ""
    head = ["| field | unit | default | limits | |", "|---|---|---|---|---|"]
    yield f"## {title}"
    yield "\n".join([*head, *rows])
    for kind, under, many in below:
        yield from _tables_below(kind, under, many)


def _field_row(name: str, info: Any, many: bool) -> str:
    """Row of a field that is a value."""
    from rotorsim.base.quantity import quantity_of
    from rotorsim.base.units import advised, show

    known = quantity_of(info)
    default = "" if info.is_required() or info.default in (None, "", ()) else str(info.default)
    if info.is_required():
        default = "required"
    elif known is not None and info.default is not None:
        default = show(info.default, known.unit)
    unit = "" if known is None or known.unit == "1" else advised(known.unit)[0]
    limits = []
    if known is not None:
        ends = (("above", known.above), ("from", known.low), ("to", known.high))
        limits = [f"{word} {_short(show(value, known.unit))}" for word, value in ends if value is not None]
    words = [repr(one) for one in get_args(info.annotation) if isinstance(one, str)]
    text = " ".join([info.description or "", f"One of {', '.join(words)}." * (len(words) > 1)]).strip()
    return f"| `{name}`{' (list)' * many} | {unit} | {default} | {' '.join(limits)} | {text} |"


def _short(text: str) -> str:
    """A number with a unit, to six digits where a conversion left more."""
    number, _, unit = text.partition(" ")
    return f"{float(number):.6g} {unit}".strip() if len(number) > 12 else text


def _put(path: Path, text: str) -> None:
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def _api(module: str, about: str) -> str:
    """Page of a module: every name of its `__all__` with its docstring."""
    again = "\n   :no-index:" if module in ("rotorsim", "rotorsim.errors") else ""  # names of other pages
    values = "".join(
        f"\n.. py:data:: {name}\n   :module: {module}\n\n   {text}\n" for name, text in constants(module).items()
    )
    return f"# {module}\n\n{about}.\n\n```{{eval-rst}}\n.. automodule:: {module}{again}\n{values}```\n"


def constants(module: str) -> dict[str, str]:
    """Public values of a package that other files define, which autodoc leaves out, with the sentence below each."""
    package = import_module(module)
    values = {name: getattr(package, name) for name in package.__all__ if not name.startswith("_")}
    plain = {name: one for name, one in values.items() if not callable(one) and not isinstance(one, ModuleType)}
    own = _sentences(package)
    return {name: _sentence(name, one) for name, one in plain.items() if name not in own}


def _sentence(name: str, value: Any) -> str:
    """Sentence below the assignment of a value in the file that makes it; empty where there is none."""
    holders = [m for m in list(sys.modules.values()) if getattr(m, "__file__", None) and vars(m).get(name) is value]
    return next((found[name] for one in holders if name in (found := _sentences(one))), "")


def _sentences(module: ModuleType) -> dict[str, str]:
    """String that follows each assignment in a module, by the name that is assigned."""
    body = ast.parse(Path(str(module.__file__)).read_text(encoding="utf-8")).body
    return {
        target.id: str(text.value.value)
        for made, text in pairwise(body)
        if isinstance(made, (ast.Assign, ast.AnnAssign))
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        for target in (made.targets if isinstance(made, ast.Assign) else [made.target])
        if isinstance(target, ast.Name)
    }


def _api_index() -> str:
    """List of the modules' pages."""
    rows = "\n".join(f"| `{module}` | {about} |" for module, about in API.items())
    names = "\n".join(f"api/{module}" for module in API)
    return (
        "# API reference\n\nFrom the docstrings: shapes and units of every array, the errors raised. Inside Python all "
        "numbers are SI (rad/s, Pa, m);\npressures of calls are gauge supply pressures. A page of each module is made "
        "with the site (`.ci/docs`); `help(rs.control)` shows the same.\n\n"
        f"| module | for |\n|---|---|\n{rows}\n\n```{{toctree}}\n:maxdepth: 1\n\n{names}\n```\n"
    )


def docstring(path: Path) -> tuple[str, str]:
    """Title and text of an example."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or path.stem
    title, _, rest = text.partition("\n")
    return title.strip().rstrip("."), rest.strip()


def example_page(path: Path) -> str:
    """Page of an example: its text, its picture, its script."""
    title, text = docstring(path)
    name, data = path.name, data_of(path)
    files = [f"[`{one}`](../rk4/{one})" for one in data]
    needed = f", with {' and '.join(files)} in a folder `rk4` next to it" if data else ""
    return (
        f"# {title}\n\n{text}\n\n![{title}]({path.stem}.png)\n\n"
        f"Run it: [`{name}`]({name}){needed}, then `python {name}`, which draws the picture.\n\n"
        f"```{{literalinclude}} {name}\n:language: python\n```\n"
    )


def data_of(path: Path) -> list[str]:
    """Files of measured data, in docs/rk4, that an example reads."""
    return re.findall(r'data / "([\w.]+)"', path.read_text(encoding="utf-8"))


def gallery(examples: list[Path]) -> str:
    """All examples, each with its picture, two in a row."""
    head = f"# Gallery\n\n{len(examples)} scripts of at most 60 lines and their pictures. The test suite runs them all."
    cells = [_card(path) for path in examples]
    rows = [f"| {' | '.join([*cells[k : k + 2], ''][:2])} |" for k in range(0, len(cells), 2)]
    table = "\n".join(["| | |", "|---|---|", *rows])
    return f"{head}\n\n{table}\n\n```{{toctree}}\n:hidden:\n:glob:\n\nexamples/*\n```\n"


def _card(path: Path) -> str:
    page, picture = f"examples/{path.stem}.md", f"examples/{path.stem}.png"
    return f"[![{path.stem}]({picture})]({page}) [{docstring(path)[0]}]({page})"


def bibliography() -> str:
    """Every reference under its key."""
    head = (
        "# Bibliography\n\nThe sources of the equations, under the keys that the modules cite them by. "
        "`rotorsim cite MACHINE` prints those of a\nmachine. "
        "BibTeX: [references.bib](../rotorsim/base/references.bib)."
    )
    lines = [f'<a id="{key}"></a>**{key}**: {_linked(shown(entry))}' for key, entry in sorted(entries().items())]
    return "\n\n".join([head, *lines]) + "\n"


def _linked(text: str) -> str:
    """Text in which a DOI is a link and no sign is taken for Markdown."""
    plain = re.sub(r"([*_<])", r"\\\1", text)
    return re.sub(r"doi:(\S+?)\.?$", r"[doi:\1](https://doi.org/\1)", plain)


if __name__ == "__main__":
    write_pages()
