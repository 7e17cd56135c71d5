"""Files of a unit: valid, small, self-contained, reproducible; invalid exports refused."""

import os
import shutil
import subprocess
import zipfile

import numpy as np
import pytest
from lpv_models import make_lpv

from fmu.check import check
from fmu.export import TARGETS
from fmu.importer import info
from rotorsim.base.errors import DataError
from rotorsim.cli import main


@pytest.mark.parametrize("version", [2, 3])
def test_fmpy_finds_no_problem(files, version, capsys):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(files[version])) == []


@pytest.mark.parametrize("version", [2, 3])
def test_every_check_of_the_command_passes(files, version):
    found = list(check(files[version], 0.05))
    assert len(found) >= 11
    assert [c for c in found if c.passed is False] == []
    assert next(c for c in found if "Python plant" in c.name).value == "equal to the last bit"


def test_a_unit_for_this_computer_is_small(files):
    assert all(path.stat().st_size < 400_000 for path in files.values())


def test_the_library_needs_nothing_but_the_c_library(files, tmp_path):
    from fmu.kernel_object import foreign_symbols

    if not shutil.which("nm"):
        pytest.skip("nm is not installed")
    with zipfile.ZipFile(files[3]) as archive:
        name = next(n for n in archive.namelist() if n.endswith(".so"))
        archive.extract(name, tmp_path)
    lines = subprocess.run(
        ["nm", "-D", tmp_path / name], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    undefined = {line.split()[-1].split("@")[0] for line in lines if " U " in line}
    allowed = {"calloc", "free", "malloc", "strlen", "strcmp", "strncmp", "memcmp", "vsnprintf", "snprintf",
               "__vsnprintf_chk", "__snprintf_chk", "__stack_chk_fail", "__memcpy_chk", "__isoc99_sscanf"}  # fmt: skip
    assert foreign_symbols(undefined) <= allowed
    defined = {line.split()[-1] for line in lines if " T " in line}
    assert defined and all(name.startswith(("fmi2", "fmi3")) for name in defined)


def test_every_function_of_both_standards_is_there(files):
    from pathlib import Path

    import fmpy

    headers = Path(fmpy.__file__).parent / "c-code"
    with zipfile.ZipFile(files[2]) as archive:
        library = archive.read(next(n for n in archive.namelist() if n.endswith(".so")))
    for version in (2, 3):
        text = (headers / f"fmi{version}Functions.h").read_text()
        names = [
            line.split()[1]
            for line in text.splitlines()
            if line.startswith(f"#define fmi{version}") and "FullName(" in line
        ]
        names = [n for n in names if "(" not in n]
        assert len(names) > 40
        assert [n for n in names if n.encode() not in library] == []


def test_the_same_model_gives_the_same_bytes(files, model, tmp_path):
    from fmu.export import choose, export

    again = export(model, tmp_path / "rig.fmu", (2, 3), choose("host"))
    assert all(again[v].read_bytes() == files[v].read_bytes() for v in (2, 3))


@pytest.mark.slow
def test_objects_compiled_again_have_the_same_bytes(model, tmp_path, monkeypatch):
    from fmu.export import build, choose

    libraries = []
    for k in range(2):
        monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path / f"cache{k}"))
        folder = tmp_path / f"build{k}"
        folder.mkdir()
        libraries += [path.read_bytes() for path in build(model, choose("host"), "portable", folder).values()]
    assert libraries[0] == libraries[1]


def test_info_names_model_targets_and_counts(files, model):
    found = info(files[3])
    assert found["model hash"] == model.hash and found["machine hash"] == model.plant.machine.hash
    assert found["FMI version"] == "3.0" and found["inputs"] == 7 and found["reference"] == "yes"


def test_the_documentation_holds_equations_validity_sources_and_every_variable(files, model):
    with zipfile.ZipFile(files[3]) as archive:
        page = archive.read("documentation/index.html").decode()
    for words in ("Equations", "Range of validity", "Sources", "Crossley (1975)", *(v.name for v in model.variables)):
        assert words in page


def refused(capsys, *arguments):
    """Return the sentence on stderr of a command that ends with 2."""
    with pytest.raises(SystemExit) as ended:
        main(["fmu", *map(str, arguments)])
    lines = [line for line in capsys.readouterr().err.splitlines() if "its machine code will run as you" not in line]
    assert ended.value.code == 2 and len(lines) == 1
    return lines[0]


def test_an_unknown_target_is_named(capsys):
    sentence = refused(capsys, "export", "--targets", "sparc-solaris")
    assert sentence.startswith("--targets: 'sparc-solaris'") and all(name in sentence for name in ("host", *TARGETS))


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--fmi", "4", "--fmi: '4' is not known; choose 2, 3 or 2,3"),
        ("--model", "law.json", "--model: law.json: is not there"),
        ("--cpu", "fast", "--cpu: 'fast' is not known; choose portable or native"),
        ("--speed", "fast", "--speed: "),
        ("--out", "/nowhere/at/all/rotor.fmu", "/nowhere/at/all/rotor.fmu: cannot be written: its folder is not there"),
    ],
)
def test_options_that_make_no_sense_are_refused(capsys, option, value, words):
    assert refused(capsys, "export", option, value).startswith(words)


@pytest.mark.skipif(hasattr(os, "getuid") and os.getuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_is_refused_before_compiling(capsys, tmp_path):
    tmp_path.chmod(0o500)
    assert "no permission to write there" in refused(capsys, "export", "--out", tmp_path / "rotor.fmu")


def test_without_a_compiler_the_user_learns_which_to_install(model, tmp_path, monkeypatch):
    from fmu import export as exporting
    from fmu.export import choose

    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(exporting.shutil, "which", lambda name: None)
    monkeypatch.setattr(exporting.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(DataError, match=r"no compiler for .* is here; install gcc, or pip install 'rotorsim\[fmu\]'"):
        exporting.build(model, choose("host"), "portable", tmp_path)
    with pytest.raises(DataError, match=r"targets: .* need zig, which is not here; install it with pip install"):
        exporting.build(model, choose("x86_64-windows"), "portable", tmp_path)


def test_who_has_gcc_but_no_zig_is_not_asked_to_install_gcc_for_another_platform(gcc, model, tmp_path, monkeypatch):
    from fmu import export as exporting
    from fmu.export import choose

    found = exporting.importlib.util.find_spec
    monkeypatch.setattr(exporting.importlib.util, "find_spec", lambda name: None if name == "ziglang" else found(name))
    with pytest.raises(DataError) as refused:
        exporting.build(model, choose("host,x86_64-windows"), "portable", tmp_path)
    assert "zig" in str(refused.value) and "gcc" not in str(refused.value)


@pytest.mark.parametrize("command", ["info", "check"])
def test_a_file_that_is_no_unit_is_refused(capsys, tmp_path, command):
    file = tmp_path / "not.fmu"
    assert "is not there; give a .fmu file" in refused(capsys, command, file)
    file.write_bytes(b"nonsense")
    assert "is not an FMU of rotorsim" in refused(capsys, command, file)


def test_the_workspace_survives_its_encoding(model):
    from fmu.model import runs

    w = model.assembly.w
    assert np.concatenate([np.full(n, x) for n, x in runs(w)]).tobytes() == w.tobytes()


DAMAGE = {
    "no facts": {"resources/model.json": b"{}"},
    "facts of another kind": {"resources/model.json": b"[]"},
    "no variables": {"modelDescription.xml": b"<fmiModelDescription/>"},
    "no machine": {"resources/machine.toml": None},
    "no library": {"binaries/x86_64-linux/dtu_gas_bearing_plant.so": None},
    "a library that is none": {"binaries/x86_64-linux/dtu_gas_bearing_plant.so": b"nonsense"},
    "a reference that is none": {"extra/org.fmi-standard.fmi-ls-ref/in.csv": b"time\nx\n"},
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_unit_is_refused_by_name(files, capsys, tmp_path, damage):
    broken = tmp_path / "broken.fmu"
    with zipfile.ZipFile(files[3]) as given, zipfile.ZipFile(broken, "w") as copy:
        for name in given.namelist():
            content = DAMAGE[damage].get(name, given.read(name))
            if content is not None:
                copy.writestr(name, content)
    assert refused(capsys, "check", broken, "--duration", "20 ms").startswith(f"{broken}: ")


@pytest.mark.parametrize("cc", ["not-a-compiler", "false"])
def test_a_compiler_that_cannot_be_run_is_named(gcc, capsys, tmp_path, monkeypatch, cc):
    monkeypatch.setenv("CC", cc)
    make_lpv("3").save(tmp_path / "lpv.json")
    message = refused(capsys, "export", "--model", tmp_path / "lpv.json", "--out", tmp_path / "u.fmu")
    assert message.startswith("fmu export: ") and "compiler" in message


def test_a_compiler_may_have_options(gcc, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", "gcc -O1")
    make_lpv("3").save(tmp_path / "lpv.json")
    main_ends_well("export", "--model", tmp_path / "lpv.json", "--out", tmp_path / "u.fmu")


def main_ends_well(*arguments):
    """Run a command that ends with 0."""
    with pytest.raises(SystemExit) as ended:
        main(["fmu", *map(str, arguments)])
    assert not ended.value.code


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["export", "--law", "a.json", "--model", "b.json"], "--law and --model: a unit holds one of them"),
        (["export", "--model", "b.json", "--grid", "16x8"], "--grid, --time-step, --set and --over: change the plant"),
        (["export", "--law", "a.json", "--set", "x=1"], "--grid, --time-step, --set and --over: change the plant"),
        (["export", "--law", "a.json", "--c-only", "--clocked"], "--c-only: "),
        (["export", "--law", "a.json", "--c-only", "--source"], "--c-only: "),
        (["export", "--law", "a.json", "--c-only", "--fmi", "2"], "--c-only: "),
        (["export", "--law", "a.json", "--c-only", "--targets", "x86_64-windows"], "--c-only: "),
        (["export", "--law", "a.json", "--precision", "float32"], "--precision: "),
        (["export", "--over", "discs.0.mass=1.2 mm"], "--over: discs.0.mass: "),
        (["export", "--over", "discs.0.mass=1.2"], "--over: discs.0.mass: "),
        (["export", "--over", "discs.0.mass=1.2 kg", "--over", "discs.0.mass=1.3"], "--over: discs.0.mass: "),
        (["system", "a.json", "--fmi", "2,3"], "--fmi: '2,3': a system has units of one version"),
    ],
)
def test_an_option_that_would_be_ignored_is_refused(capsys, words, sentence):
    assert refused(capsys, *words).startswith(sentence)


def test_values_of_a_path_that_is_given_twice_are_joined(monkeypatch):
    from fmu import export as exporting

    received = []

    class StoppedError(Exception):
        """Raised in place of the export."""

    def stop(plant, speed, pressure, over):
        received.append(over)
        raise StoppedError

    monkeypatch.setattr(exporting, "plant_unit", stop)
    words = ["discs.0.mass=1.2 kg, 1.3 kg", "bearings.1.length=0.04 m", "discs.0.mass=1800 g"]
    with pytest.raises(StoppedError):
        main(["fmu", "export", "--grid", "16x8", *(word for one in words for word in ("--over", one))])
    assert received == [{"discs.0.mass": ("1.2 kg", "1.3 kg", "1800 g"), "bearings.1.length": ("0.04 m",)}]


@pytest.mark.parametrize("duration", ["0 s", "-1 s"])
def test_a_check_over_no_time_is_refused(files, capsys, duration):
    assert refused(capsys, "check", files[3], "--duration", duration).startswith("--duration: ")


def test_a_model_that_starts_outside_its_range_is_exported_with_a_warning(gcc, capsys, tmp_path):
    make_lpv("3").save(tmp_path / "lpv.json")
    words = ("export", "--force", "--model", tmp_path / "lpv.json", "--out", tmp_path / "u.fmu")
    main_ends_well(*words, "--speed", "20000 rpm")
    assert "starts outside the speeds and pressures it was identified at" in capsys.readouterr().err
    main_ends_well(*words)
    assert capsys.readouterr().err == ""
    assert "below vacuum" in refused(capsys, *words, "--pressure", "-1 MPa")
