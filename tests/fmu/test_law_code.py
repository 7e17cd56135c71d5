"""Laws as C99 for a microcontroller: the bits of Python, the error of float32, the self test, what they need."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from law_models import RATED, TABLE, faulty_inputs, plausible_law, scheduled_law

from code_blocks import blocks
from fmu.export import export_code, law_unit
from fmu.law_code import write_law
from identification.local.greybox import STRUCTURES
from identification.local.models import LinearModel
from rotorsim.base.errors import DataError
from rotorsim.cli import main
from rotorsim.control import Law, lqr

STRICT = [
    "-std=c99",
    "-pedantic",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wshadow",
    "-Wvla",
    "-Werror",
]
EXACT = ["-O2", "-ffp-contract=off"]
ARM = [("arm-linux-gnueabihf-gcc", "qemu-arm"), ("aarch64-linux-gnu-gcc", "qemu-aarch64")]
I686 = ["i686-linux-gnu-gcc", "-static"]
BUILDS = {
    "gcc": (["gcc"], []),
    "clang": (["clang"], []),
    "musl": (["musl-gcc"], []),
    "armv7": ([ARM[0][0], "-static"], [ARM[0][1]]),
    "aarch64": ([ARM[1][0], "-static"], [ARM[1][1]]),
    "i686": ([*I686, "-msse2", "-mfpmath=sse"], ["qemu-i386"]),
}
"""Compilers by the target, and what runs their programs."""


def static_law():
    """A law of a gain alone, without states."""
    gain = np.array([[[[3e4, -2e3], [1e3, 4e4]]]])
    none = {
        "A": np.zeros((1, 1, 0, 0)),
        "B": np.zeros((1, 1, 0, 2)),
        "C": np.zeros((1, 1, 2, 0)),
        "W": np.zeros((1, 1, 0, 2)),
    }
    return Law("trial", **none, D=gain, speeds=[0.0], pressures=[0.0], limit=0.3, centre=(1e-6, -2e-6))


def designed_law():
    """A quadratic regulator of ten states."""
    model = LinearModel(*STRUCTURES["2-rate"].matrices(np.array(RATED)), speed=0.0, pressure=3e5)
    return lqr.design(model, lqr.Spec(speed=0.0, pressure=3e5)).with_(name="trial", plausibility=None)


def calm(law):
    """A law whose states do not see that its output is limited, and so do not diverge while it is."""
    return law.with_(W=0.0 * law.W)


LAWS = {
    "checked": lambda: plausible_law().with_(runout=TABLE),
    "scheduled": lambda: scheduled_law(bias=(0.5, -0.2)),
    "static": static_law,
    "designed": designed_law,
}


def build(folder, law, precision="float64", command=("gcc",), flags=EXACT):
    """Program that plays a law."""
    if not shutil.which(command[0]):
        pytest.skip(f"{command[0]} is not installed")
    export_code(law_unit(law), folder / "law", precision)
    shutil.copy(Path(__file__).with_name("play_law.c"), folder)
    subprocess.run([*command, *STRICT, *flags, "-c", "law.c"], cwd=folder, check=True)
    subprocess.run([*command, "-std=c99", *flags, "play_law.c", "law.o", "-o", "play", "-lm"], cwd=folder, check=True)
    return folder / "play"


def play(program, rows, runner=()):
    """Result of the self test, and references and alarms (n, 3) for rows (n, 5)."""
    if runner and not shutil.which(runner[0]):
        pytest.skip(f"{runner[0]} is not installed")
    done = subprocess.run([*runner, program], input=rows.tobytes(), capture_output=True, check=True)
    out = np.frombuffer(done.stdout).reshape(-1, 3)
    return int(out[0, 0]), out[1:]


def samples(n):
    """Rows (n, 5): faults of every kind, then noise with values that are no numbers, infinite or far off."""
    rng = np.random.default_rng(5)
    rows = np.column_stack([*faulty_inputs(12000).values(), 1e5 * np.sin(np.arange(12000) / 900.0)])
    more = np.column_stack(
        [*rng.normal(0, 4e-6, (2, n - 12000)), rng.uniform(-50, 700, n - 12000), rng.uniform(2e5, 8e5, n - 12000),
         np.cumsum(rng.uniform(-0.01, 0.08, n - 12000))]
    )  # fmt: skip
    bad = rng.random(more.shape) < 2e-4
    more[bad] = rng.choice([np.nan, np.inf, -np.inf, 9e99, -1e4, 0.0], bad.sum())
    return np.vstack([rows, more])


def answered(law, rows):
    """References and alarms (n, 3) of a law in Python."""
    law, found = law.with_(), np.empty((len(rows), 3))
    for k, (x, y, *point) in enumerate(rows):
        found[k, :2], found[k, 2] = law.step((x, y), *point), law.alarm_code
    return found


@pytest.fixture(scope="module")
def truth():
    """Rows, and what each law makes of them in Python."""
    rows = samples(60_000)
    return rows, {name: answered(make(), rows) for name, make in LAWS.items()}


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("build_name", BUILDS)
def test_no_bit_differs_from_python_in_float64(truth, tmp_path, name, build_name):
    command, runner = BUILDS[build_name]
    rows, wanted = truth
    tested, found = play(build(tmp_path, LAWS[name](), command=command), rows, runner)
    assert tested == 0
    np.testing.assert_array_equal(found.view(np.uint64), wanted[name].view(np.uint64))
    assert np.abs(found[:, :2]).max() == LAWS[name]().limit and len(set(found[:, 2])) > 1


@pytest.mark.parametrize("name", ["designed", "static"])
@pytest.mark.parametrize("build_name", ["gcc", "armv7"])
def test_the_error_of_float32_is_the_one_that_the_header_states(tmp_path, name, build_name):
    """A swing with noise; the header's figure is of another run, so up to five times of it is found."""
    command, runner = BUILDS[build_name]
    law = LAWS[name]()
    rng, t = np.random.default_rng(3), 2e-4 * np.arange(20_000)
    swing = 5e-6 * np.column_stack([np.sin(700 * t), np.cos(700 * t)]) + 3e-7 * rng.normal(size=(len(t), 2))
    rows = np.column_stack([swing, np.linspace(0, 600, len(t)), np.linspace(3e5, 7e5, len(t)), 0 * t])
    tested, found = play(build(tmp_path, law, "float32", command), rows, runner)
    header = (tmp_path / "law.h").read_text()
    stated = float(re.search(r"by (\S+) V at most", header)[1])
    error = np.abs(found[:, :2] - answered(law, rows)[:, :2]).max()
    assert tested == 0 and 0 < error < 5 * stated < 1e-4 * law.limit


def test_the_self_test_finds_fast_math_and_extended_precision(tmp_path):
    rows = samples(12_001)[:1]
    law = LAWS["checked"]()
    assert play(build(tmp_path, law, flags=["-O2", "-ffast-math"]), rows)[0] == 1
    text = (tmp_path / "law.c").read_text()
    hidden = text.replace("__FAST_MATH__", "NOT_SEEN").replace("__FINITE_MATH_ONLY__", "NOT_SEEN")
    (tmp_path / "law.c").write_text(hidden)  # what is computed gives it away too
    subprocess.run(["gcc", "-O2", "-ffast-math", "play_law.c", "law.c", "-o", "play", "-lm"], cwd=tmp_path, check=True)
    assert hidden != text and play(tmp_path / "play", rows)[0] != 0


def test_the_self_test_finds_extended_precision(tmp_path):
    command, runner = [*I686, "-mfpmath=387"], ["qemu-i386"]
    rows = samples(12_001)
    wanted = answered(LAWS["scheduled"](), rows)
    tested, found = play(build(tmp_path, LAWS["scheduled"](), command=command), rows, runner)
    assert tested == 2 and np.abs(found - wanted).max() < 1e-9


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_a_law_needs_no_memory_and_nothing_but_the_mathematics_of_c(gcc, tmp_path, precision):
    build(tmp_path, calm(LAWS["checked"]()), precision, flags=["-O0", "-ffp-contract=off"])
    listed = subprocess.run(["nm", "-u", "law.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    needed = set(re.findall(r"U (\w+)", listed)) - {"_GLOBAL_OFFSET_TABLE_", "__stack_chk_fail"}
    assert needed <= {"memcpy", "memset", "memcmp", "fabs", "fabsf", "floor", "floorf"} and "memcpy" in needed


def test_two_laws_fit_into_one_program(gcc, tmp_path):
    for name in ("one", "two"):
        for text, ending in zip(write_law(static_law(), name, name), ("h", "c"), strict=True):
            (tmp_path / f"{name}.{ending}").write_text(text)
    (tmp_path / "main.c").write_text(
        '#include "one.h"\n#include "two.h"\nint main(void) { static one_memory a; static two_memory b;\n'
        "return one_self_test(&a) + two_self_test(&b); }\n"
    )
    subprocess.run(["gcc", *STRICT, *EXACT, "main.c", "one.c", "two.c", "-o", "both", "-lm"], cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "both"]).returncode == 0


RIG = """
void read_sensors(double measured[2]);
void write_references(const double reference[2]);
double speed(void), pressure(void), angle(void);
void report(int alarm);
"""


def test_the_program_on_the_page_compiles(gcc, tmp_path):
    program = next(block.text for block in blocks() if block.language == "c")
    (tmp_path / "rig.h").write_text(RIG)
    (tmp_path / "main.c").write_text(program)
    for text, ending in zip(write_law(static_law(), "hinf", "hinf"), ("h", "c"), strict=True):
        (tmp_path / f"hinf.{ending}").write_text(text)
    subprocess.run(["gcc", *STRICT, "-include", "rig.h", "-c", "main.c", "hinf.c"], cwd=tmp_path, check=True)


def test_a_reader_sees_the_matrices_at_each_operating_point_and_no_branches():
    law = scheduled_law()
    text = write_law(law, "trial", "trial")[1]
    assert "2864.79 rpm, 0.7 MPa" in text and repr(float(law.A[1, 1, 0, 0])) in text
    assert re.findall(r"^#if.*", text, re.M) == [re.search(r"^#if defined __FAST.*", text, re.M)[0]]
    assert "runout" not in text and "predictor" not in text


def ended(words):
    """Exit code of a command."""
    with pytest.raises(SystemExit) as end:
        main(words)
    return end.value.code


def test_the_command_writes_two_files_and_refuses_what_is_no_law(tmp_path, capsys):
    calm(scheduled_law()).save(tmp_path / "law.json")
    words = ["fmu", "export", "--law", str(tmp_path / "law.json"), "--c-only", "--out", str(tmp_path / "unit")]
    assert ended([*words, "--precision", "float32", "--name", "mine"]) == 0
    assert "mine_step" in (tmp_path / "unit.h").read_text() and '#include "unit.h"' in (tmp_path / "unit.c").read_text()
    assert ended(words) == 2  # they are there already
    assert ended([*words, "--force"]) == 0 and "unit_step" in (tmp_path / "unit.h").read_text()
    assert ended(["fmu", "export", "--c-only"]) == 2
    assert not list(tmp_path.glob("*.fmu"))


@pytest.mark.parametrize(
    "law, precision",
    [(scheduled_law(), "float16"), (scheduled_law(average=4000.0), "float32"), (scheduled_law(), "float32")],
)
def test_a_precision_that_a_law_cannot_have_is_refused(tmp_path, law, precision):
    with pytest.raises(DataError) as refused:
        export_code(law_unit(law), tmp_path / "law", precision)
    assert (refused.value.argument, refused.value.value) == ("precision", precision)
    assert not list(tmp_path.iterdir())


def test_the_c_of_the_example_for_a_dspace_board_compiles_with_the_law(tmp_path):
    script = (Path(__file__).parents[2] / "docs" / "examples" / "law_on_dspace.m").read_text()
    files = re.split(r"fopen\('(\w+\.[ch])', 'w'\)", script)[1:]
    assert files[::2] == ["hinf_block.h", "hinf_block.c"]
    for name, text in zip(files[::2], files[1::2], strict=True):
        lines = re.findall(r"fprintf\(fid, '(.*)'\);", text)
        (tmp_path / name).write_text("".join(lines).replace("\\n", "\n"))
    export_code(law_unit(plausible_law()), tmp_path / "hinf")
    subprocess.run(["gcc", *STRICT, "-c", "hinf.c", "hinf_block.c"], cwd=tmp_path, check=True)
