"""`rotorsim live`: inputs refused before a page opens."""

import webbrowser
from pathlib import Path

import pytest

from rotorsim.machine import machine_text

OTHER = Path(__file__).parent / "no_model.json"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--port", "0"), "0 is not a port; give one from 1 to 65535"),
        (("--seed", "-1"), "greater than or equal to 0"),
        (("--out", __file__), "is a file; give a folder for scenes and records"),
        (("plain_rotor", "--law", "p.json"), "plain_rotor has no injectors that a controller could move"),
        (("--law", "nothing.json"), "is not there; give a file that 'rotorsim design' wrote"),
        (("--law", OTHER), "is not a law (its kind is 'scene')"),
        (("nothing.toml",), "nothing.toml"),
        ((OTHER,), "no_model.json"),
    ],
)
def test_bad_input_is_refused_with_a_sentence_and_exit_code_2(run, arguments, sentence):
    code, out, err = run("live", *arguments, "--no-browser")
    assert (code, out) == (2, "")
    assert sentence in " ".join(err.split())
    assert "Traceback" not in err


def test_a_machine_file_with_an_error_is_refused_at_once_where_no_browser_can_show_it(run, tmp_path, monkeypatch):
    monkeypatch.setattr(webbrowser, "_tryorder", [])
    (tmp_path / "wrong.toml").write_text(machine_text("plain_rotor").replace("[shaft]", "[shaf]", 1))
    code, out, err = run("live", tmp_path / "wrong.toml")
    assert (code, out) == (2, "")
    assert "shaf: unknown field; did you mean 'shaft'?" in err
