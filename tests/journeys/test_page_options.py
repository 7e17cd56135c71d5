"""`--open` and `--figures`: every command that writes a page has them; computers without browser or display."""

import json
import sys
import webbrowser
from pathlib import Path

import pytest
import typer

import rotorsim as rs
from fault_injection.commands import COMMANDS, leaves
from rotorsim import commands
from rotorsim.base.errors import DataError
from rotorsim.commands.registry import app

STEADY = ("experiment", "steady", "plain_rotor", "--duration", "1 s", "--out", "run")
FOUND = dict(leaves(typer.main.get_command(app)))
WITH_PAGE = [one.words for one in COMMANDS if any(name.endswith(".html") for name in one.files)]


@pytest.mark.parametrize("words", WITH_PAGE, ids=" ".join)
def test_every_command_that_writes_a_page_opens_it_and_writes_its_figures(words):
    assert {"--open", "--figures", "--units"} <= {name for p in FOUND[words].params for name in p.opts}


def test_every_command_that_writes_figures_asks_before_whether_it_may():
    """A study asks for its own folder; a folder of results asks when it is opened."""
    folder = Path(commands.__file__).parent
    texts = [path.read_text() for path in folder.rglob("*.py") if path.name != "identification.py"]
    finished = [text for text in texts if "page.finish(" in text]
    assert len(finished) > 3 and all("page.begin(" in text or ".folder(" in text for text in finished)


@pytest.fixture
def opened(monkeypatch):
    """Addresses that the browser was asked for."""
    addresses = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(webbrowser, "get", lambda *_: None)
    monkeypatch.setattr(webbrowser, "open", lambda address: addresses.append(address) or True)
    return addresses


def test_the_page_is_opened_when_it_is_complete(run, tmp_path, opened):
    code, _, err = run(*STEADY, "--open")
    assert code == 0 and "--open" not in err
    assert opened == [(tmp_path / "run" / "steady.html").as_uri()]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems always have a display")
def test_without_a_display_the_work_is_done_and_the_path_is_printed(run, tmp_path, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    code, _, err = run(*STEADY, "--open")
    page = tmp_path / "run" / "steady.html"
    assert code == 0 and page.is_file()
    assert err == f"--open: there is no browser with a display here; the page is {page}\n"


def test_a_browser_that_does_not_start_is_stated(run, monkeypatch, opened):
    monkeypatch.setattr(webbrowser, "open", lambda address: False)
    code, _, err = run(*STEADY, "--open")
    assert code == 0 and "the page is" in err and len(err.splitlines()) == 1


def test_tables_of_the_figures_are_named_in_the_summary(run, tmp_path):
    code, out, _ = run(*STEADY, "--figures", "csv", "--json")
    assert code == 0 and json.loads(out)["files"]["figures"] == "run/steady_*.csv"
    assert (tmp_path / "run" / "steady_spectra.csv").read_text().startswith("panel,curve,x axis")


def test_page_and_tables_are_in_the_units_that_were_asked_for(run, tmp_path):
    code, _, err = run(*STEADY, "--units", "imperial", "--figures", "csv")
    assert (code, err) == (0, "")
    assert "mil 0-pk" in (tmp_path / "run" / "steady_spectra.csv").read_text()


def test_figures_replace_no_files_unless_they_may(run, tmp_path):
    """A file that is named like a figure is refused before the run; --force removes the older page's figures alone."""
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "steady_spectra.csv").write_text("mine")
    code, out, err = run(*STEADY, "--figures", "csv")
    assert (code, out) == (2, "")
    assert err == "run/steady_spectra.csv: is there already; choose another --out or add --force\n"
    assert [path.name for path in folder.iterdir()] == ["steady_spectra.csv"]
    assert run(*STEADY, "--figures", "csv", "--force")[0] == 0
    assert (folder / "steady_spectra.csv").read_text() != "mine"
    (folder / "steady_notes.csv").write_text("mine")
    page = folder / "steady.html"
    page.write_text(page.read_text().replace('"Spectra"', '"Older"'))
    (folder / "steady_older.csv").write_text("of the older page")
    assert run(*STEADY, "--figures", "csv", "--force")[0] == 0
    assert not (folder / "steady_older.csv").exists() and (folder / "steady_notes.csv").read_text() == "mine"


def test_a_python_call_names_its_own_argument(run, tmp_path):
    assert run(*STEADY, "--no-report")[0] == 0
    record = rs.open_record(tmp_path / "run" / "steady.nc")
    for argument, value in (("units", "imp"), ("figures", "pdf")):
        with pytest.raises(DataError, match=f"^{argument}: '{value}' is not known"):
            rs.write_report(record, tmp_path / "page.html", **{argument: value})


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--figures", "pdf"), "--figures: 'pdf' is not known; known are png, svg, csv"),
        (("--no-report", "--figures", "csv"), "--figures: no page is written; leave --no-report out, or add --report"),
        (("--no-report", "--open"), "--open: no page is written; leave --no-report out, or add --report"),
        (("--units", "inches"), "--units: 'inches' is not known; known are metric, imperial"),
        (("--figures", "png"), "no Chrome, Chromium or Edge to draw figures; install one or set BROWSER_PATH"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_is_computed(run, tmp_path, monkeypatch, arguments, sentence):
    monkeypatch.setenv("BROWSER_PATH", "no-such-browser")
    code, out, err = run(*STEADY, *arguments)
    assert (code, out) == (2, "") and sentence in err and len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_a_browser_that_draws_nothing_leaves_page_and_record(run, tmp_path, monkeypatch):
    monkeypatch.setenv("BROWSER_PATH", "true")
    code, _, err = run(*STEADY, "--figures", "svg")
    assert code == 0 and "its figures are not drawn" in err and len(err.splitlines()) == 1
    assert (tmp_path / "run" / "steady.html").is_file()
