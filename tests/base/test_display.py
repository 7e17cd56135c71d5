"""Short texts and notebook tables of the values that users look at."""

from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import rotorsim as rs
from rotorsim.base.display import Card, html, several, text
from rotorsim.discrepancy.machine_file import IdentifiedEffect

RIG = Path(__file__).parents[1] / "control" / "rig_model.json"


def diagnosis(machine):
    """One that names an unbalance."""
    found = IdentifiedEffect("unbalance", "unbalance", {"me": 1.2e-5}, {"me": 1e-7}, ("unbalance",))
    return rs.Diagnosis(
        "named", machine, (found,), (), {}, {}, "", localisation=(), unknown={},
        gap=xr.Dataset(), notes=(),
    )  # fmt: skip


@pytest.fixture(scope="module")
def values():
    machine = rs.load_machine("dtu_gas_bearing")
    plant, lpv = rs.Plant(machine, n_theta=16, n_z=4), rs.load_model(RIG)
    gain = np.zeros((1, 1, 2, 2))
    none = {"A": np.zeros((1, 1, 0, 0)), "B": np.zeros((1, 1, 0, 2)), "C": np.zeros((1, 1, 2, 0))}
    law = rs.Law("mine", **none, D=gain, W=np.zeros((1, 1, 0, 2)), speeds=[0.0], pressures=[0.0])
    return {
        "machine": machine, "plant": plant, "linear plant": plant.linearise(300.0, 0.5e6), "lpv": lpv,
        "linear": lpv.at(300.0, 5e5), "law": law, "diagnosis": diagnosis(machine),
        "equilibrium": plant.equilibrium(300.0, 0.5e6), "rest": rs.Plant("plain_rotor").equilibrium(),
        "simulation": plant.start(300.0, 0.5e6), "plan": rs.campaign.load_plan("thesis"),
        "point": rs.analysis.operating_point(plant, 300.0, 0.5e6),
    }  # fmt: skip


KINDS = ("diagnosis", "machine", "plant", "linear plant", "lpv", "linear", "law", "equilibrium", "rest", "simulation",
         "plan", "point")  # fmt: skip


class Balanced(HTMLParser):
    """Every tag that is opened is closed."""

    def __init__(self):
        super().__init__()
        self.open, self.wrong = [], []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        if self.open.pop() != tag:
            self.wrong.append(tag)


@pytest.mark.parametrize("kind", KINDS)
def test_the_text_of_a_value_is_one_short_line(values, kind):
    line = repr(values[kind])
    assert line.startswith("<") and line.endswith(">") and "\n" not in line and 20 < len(line) <= 162


@pytest.mark.parametrize("kind", KINDS)
def test_the_table_of_a_value_is_small_and_well_formed(values, kind):
    table = values[kind]._repr_html_()
    parser = Balanced()
    parser.feed(table)
    assert not parser.wrong and not parser.open and len(table) < 3000
    assert values[kind].card().title.split(":")[0] in table


def test_machines_that_differ_have_texts_that_differ(values):
    other = values["machine"].replace("effects.unbalance.me", "13 g*mm")
    assert repr(other) != repr(values["machine"]) and "gas film" in repr(other)


def test_the_numbers_are_those_of_the_value(values):
    linear = values["linear"]
    assert f"{linear.wn[0] / (2 * np.pi):.4g}" in repr(linear)
    rest = values["equilibrium"]
    assert f"{rest.h_min * 1e6:.4g} um" in repr(rest) and f"{rest.mass_flow.sum() * 1e6:.4g} mg/s" in rest._repr_html_()
    assert "2865 rpm" in repr(values["simulation"]) and f"{len(values['plan'])} cases" in repr(values["plan"])
    assert "0 states" in repr(values["law"]) and "5 V" in repr(values["law"])


def test_what_a_user_named_is_escaped_in_html():
    assert "<script>" not in html(Card("<script>", [("<b>", "a & b")])) and "a &amp; b" in html(
        Card("", [("", "a & b")])
    )


def test_long_texts_and_lists_are_cut():
    line = text(Card("title", [("name", "x" * 100), ("more", "y" * 100)]))
    assert line.endswith("x>") and "y" not in line
    assert several(range(9)) == "0, 1, 2, 3, ... (9)"


def test_a_printed_value_shows_every_row(values):
    for value in values.values():
        assert all(text in str(value) for _, text in value.card().rows) or isinstance(value, rs.Machine)
    table = rs.control.RunoutTable(np.full((8, 2), 1e-6), taken="2026-01-02")
    assert "taken 2026-01-02" in str(values["law"].with_(runout=table))
