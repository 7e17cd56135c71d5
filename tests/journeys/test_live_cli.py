"""What `rotorsim live` refuses before it opens a page."""

from pathlib import Path

import pytest

OTHER = Path(__file__).parent / "no_model.json"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--port", "0"), "0 is no port; give one from 1 to 65535"),
        (("--seed", "-1"), "greater than or equal to 0"),
        (("--out", __file__), "is a file; give a folder for scenes and records"),
        (("plain_rotor", "--law", "p.json"), "plain_rotor has no injectors that a controller could move"),
        (("--law", "nothing.json"), "is not there; give a file that 'rotorsim design' wrote"),
        (("--law", OTHER), "is no law (its kind is 'scene')"),
        (("nothing.toml",), "nothing.toml"),
        ((OTHER,), "no_model.json"),
    ],
)
def test_bad_input_is_refused_with_a_sentence_and_exit_code_2(run, arguments, sentence):
    code, out, err = run("live", *arguments, "--no-browser")
    assert (code, out) == (2, "")
    assert sentence in " ".join(err.split())
    assert "Traceback" not in err
