"""`rotorsim live`: inputs refused before a page opens."""

import warnings
import webbrowser
from pathlib import Path

import pytest

from rotorsim.base.errors import DataError
from rotorsim.machine import machine_text

OTHER = Path(__file__).parent / "no_model.json"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--port", "0"), "0 is not a port; give one from 1 to 65535"),
        (("--seed", "-1"), "greater than or equal to 0"),
        (("--out", __file__), "is a file; name a folder"),
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


def test_warnings_of_a_package_that_the_server_does_not_use_are_not_shown(run, monkeypatch):
    """It was "urllib3 (2.6.0) or chardet doesn't match a supported version"."""

    def end(machine):
        warnings.warn_explicit("urllib3 does not match", UserWarning, "requests/__init__.py", 113, module="requests")
        raise DataError("end")

    monkeypatch.setattr("rotorsim.commands.live._saved", end)
    assert run("live", "plain_rotor", "--no-browser") == (2, "", "end\n")
