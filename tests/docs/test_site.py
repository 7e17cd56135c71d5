"""The site: every package has its page, every page its place, and links to files exist (`.ci/docs` builds it)."""

import re
import sys
from pathlib import Path

import pytest

import rotorsim as rs

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS))
import site_pages  # noqa: E402

PAGES = sorted(p for p in DOCS.rglob("*.md") if "api" not in p.parts and "_site" not in p.parts)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


def test_every_public_package_has_a_page_of_the_reference():
    packages = {getattr(rs, name).__name__ for name in dir(rs) if type(getattr(rs, name)).__name__ == "module"}
    assert packages <= site_pages.API.keys()


def test_every_page_has_a_place_in_the_list_of_contents():
    listed = set(re.findall(r"^([\w/]+)$", (DOCS / "index.md").read_text(encoding="utf-8"), re.MULTILINE))
    written = {p.relative_to(DOCS).with_suffix("").as_posix() for p in PAGES if "examples" not in p.parts} - {"index"}
    assert written <= listed
    assert {page for page in listed if not (DOCS / f"{page}.md").exists()} <= {
        "api",
        "bibliography",
        "changes",
        "gallery",
    }


@pytest.mark.parametrize(
    "page", [DOCS.parent / "README.md", DOCS.parent / "CONTRIBUTING.md", *PAGES], ids=lambda p: p.stem
)
def test_no_link_to_a_file_is_broken(page):
    generated = {"api", "bibliography", "changes", "gallery"} | {
        f"examples/{p.stem}" for p in DOCS.glob("examples/*.py")
    }
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        if re.match(r"https?://|mailto:", target):
            continue
        file = (page.parent / target).resolve()
        known = file.is_relative_to(DOCS) and file.relative_to(DOCS).with_suffix("").as_posix() in generated
        assert known or file.exists(), f"{page.name}: {target}"


def test_an_example_has_a_page_with_its_text_picture_and_script():
    text = site_pages.example_page(DOCS / "examples" / "campbell.py")
    assert text.startswith("# Campbell diagram of a rotor\n") and "](campbell.png)" in text
    assert "{literalinclude} campbell.py" in text


def test_the_bibliography_has_every_reference_and_links_a_doi():
    text = site_pages.bibliography()
    assert "(nelson_1980)=" in text and "](https://doi.org/10.1016/j.ymssp.2015.09.016)" in text


def test_a_page_of_the_reference_lists_the_values_that_other_files_define():
    assert site_pages.constants("rotorsim.bench").keys() == {"PARTS"}
    assert ".. py:data:: PARTS\n   :module: rotorsim.bench\n\n   Benchmarks" in site_pages._api("rotorsim.bench", "")
    assert site_pages.constants("rotorsim.experiments") == {}, "autodoc lists those of the package's own file"
