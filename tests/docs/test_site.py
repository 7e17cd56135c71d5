"""The site: every package has its page, every page its place, and links to files exist (`.ci/docs` builds it)."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import rotorsim as rs

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS))
import site_pages  # noqa: E402

PAGES = sorted(p for p in DOCS.rglob("*.md") if "api" not in p.parts and "_site" not in p.parts)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


def tables(text):
    """Rows of the tables of a page, each as (head, row); code blocks are left out."""
    head = ""
    for line in re.sub(r"(?ms)^```.*?^```", "", text).splitlines():
        row = line.strip()
        head = "" if not row.startswith("|") else head or row
        if head:
            yield head, row


def cells(row):
    """Number of cells of a row: pipes with a backslash are text."""
    return len(re.split(r"(?<!\\)\|", row.strip().strip("|")))


def test_a_row_of_a_table_has_the_cells_of_its_head():
    rows = [
        (page.stem, *row) for page in (DOCS.parent / "README.md", *PAGES) for row in tables(page.read_text("utf-8"))
    ]
    wrong = [(page, row) for page, head, row in rows if cells(row) != cells(head)]
    assert len(rows) > 100 and not wrong, "write a pipe in a cell as \\|"


def test_every_public_package_has_a_page_of_the_reference():
    packages = {getattr(rs, name).__name__ for name in dir(rs) if type(getattr(rs, name)).__name__ == "module"}
    assert packages <= site_pages.API.keys()


def test_every_page_has_a_place_in_the_list_of_contents():
    listed = set(re.findall(r"^([\w/]+)$", (DOCS / "index.md").read_text(encoding="utf-8"), re.MULTILINE))
    written = {p.relative_to(DOCS).with_suffix("").as_posix() for p in PAGES if "examples" not in p.parts} - {"index"}
    assert written == listed


def test_no_link_to_a_file_is_broken():
    pages = (DOCS.parent / "README.md", DOCS.parent / "CONTRIBUTING.md", *PAGES)
    links = [(page, target) for page in pages for target in LINK.findall(page.read_text(encoding="utf-8"))]
    files = [(page, target) for page, target in links if not re.match(r"https?://|mailto:", target)]
    assert len(files) > 100
    assert [(page.name, target) for page, target in files if not (page.parent / target).resolve().exists()] == []


def test_generated_pages_in_the_repository_are_those_of_the_build():
    pages = site_pages.stored_pages()
    stored = {name: (DOCS / name).read_text(encoding="utf-8") for name in pages if (DOCS / name).exists()}
    wrong = [name for name, text in pages.items() if stored.get(name) != text]
    assert len(pages) > 10 and not wrong, "write them again: python docs/site_pages.py"


def test_no_page_of_an_example_is_left_without_one():
    assert {p.stem for p in (DOCS / "examples").glob("*.md")} == {p.stem for p in (DOCS / "examples").glob("*.py")}


def test_an_example_has_a_page_with_its_text_picture_and_script():
    text = site_pages.example_page(DOCS / "examples" / "campbell.py")
    assert text.startswith("# Campbell diagram of a rotor\n") and "](campbell.png)" in text
    assert "{literalinclude} campbell.py" in text


@pytest.mark.parametrize("name", ["balance", "diagnose_runup", "measured_runup"])
def test_an_example_of_measured_data_offers_them_and_names_what_is_missing(name, tmp_path):
    """Downloaded alone it ended in StopIteration."""
    script = DOCS / "examples" / f"{name}.py"
    data = site_pages.data_of(script)
    assert data and all((DOCS / "rk4" / one).is_file() for one in data)
    assert all(f"](../rk4/{one})" in site_pages.example_page(script) for one in data)
    alone = tmp_path / script.name
    alone.write_text(script.read_text(encoding="utf-8"), encoding="utf-8")
    ran = subprocess.run(
        [sys.executable, alone], capture_output=True, text=True, env=os.environ | {"MPLBACKEND": "Agg"}
    )
    assert ran.returncode == 1 and "Traceback" not in ran.stderr
    assert len(ran.stderr.splitlines()) == 1 and all(one in ran.stderr for one in data)


def test_the_bibliography_has_every_reference_and_links_a_doi():
    text = site_pages.bibliography()
    assert '<a id="nelson_1980"></a>' in text and "](https://doi.org/10.1016/j.ymssp.2015.09.016)" in text


def test_a_page_of_the_reference_lists_the_values_that_other_files_define():
    assert "DESIGNS" in site_pages.constants("rotorsim.control")
    assert ".. py:data:: DESIGNS\n   :module: rotorsim.control\n" in site_pages._api("rotorsim.control", "")
    assert site_pages.constants("rotorsim.experiments") == {"EXPERIMENTS": "Every experiment by its name."}


def test_the_installation_page_lists_every_extra():
    extras = tomllib.loads((DOCS.parent / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    page = (DOCS / "install.md").read_text()
    assert len(extras) > 5 and [name for name in extras if f'".[{name}]"' not in page] == []


WORDS = 45
"""Longest paragraph of a page or entry of its lists [words]; tables, code and formulas are none."""
LONGER = {"bibliography", "changes", "theory_film"}
"""Pages of sources and changes, and one whose paragraphs are still longer."""


def paragraphs(text):
    """Paragraphs and entries of lists of a page, without code, formulas, tables, headings and pictures."""
    plain = re.sub(r"(?ms)^(```|\$\$).*?^(```|.*\$\$)\s*$", "", text)
    blocks = (block.strip() for block in re.split(r"\n\s*\n", plain))
    prose = (block for block in blocks if block and not block.startswith(("|", "#", "!", ":::", "<", ">")))
    return [entry for block in prose for entry in re.split(r"(?m)^\s*(?:[-*]|\d+\.)\s+", block)]


def test_no_paragraph_is_long():
    counted = {(page.stem, text[:50]): len(text.split()) for page in sorted(DOCS.glob("*.md"))
               if page.stem not in LONGER for text in paragraphs(page.read_text())}  # fmt: skip
    assert len(counted) > 600 and {one for one, words in counted.items() if words > WORDS} == set()


def test_a_page_states_a_sentence_once_and_ends_with_its_last_line():
    pages = [page for page in PAGES if page.stem not in {"bibliography", "effects"}]
    texts = {page.stem: page.read_text(encoding="utf-8") for page in pages}
    assert len(texts) > 30 and [name for name, text in texts.items() if not text.endswith("\n")] == []
    for name, text in texts.items():
        stated = [" ".join(one.split()) for part in paragraphs(text) for one in re.split(r"(?<=[.!?])\s+", part)]
        assert [one for one in stated if stated.count(one) > 1 and len(one.split()) > 5] == [], name
