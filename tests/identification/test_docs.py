"""Examples in docs/data.md: mappings, column names and functions exist."""

import re
import tomllib
from pathlib import Path

import identification as idn
from identification.records.mapping import load_mapping
from identification.records.proposal import meaning

PAGE = (Path(__file__).parents[2] / "docs" / "data.md").read_text()


def test_every_mapping_on_the_page_is_one():
    blocks = re.findall(r"```toml\n(.*?)```", PAGE.split("In the machine file the same")[0], re.DOTALL)
    first, lab, vectors, slow, housing = (load_mapping(tomllib.loads(block)) for block in blocks)
    assert lab.keyphasor is not None and lab.keyphasor[1].level == -4.0 and set(lab.probes) == {"A", "B"}
    assert ("disc_measured", "x") in first.channels and first.constants == {"pressure": 3e5}
    assert ("amplitude", 1, "x") in vectors.vectors
    assert housing.keyphasor is not None and len(housing.channels) == 4
    assert slow.slow_roll is not None and slow.slow_roll.file is not None and slow.slow_roll.file.name == "slow.csv"


def test_every_name_on_the_page_is_recognised():
    names = PAGE.split("## Names that need no mapping")[1].split("with the unit")[0]
    assert all(meaning(name) for name in re.findall(r"`(\w+)`", names))


def test_every_function_on_the_page_is_there():
    assert all(hasattr(idn, name) for name in re.findall(r"idn\.(\w+)", PAGE))
