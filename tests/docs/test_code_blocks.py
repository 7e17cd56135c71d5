"""Code blocks of README and pages: Python is run page by page, commands line by line, TOML is read.

What takes minutes is marked nightly; what cannot be run at all stands in `NOT_RUN` with its reason.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

import pytest

from code_blocks import CodeBlock, blocks, command_lines

ROOT = Path(__file__).parents[2]
NOT_RUN = (
    (
        r"^(pip|git|python -m venv|ruff|pytest|\.ci/|ROTORSIM_FAULT_TRIES)",
        ".ci/run and the nightly job run these themselves",
    ),
    (r"^python tests/regression/compare_commits", "needs two commits: the workflow of a change"),
    (r"^rotorsim live", "serves until Ctrl-C; tests/live starts it"),
    (r"^rotorsim desk|/\?token=", "serves until Ctrl-C, or asks what serves; tests/desk starts it"),
    (
        r"^rotorsim (campaign thesis|study)|^python studies/|my_campaign|records --model",
        "hours; tests/campaign and tests/studies",
    ),
    (r"^rotorsim diagnose rig.toml --until-decided", "waits for records that a person makes"),
    (r"^rotorsim diagnose my_rotor.toml measured", "needs the reader's records; docs/gap.md runs the command nightly"),
    (r"scheduler|^head\$|^node\$|^--tls", "needs a cluster; tests/campaign starts schedulers of its own"),
    (r"^(store\.json|index\.sqlite|cases/|campaign\.log)", "a list of files"),
    (r"^(v = C x|d\(p h\)|eta\(x\) = )", "an equation"),
    (r"^(>>>|AttributeError)", "shown by tests/base/test_public_names.py"),
    (r"dask_jobqueue", "needs a batch system"),
    (r"libcosimpy|ecospy", ".ci/optional/importers runs the units in these programs"),
)
"""Lines, or blocks of Python by a word in them, that are not run here, and why."""
NIGHTLY = (
    r"^rotorsim (verify|hide|report (design|diagnosis)|diagnose (dtu|bently)|machine calibrate)",
    r"^rotorsim map --speed|--over|--random",
    r"^rotorsim design",
    r"^rotorsim (runup (--pressure|aerostatic)|modes grooved|experiment (prbs|staircase))",
    r"^rotorsim fmu",
)
NIGHTLY_PAGES = {f"docs/{name}.md" for name in ("control", "experiments", "fmu", "gap", "identification", "linear")}
"""Pages whose Python takes minutes."""
BEFORE = {
    "docs/data.md": """
import numpy as np
time = np.arange(2000) * 2e-4
reference, angle = np.zeros((2000, 2)), 628.3 * time
disc_measured = 1e-6 * np.random.default_rng(1).normal(size=(2000, 2))
speed, amplitude, phase = np.array([100.0, 200.0]), np.full((2, 3, 2), 1e-6), np.zeros((2, 3, 2))
""",
    "docs/identification.md": """
import numpy as np
import rotorsim as rs
reference, speed, pressure = np.zeros((500, 2)), np.zeros(500), np.full(500, 0.5e6)
plant, law = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8), rs.experiments.ProportionalLaw(1e5, 1e5)
""",
    "docs/gap.md": "import numpy as np\n",
}
"""Things that a page supposes its reader has."""
OTHERS = 'rest = [idn.identify(idn.read(f"run{k}.csv", f"rig{k}.toml"), model=3) for k in (2, 3)]\n'
RECORD = 'record = idn.read("run1.csv", "rig.toml")\nfound'
SHORTER = {
    "duration=3600.0": "duration=2.0",
    "0.7e6, 30.0, excitations=[Prbs(amplitude=0.3, duration=30.0)]": "0.7e6, 2.0, excitations=[Prbs(amplitude=0.3)]",
    "[found, ...], order=2": "[found] * 3 + rest, order=1",
    "[record, another]": "[record, record]",
    RECORD: OTHERS + RECORD,
}
"""Text that a run replaces: an hour, and an ellipsis."""


def reason(text):
    """Return why a line or a block is not run, '' if it is."""
    return next((why for pattern, why in NOT_RUN if re.search(pattern, text)), "")


def python_pages():
    """Return the Python of each page, blocks with a reason left out."""
    found = defaultdict(list)
    for block in blocks():
        if block.language == "python" and not reason(block.text):
            found[block.page].append(block.text)
    return {page: "\n".join(texts) for page, texts in found.items()}


def shell_pages():
    """Return the commands of each page that are run, in order."""
    found = defaultdict(list)
    for block in blocks():
        if block.language in ("", "console", "indented"):
            found[block.page] += [line for line in command_lines(block) if not reason(line)]
    return found


def late(line):
    return any(re.search(pattern, line) for pattern in NIGHTLY)


PYTHON = python_pages()
SHELL = {page: lines for page, lines in shell_pages().items() if lines}
NIGHT = pytest.mark.nightly
FIRST_PAGES = {"README.md", "docs/first_steps.md"}
"""Pages whose code runs in the quick tests: what a new reader types first."""


def marks(page):
    """Return the marks of a page's code that takes no minutes."""
    return () if page in FIRST_PAGES else pytest.mark.slow


@pytest.fixture
def material(tmp_path):
    """Return a folder with the files that pages name."""
    for name in ("model", "lpv"):
        shutil.copy(ROOT / "rotorsim" / "live" / "shipped" / "rig_model_2.json", tmp_path / f"{name}.json")
    for name in ("hinf", "my_law"):
        shutil.copy(ROOT / "rotorsim" / "live" / "shipped" / "hinf.json", tmp_path / f"{name}.json")
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    (tmp_path / "rotorsim").symlink_to(ROOT / "rotorsim")
    return tmp_path


MATERIAL = """
import numpy as np, rotorsim as rs, identification as idn
from pathlib import Path
names = {names!r}
if "my_rotor.toml" in names:
    Path("my_rotor.toml").write_text(rs.machine_text("plain_rotor"))
if "my_rig.toml" in names:
    Path("my_rig.toml").write_text(rs.machine_text("dtu_gas_bearing"))
if "run1.csv" in names:
    plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
    for k, pressure in enumerate((0.4e6, 0.5e6, 0.6e6), 1):
        idn.save(rs.experiments.prbs(plant, 0.0, pressure, duration=3.0), f"run{{k}}.csv")
        Path("rig.toml" if k == 1 else f"rig{{k}}.toml").write_text("[conditions]\\naccuracy = '0.5 um'\\n")
if "run.csv" in names or "run.mat" in names:
    record = rs.experiments.runup("plain_rotor", 100.0, 200.0, 50.0, 0.0)
    idn.save(record, "run.csv"), idn.save(record, "run.mat")
    Path("rig.toml").write_text("[conditions]\\naccuracy = '0.5 um'\\n")
for name in {{"runup.csv", "before.nc", "after.nc", "measured.csv"}} & set(names):
    idn.save(rs.experiments.runup("plain_rotor", 100.0, 200.0, 50.0, 0.0), name)
    Path("rig.toml").write_text("[conditions]\\naccuracy = '0.5 um'\\n")
if "rig.fmu" in names:
    rs.fmu.export(rs.Plant("my_rig.toml"), "rig.fmu", fmi=(3,))
"""


def run(words, folder):
    """Run Python with these arguments in a folder; fail with what it printed."""
    settings = os.environ | {"MPLBACKEND": "Agg"}
    ran = subprocess.run(
        [sys.executable, *words], cwd=folder, env=settings, capture_output=True, text=True, timeout=7200
    )
    assert ran.returncode in (0, 10, 11, 12), f"{words}\n{ran.stdout[-1500:]}\n{ran.stderr[-3000:]}"


def prepare(folder, text):
    """Write the files that a page's code names."""
    named = ("my_rotor.toml", "my_rig.toml", "run1.csv", "run.csv", "run.mat", "rig.fmu", "runup.csv", "before.nc",
             "after.nc", "measured.csv")  # fmt: skip
    names = [n for n in named if n in text]
    if names:
        run(["-c", MATERIAL.format(names=names)], folder)


@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=NIGHT if p in NIGHTLY_PAGES else marks(p), id=Path(p).stem) for p in PYTHON]
)
def test_the_python_of_a_page_runs_from_top_to_bottom(page, material):
    text = BEFORE.get(page, "") + PYTHON[page]
    for given, shorter in SHORTER.items():
        text = text.replace(given, shorter)
    prepare(material, text)
    (material / "page.py").write_text(text, encoding="utf-8")
    run(["page.py"], material)


@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=marks(p), id=Path(p).stem) for p in SHELL if not all(map(late, SHELL[p]))]
)
def test_the_quick_commands_of_a_page_run(page, material):
    lines = [line for line in SHELL[page] if not late(line)]
    prepare(material, without_new("\n".join(lines)))
    commands(lines, material)


@NIGHT
@pytest.mark.parametrize("page", [pytest.param(p, id=Path(p).stem) for p in SHELL if any(map(late, SHELL[p]))])
def test_every_command_of_a_page_runs(page, material):
    prepare(material, without_new("\n".join(SHELL[page]), "--out rig.fmu" in "\n".join(SHELL[page])))
    commands(SHELL[page], material)


def without_new(text, exports=False):
    """Return the text without the names of files that its own commands make."""
    text = text.replace("rig.fmu", "") if exports else text
    return text.replace("my_rotor.toml", "") if "machine new my_rotor.toml" in text else text


COMMANDS = """
import json, sys
from pathlib import Path
from shutil import rmtree
from rotorsim.cli import main
for words, made in json.loads(sys.argv[1]):
    for path in map(Path, made):
        rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    try:
        main(words)
    except SystemExit as ended:
        if ended.code not in (None, 0, 10, 11, 12):
            sys.exit(f"rotorsim {words} ended with code {ended.code}")
"""


def commands(lines, folder):
    """Run command lines in order, in one interpreter; results of the same name are replaced."""
    each = []
    for line in lines:
        words = shlex.split(line)
        assert words[0] == "rotorsim", line
        made = {words[k + 1] for k, word in enumerate(words) if word in ("--out", "--propose")}
        each.append((words[1:], sorted(made | ({"run.nc"} & set(words)))))
    run(["-c", COMMANDS, json.dumps(each)], folder)


@pytest.mark.parametrize("block", [b for b in blocks() if b.language == "toml"], ids=lambda b: f"{b.page}-{b.line}")
def test_a_block_of_toml_is_read(block: CodeBlock):
    assert tomllib.loads(block.text)


def test_every_block_is_of_a_kind_that_is_run_read_or_has_a_reason():
    kinds = {"python", "toml", "console", "indented", "", "c"}  # tests/fmu/test_law_code.py compiles C
    assert {b.language for b in blocks()} - kinds == {"{toctree}"}
    lines = [line for b in blocks() if b.language in ("", "console", "indented") for line in command_lines(b)]
    assert not [line for line in lines if not line.startswith("rotorsim ") and not reason(line)]
    unused = [pattern for pattern, _ in NOT_RUN if not any(re.search(pattern, text) for text in (*lines, *texts()))]
    assert unused == []


def texts():
    """Return the blocks of Python."""
    return [b.text for b in blocks() if b.language == "python"]
