"""Files and rooms of the product in which a function runs during one command, kernels compiled before.

`python tests/support/files_run.py [--list] WORDS` runs `rotorsim WORDS` in this process and prints the counts; by
default it is the walk of a PRBS record from the command line to the piezo. A module's own lines do not count;
functions, bodies of classes and expressions over a loop do, also those that run when a module is imported.
"""

import sys
import threading
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory
from types import CodeType, FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("reynolds", "fe_shaft", "identification", "fmu", "rotorsim")
PRBS = "experiment prbs dtu_gas_bearing --amplitude '1 V' --duration '0.5 s'"


def functions_run(words: list[str]) -> set[CodeType]:
    """Functions of the product that ran in a command of these words, by their code."""
    seen: set[CodeType] = set()

    def note(frame: FrameType, event: str, argument: Any) -> None:
        if event == "call" and frame.f_code.co_name != "<module>":
            seen.add(frame.f_code)

    threading.setprofile(note)
    sys.setprofile(note)
    try:
        from rotorsim.cli import main

        main(words)
    except SystemExit as ended:
        if ended.code:
            raise
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    return {code for code in seen if place(code) is not None}


def place(code: CodeType) -> Path | None:
    """File of a function, relative to the checkout; None for one of another package."""
    path = Path(code.co_filename)
    if not path.is_relative_to(ROOT):
        return None
    path = path.relative_to(ROOT)
    return path if path.parts[0] in ROOMS else None


def room(path: Path) -> str:
    """Room of a file: a package, or a folder of `rotorsim`."""
    return "/".join(path.parts[: 2 if path.parts[0] == "rotorsim" and len(path.parts) > 2 else 1])


def count(words: list[str]) -> tuple[dict[Path, list[str]], Counter[str]]:
    """Names of the functions that ran by file, and files by room."""
    found: dict[Path, list[str]] = {}
    for code in functions_run(words):
        path = place(code)
        assert path is not None
        found.setdefault(path, []).append(code.co_qualname)
    return found, Counter(room(path) for path in found)


if __name__ == "__main__":
    import shlex

    given = sys.argv[1:]
    listed = "--list" in given
    words = [word for word in given if word != "--list"] or shlex.split(PRBS)
    with TemporaryDirectory() as folder:
        sys.path.insert(0, str(ROOT))
        files, rooms = count([*words, *(() if "--out" in words else ("--out", folder))])
    print(f"{len(files)} files, {sum(map(len, files.values()))} functions, {len(rooms)} rooms: {dict(rooms)}")
    for path in sorted(files) if listed else ():
        print(path, len(files[path]), ", ".join(sorted(files[path])[:6]))
