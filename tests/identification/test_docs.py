"""The page on measured data says what is true."""

import re
import tomllib
from pathlib import Path

import identification as idn
from identification.mapping import load_mapping
from identification.recognise import meaning

PAGE = (Path(__file__).parents[2] / "docs" / "data.md").read_text()


def test_every_mapping_on_the_page_is_one():
    blocks = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    first, vectors = (load_mapping(tomllib.loads(block)) for block in blocks)
    assert ("disc_measured", "x") in first.channels and first.constants == {"pressure": 3e5}
    assert ("amplitude", 1, "x") in vectors.vectors


def test_every_name_on_the_page_is_recognised():
    names = PAGE.split("## Names that need no mapping")[1].split("with the unit")[0]
    assert all(meaning(name) for name in re.findall(r"`(\w+)`", names))


def test_every_function_on_the_page_is_there():
    assert all(hasattr(idn, name) for name in re.findall(r"idn\.(\w+)", PAGE))
