"""`rotorsim machine`: from a new file to a checked one, and messages for faulty files."""

import json
import re
import subprocess
import sys

import pytest

from rotorsim.cli import main
from rotorsim.machine import load_machine, machine_text
from rotorsim.machine.schema import rows


def test_a_new_machine_file_checks_out_and_can_be_shown(run, tmp_path):
    path = tmp_path / "rig.toml"
    assert run("machine", "new", path, "--from", "dtu_gas_bearing")[0] == 0
    assert path.read_text() == machine_text("dtu_gas_bearing")
    code, out, err = run("machine", "check", path)
    assert (code, err) == (0, "")
    assert "ok, dtu_gas_bearing: 3.54 kg on 2 bearings; gas film with 25 um clearance and 4 injectors" in out
    code, out, _ = run("machine", "show", path)
    assert code == 0 and "-121.3 mm" in out and "4.194 um/V" in out
    broken = [doc for _, _, doc in rows(load_machine(path)) if doc not in out]
    assert max(map(len, out.splitlines())) > 80 and not broken


def without_second(text):
    """Return the starting file without its second bearing."""
    return text.replace(
        text[text.index("[[bearings]]", text.index("[[bearings]]") + 1) : text.index("# A gas film")], ""
    )


def switched_on(lines):
    """Return lines of the starting file without the '#' that switches them off."""
    return re.sub(r"^#(?! )", "", lines, flags=re.MULTILINE)


def test_a_new_file_is_a_plain_rotor_whose_further_fields_work_when_they_are_switched_on(run, tmp_path):
    path = tmp_path / "mine.toml"
    assert run("machine", "new", path)[0] == 0
    text = path.read_text()
    path.write_text(switched_on(without_second(text)))
    code, out, err = run("machine", "check", path)
    assert (code, err) == (0, "") and "on 2 bearings" in out
    machine = load_machine(path)
    off = {key for key in re.findall(r"^#(\w+) =", text, re.MULTILINE)}
    assert {"inner_diameter", "clearance", "highest_speed", "angle"} <= off
    assert (
        machine.probes[0].name == "X"
        and machine.films[0].orifices[0].count == 8
        and machine.films[0].clearance == pytest.approx(10e-6)
    )


def test_every_block_and_every_single_field_of_a_new_file_works_switched_on_alone(run, tmp_path):
    path, text = tmp_path / "mine.toml", machine_text("plain_rotor")
    parts = [part for part in re.findall(r"(?:^#(?! ).*\n)+", text, re.MULTILINE)]
    blocks = [part for part in parts if part.startswith("#[")]
    fields = [line + "\n" for part in parts if part not in blocks for line in part.splitlines()]
    assert len(blocks) == 4 and len(fields) == 4
    for part in (*blocks, *fields):
        film = "gas_film" in part
        assert text.count(part) == 1
        path.write_text((without_second(text) if film else text).replace(part, switched_on(part)))
        code, out, err = run("machine", "check", path)
        assert (code, err) == (0, "") and "on 2 bearings" in out, part
        assert load_machine(path).hash != load_machine("plain_rotor").hash, part
        path.write_text(text.replace(part, switched_on(part)))
        assert run("machine", "check", path)[0] == (2 if film else 0)  # a film at a bearing that was left is questioned


def test_every_field_of_a_new_file_has_a_comment():
    bare = [
        line for line in machine_text("plain_rotor").splitlines() if "=" in line and not re.search(r"[^#] +# ", line)
    ]
    assert bare == []


def test_new_starts_from_any_machine_and_overwrites_only_when_forced(run, tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text("mine")
    code, _, err = run("machine", "new", path, "--from", "plain_rotor")
    assert (code, path.read_text()) == (2, "mine")
    assert "is there already; choose another name or add --force" in err
    assert run("machine", "new", path, "--from", "plain_rotor", "--force")[0] == 0
    assert load_machine(path) == load_machine("plain_rotor")


def test_json_gives_si_numbers(run):
    code, out, _ = run("machine", "show", "dtu_gas_bearing", "--json")
    numbers = json.loads(out)
    assert code == 0
    assert numbers["bearings"][1]["clearance"] == 25e-6
    assert numbers["effects"]["gravity"][0]["acceleration"] == 9.81
    assert numbers["mass"] == pytest.approx(3.54, abs=0.005)


def changed(old, new):
    return machine_text("dtu_gas_bearing").replace(old, new, 1).encode()


BAD_FILES = {
    "unknown field": (changed("[gas]", "[gass]"), "gass: unknown field; did you mean 'gas'?"),
    "missing field": (changed('mass = "1.5 kg"', ""), "discs.0.mass: missing (Mass); write e.g. '1.5 kg'"),
    "no unit": (changed('"-121.3 mm"', "0"), "shaft.start: 0 has no unit; write e.g. '0 mm'"),
    "wrong unit": (changed("\nme = ", '\nme = "20 g" # '), "effects.unbalance.me: '20 g' is not a mass*length"),
    "negative clearance": (
        changed('clearance = "25', 'clearance = "-25'),
        "bearings.1.clearance: '-25 um' must be above 0",
    ),
    "disc outside": (changed('"378.7 mm"', '"500 mm"'), "discs.0.position: '500 mm' is outside the shaft"),
    "bearing twice": (changed('position = "0 mm"', 'position = "236.6875 mm"'), "is where bearings.0 is; move one"),
    "odd grid": (changed("n_theta = 32", "n_theta = 31"), "grid.n_theta: 31 is not a multiple of 4; write e.g. 32"),
    "unknown effect": (changed("[effects.gravity]", "[effects.levity]"), "effects.levity: unknown effect; "),
    "empty": (b"", "the machine file is empty; 'rotorsim machine new PATH' writes one"),
    "binary": (bytes(range(256)), "is not text in UTF-8, as a machine file is"),
    "null bytes": (b"a\0b", "is binary; a machine file is text in UTF-8"),
    "no TOML": (b"hello", "not a TOML file: Expected '=' after a key in a key/value pair (at end of document)"),
}


@pytest.mark.parametrize("case", BAD_FILES)
@pytest.mark.parametrize("command", ["check", "show"])
def test_a_bad_file_ends_with_a_sentence_and_exit_code_2(run, tmp_path, case, command):
    content, sentence = BAD_FILES[case]
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    code, out, err = run("machine", command, path)
    assert (code, out) == (2, "")
    assert err.startswith(f"{path}: ") and err.count("\n") == 1
    assert sentence in err and "Traceback" not in err


def test_a_huge_file_is_refused_unread(run, tmp_path):
    path = tmp_path / "huge.toml"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    code, _, err = run("machine", "check", path)
    assert (code, err) == (2, f"{path}: 100 MB is above the limit of 1 MB; is it a machine file?\n")


def test_a_missing_file_or_a_folder_ends_with_a_sentence(run, tmp_path):
    code, _, err = run("machine", "check", tmp_path / "none.toml")
    assert (
        code == 2
        and "is neither a shipped machine (aerostatic_spindle, bently_rk4, dtu_first_assembly," in err
        and "give one of these or a path" in err
    )
    code, _, err = run("machine", "check", tmp_path)
    assert (code, err) == (2, f"{tmp_path}: is not a file; give the path of a machine file\n")


def test_a_folder_that_cannot_be_written_is_named(run, tmp_path):
    path = tmp_path / "none" / "rig.toml"
    code, _, err = run("machine", "new", path)
    assert code == 2
    assert err == f"{path}: cannot be written: its folder is not there; make the folder or choose another place\n"


def test_debug_shows_the_traceback(tmp_path):
    with pytest.raises(Exception, match="neither a shipped machine"):
        main(["machine", "check", str(tmp_path / "none.toml"), "--debug"])


@pytest.mark.parametrize("command", ["new", "check", "show"])
def test_every_help_page_has_an_example(run, command):
    code, out, _ = run("machine", command, "--help")
    assert code == 0 and f"Example: rotorsim machine {command}" in out


def test_a_new_process_prints_the_sentence_and_no_traceback(tmp_path):
    code = "from rotorsim.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "machine", "show", "no_such_rig"], capture_output=True, text=True
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("'no_such_rig' is neither a shipped machine") and done.stderr.count("\n") == 1


@pytest.mark.parametrize("machine", ["dtu_gas_bearing", "pump_on_tables", "grooved_turbo_rotor"])
def test_every_field_of_the_schema_is_shown_with_its_meaning_and_unit(machine):
    loaded = load_machine(machine)
    shown = {path: (value, meaning) for path, value, meaning in rows(loaded)}
    assert all(meaning for _, meaning in shown.values())
    for part, path in ((loaded, ""), *((one, f"bearings.{k}.") for k, one in enumerate(loaded.bearings))):
        for name in set(type(part).model_fields) - {"kind", "effects"}:
            assert any(known == path + name or known.startswith(f"{path}{name}.") for known in shown), path + name
    assert machine == "grooved_turbo_rotor" or shown["drive.highest_speed"][0] == "not set [rpm]"


def test_the_table_has_the_stiffness_in_y_and_no_line_that_says_nothing():
    shown = {path: value for path, value, _ in rows(load_machine("plain_rotor"))}
    assert shown["bearings.0.kyy"] == shown["bearings.0.kxx"] and not any(path.endswith("kind") for path in shown)
