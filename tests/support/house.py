"""Counts of the house: `python tests/support/house.py`, with `--walk` also the files that one PRBS record passes.

Lines, files, imports, names of classes and long functions are those of the five packages. A file is passed if one of
its functions is called while `experiment prbs` makes its record and page; a room is a folder of `rotorsim`, or a
package. Modules are those of the packages loaded before `diagnose` reads its first record.
"""

import ast
import resource
import subprocess
import sys
import threading
from collections import Counter
from contextlib import redirect_stdout, suppress
from io import StringIO
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[2]
PACKAGES = ("reynolds", "fe_shaft", "identification", "rotorsim", "fmu")
LONGEST = 60
"""Lines of the longest function below its docstring."""
PRBS = ("experiment", "prbs", "dtu_gas_bearing", "--amplitude", "1 V", "--duration", "0.5 s", "--grid", "16x4")
DIAGNOSE = (
    "from rotorsim.discrepancy import diagnose, decide, markdown, save_diagnosis, files, loop\n"
    "from rotorsim.machine import load_machine; load_machine('dtu_gas_bearing')"
)
HELP = (("runup", "--help"), ("diagnose", "--help"), ("experiment", "prbs", "--help"), ("runup", "no_such_machine"))


def product():
    """Sources of the packages."""
    return [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def room(file):
    """Name of the room of a file, which is a path below the root."""
    parts = Path(file).parts
    return "/".join(parts[:2]) if parts[0] == "rotorsim" and len(parts) > 2 else parts[0]


def import_lines(tree):
    """Lines that are import statements."""
    nodes = [n for n in ast.walk(tree) if isinstance(n, (ast.Import, ast.ImportFrom))]
    return sum(n.end_lineno - n.lineno + 1 for n in nodes)


def static():
    """Rows (name, count) of what the text of the product shows."""
    files = product()
    texts = [path.read_text(encoding="utf-8") for path in files]
    trees = [ast.parse(text) for text in texts]
    lengths = [len(text.splitlines()) for text in texts]
    classes = Counter(n.name for tree in trees for n in ast.walk(tree) if isinstance(n, ast.ClassDef))
    functions = [n for tree in trees for n in ast.walk(tree) if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef))]
    imports = sum(map(import_lines, trees))
    yield "files", len(files)
    yield "lines", sum(lengths)
    yield "median file", median(lengths)
    yield "imports, percent of lines", round(100 * imports / sum(lengths), 2)
    yield "names of classes that occur twice", sum(times > 1 for times in classes.values())
    yield (
        f"functions above {LONGEST} lines",
        sum(
            n.end_lineno - n.body[min(bool(ast.get_docstring(n)), len(n.body) - 1)].lineno >= LONGEST for n in functions
        ),
    )


class Calls:
    """Profiler: codes of the product that are called while no module is being imported."""

    def __init__(self):
        self.codes, self.importing = set(), 0

    def __call__(self, frame, event, _):
        code = frame.f_code
        if code.co_name == "<module>":
            self.importing += (event == "call") - (event == "return")
        elif event == "call" and not self.importing and code.co_filename.startswith(str(ROOT)):
            self.codes.add(code)


def passed(words):
    """Number of functions that a command calls, by file of the product."""
    from rotorsim.cli import main

    calls = Calls()
    threading.setprofile(calls)
    sys.setprofile(calls)
    try:
        with TemporaryDirectory() as folder, redirect_stdout(StringIO()), suppress(SystemExit):
            main([*words, "--out", folder])
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    return Counter(Path(c.co_filename).relative_to(ROOT).as_posix() for c in calls.codes if c.co_name[0] != "<")


def loaded(code):
    """Number of the packages' modules that are loaded after a text of Python has run."""
    text = f"import sys\n{code}\nprint(len([m for m in sys.modules if m.split('.')[0] in {PACKAGES}]))"
    return int(
        subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, cwd=ROOT, check=True).stdout
    )


def processor(words):
    """Processor time [s] of a command: the median of five runs."""
    times = []
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-m", "rotorsim", *words], capture_output=True, cwd=ROOT, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return median(times)


def rows(walked):
    """Rows (name, count), of the text first."""
    yield from static()
    yield "modules that diagnose imports", loaded(DIAGNOSE)
    yield "files that one PRBS record passes", len(walked)
    yield "rooms that one PRBS record passes", len(set(map(room, walked)))
    yield "functions that one PRBS record passes", walked.total()
    for words in HELP:
        yield f"processor time [s] of {' '.join(words)}", round(processor(words), 2)


def main():
    """Print the counts, and with --walk the files of the PRBS record by room."""
    sys.path.insert(0, str(ROOT))
    with TemporaryDirectory() as folder:  # compiles what the walk runs
        made = [sys.executable, "-m", "rotorsim", *PRBS, "--out", folder]
        subprocess.run(made, cwd=ROOT, capture_output=True, check=True)
    walked = passed(PRBS)
    for name, count in rows(walked):
        print(f"{count:>10}  {name}")
    if "--walk" in sys.argv:
        for file, functions in sorted(walked.items()):
            print(f"{functions:>10}  {file}")


if __name__ == "__main__":
    main()
