"""Sources of units: built by the one-line call, CMake and FMPy, on other processors; what asks for which library."""

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from law_models import scheduled_law
from lpv_models import make_lpv

from fmu.check import findings
from fmu.export import choose, export, fmi_headers, host
from fmu.importer import ImportedUnit, info
from fmu.linear_units import LawUnit, LinearUnit
from fmu.model import identifier
from rotorsim.plant.kernels.layout import AT

STRICT = ["-pedantic", "-Wall", "-Wextra", "-Werror", "-Wno-unused-parameter"]
"""A unit has every function of the standard, also those whose parameters it does not need."""
KINDS = {
    "law": lambda: LawUnit(scheduled_law(bias=(0.5, -0.2))),
    "linear": lambda: LinearUnit(make_lpv("2"), "bearing", 300.0, 5e5),
    "sampled": lambda: LinearUnit(make_lpv("blackbox"), "bearing", 300.0, 5e5),
}


@pytest.fixture(scope="module")
def exported(gcc, tmp_path_factory):
    """Units with sources by their kind: the model and its files by FMI version."""
    made = {}
    for kind, make in KINDS.items():
        unit = make()
        out = tmp_path_factory.mktemp(kind) / "unit.fmu"
        made[kind] = unit, export(unit, out, (2, 3), choose("host"), with_sources=True)
    return made


def one_line(folder):
    """Words of the call of gcc that CMakeLists.txt states."""
    text = (folder / "CMakeLists.txt").read_text()
    return re.search(r"^# (gcc .*)$", text, re.M)[1].split()


def unpacked(file, folder):
    """Sources of a unit in a folder."""
    with zipfile.ZipFile(file) as archive:
        archive.extractall(folder)
    return folder / "sources"


def played(loaded, model, n=200):
    """Outputs of a run."""
    inputs = model.stimuli(n, model.sample) if isinstance(model, LawUnit) else moving(model, n)
    instance = loaded.instance()
    instance.initialise()
    rows = instance.run(inputs, model.sample, [v.name for v in model.variables if v.store == "output"])
    instance.close()
    return rows


def moving(model, n):
    """Inputs of a linear model at its start."""
    swing = 0.5 * np.sin(0.05 * np.arange(n))
    return {"piezo.ref_x": swing, "piezo.ref_y": -swing, "shaft.speed_ref": np.full(n, 300.0)}


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_the_one_line_call_builds_the_unit_and_it_has_the_same_bits(exported, tmp_path, kind, version):
    model, files = exported[kind]
    assert findings(files[version]) == []
    with ImportedUnit(files[version]) as loaded:
        wanted = played(loaded, model)
    sources = unpacked(files[version], tmp_path)
    words = one_line(sources)
    subprocess.run([words[0], *STRICT, *words[1:]], cwd=sources, check=True)
    with ImportedUnit(files[version]) as loaded:
        for library in (tmp_path / "sources").glob("*.so"):
            folder = host().folder2 if version == 2 else host().folder3
            shutil.copy(library, f"{loaded.folder}/binaries/{folder}")
        found = played(loaded, model)
    np.testing.assert_array_equal(found, wanted)
    assert np.abs(wanted).max() > 0


def test_cmake_builds_the_sources(exported, tmp_path):
    if not shutil.which("cmake"):
        pytest.skip("cmake is not installed")
    model, files = exported["law"]
    sources = unpacked(files[3], tmp_path)
    subprocess.run(["cmake", "-B", "build"], cwd=sources, check=True, capture_output=True)
    subprocess.run(["cmake", "--build", "build"], cwd=sources, check=True, capture_output=True)
    assert (sources / "build" / f"{identifier(model)}.so").is_file()


@pytest.mark.parametrize("version", [2, 3])
def test_fmpy_builds_the_sources(exported, tmp_path, version):
    build = pytest.importorskip("fmpy.build")
    if not shutil.which("cmake"):
        pytest.skip("cmake is not installed")
    model, files = exported["linear"]
    unpacked(files[version], tmp_path)
    shutil.rmtree(tmp_path / "binaries")
    build.build_platform_binary(tmp_path)
    assert list(tmp_path.glob(f"binaries/*/{identifier(model)}.so"))


CREATE = """
import shutil, sys
from fmu.importer import ImportedUnit
from fmu.export import host
with ImportedUnit(sys.argv[1]) as loaded:
    shutil.copy(sys.argv[2], f"{loaded.folder}/binaries/{host().folder3}")
    loaded.instance(log=print).slave.freeInstance()
"""
"""Creates a unit of another library in a process of its own: all of it flushes subnormal numbers after -ffast-math."""


@pytest.mark.parametrize(
    "flags, refused, word", [(["-ffast-math"], True, "-ffast-math"), (["-mfma", "-ffp-contract=fast"], False, "fused")]
)
def test_a_unit_finds_out_how_it_was_compiled(exported, tmp_path, flags, refused, word):
    if flags[0] == "-mfma" and "fma" not in Path("/proc/cpuinfo").read_text():
        pytest.skip("this processor has no fused arithmetic")
    _, files = exported["law"]
    sources = unpacked(files[3], tmp_path)
    subprocess.run([*one_line(sources), *flags], cwd=sources, check=True)
    library = next(sources.glob("*.so"))
    found = subprocess.run([sys.executable, "-c", CREATE, files[3], library], capture_output=True, text=True)
    assert (found.returncode != 0) is refused and word in found.stdout


def test_the_facts_state_which_c_library_a_unit_asks_for(exported):
    _, files = exported["linear"]
    with zipfile.ZipFile(files[3]) as archive:
        library = next(archive.read(n) for n in archive.namelist() if n.endswith(".so"))
    stated = info(files[3])
    assert stated["sources"] == "yes" and stated["needs"].split()[1].encode() in library


CROSS = {
    "gcc": (["gcc"], []),
    "clang": (["clang"], []),
    "aarch64": (["aarch64-linux-gnu-gcc"], ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"]),
    "armv7": (["arm-linux-gnueabihf-gcc"], ["qemu-arm", "-L", "/usr/arm-linux-gnueabihf"]),
    "i686": (["i686-linux-gnu-gcc", "-msse2", "-mfpmath=sse"], ["qemu-i386", "-L", "/usr/i686-linux-gnu"]),
}


@pytest.fixture(scope="module")
def plant(gcc, model, tmp_path_factory):
    """The unit of the coarse rig with its sources: file, inputs (rows, 2), and what Python makes of them."""
    n = 100
    file = export(model, tmp_path_factory.mktemp("plant") / "rig.fmu", (3,), choose("host"), with_sources=True)[3]
    volts = np.zeros((n, 2))
    volts[50:, 0] = 0.5
    speed = 3.0 * np.arange(n)
    with ImportedUnit(file) as loaded:
        instance = loaded.instance()
        instance.initialise()
        wanted = instance.run(
            {"shaft.speed_ref": speed, "piezo.ref_x": volts[:, 0]}, model.sample, ["disc.x", "disc.y"]
        )
        instance.close()
    return file, np.column_stack([speed, volts[:, 0]]), wanted


@pytest.mark.parametrize("name", CROSS)
def test_the_sources_of_a_plant_have_its_bits_on_every_processor(plant, model, tmp_path, name):
    command, runner = CROSS[name]
    if not all(shutil.which(words[0]) for words in (command, runner) if words):
        pytest.skip(f"{command[0]} or what runs its programs is not installed")
    file, rows, wanted = plant
    sources = unpacked(file, tmp_path)
    shutil.copy(Path(__file__).with_name("player.c"), sources)
    subprocess.run([*command, *one_line(sources)[1:]], cwd=sources, check=True)
    subprocess.run([*command, "-I.", "player.c", "-o", "player", "-lm", "-ldl"], cwd=sources, check=True)
    at = [v.name for v in model.variables].index
    references = [*map(at, ("shaft.speed_ref", "piezo.ref_x", "disc.x", "disc.y"))]
    numbers = [model.sample, len(rows), 2, 2, *references, *rows.ravel()]
    library = sources / f"{identifier(model)}.so"
    done = subprocess.run(
        [*runner, sources / "player", library, model.token], input=" ".join(f"{x!r}" for x in map(float, numbers)),
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    found = np.array([line.split(",") for line in done.stdout.splitlines()], float)
    np.testing.assert_array_equal(found, wanted)
    assert findings(file) == []


def test_the_host_in_c_of_the_docs_plays_the_run_of_python(gcc, files, model, tmp_path):
    source, headers = Path(__file__).parents[2] / "docs" / "examples" / "fmu_host.c", fmi_headers()
    subprocess.run(
        [gcc, "-std=c99", *STRICT, f"-I{headers}", source, "-o", tmp_path / "host", "-ldl", "-lm"], check=True
    )
    with zipfile.ZipFile(files[3]) as archive:
        archive.extractall(tmp_path)
    [library] = tmp_path.glob("binaries/*/*.so")
    command = [tmp_path / "host", library, tmp_path / "modelDescription.xml", "0.02"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    rows = np.loadtxt(done.stdout.splitlines(), delimiter=",", skiprows=1)
    n, force = 100, np.zeros((100, 2))
    force[n // 2, 0] = 20.0
    speeds = 300.0 + 50.0 * 2e-4 * (np.arange(n) + 1)
    run = model.plant.start(300.0, model.pressure)
    inputs = np.column_stack([speeds, np.full(n, model.pressure), np.zeros((n, 2)), force])
    table = run.advance(inputs)
    for name, column in (("disc_x", 1), ("disc_y", 2), ("speed", 3)):
        assert table[:, AT[name]].tobytes() == rows[:-1, column].tobytes(), name
    wrong = subprocess.run([*command[:2], source, "0.02"], capture_output=True, text=True)
    assert wrong.returncode == 1 and "cannot be read" in wrong.stderr
