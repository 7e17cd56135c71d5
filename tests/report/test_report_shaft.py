"""Figures of the shaft library: plotted values in the units of the axes."""

import numpy as np
import pytest
import xarray as xr

import rotorsim.report as report
from fe_shaft import BearingElement, DiskElement, Rotor, ShaftElement, steel
from rotorsim.base.errors import DataError
from rotorsim.report.page import phase_lag


@pytest.fixture(scope="module")
def rotor():
    shaft = [ShaftElement(0.25, 0.0, 0.05) for _ in range(6)]
    disc = DiskElement.from_geometry(2, steel, 0.07, 0.05, 0.28)
    return Rotor(shaft, [disc], [BearingElement(n, 1e6, 500.0, kyy=0.8e6) for n in (0, 6)])


def test_campbell_figure_draws_each_branch_in_hertz_over_rpm(rotor):
    found = rotor.run_campbell(np.linspace(10.0, 400.0, 5), frequencies=4)
    figure = report.shaft_campbell(found.dataset())
    first = figure.data[0]
    assert first.x[-1] == pytest.approx(400 * 30 / np.pi, rel=1e-4)
    assert first.y == pytest.approx(found.along_branch("wn")[:, 0] / (2 * np.pi), rel=1e-4)
    senses = {"forward": "triangle-up", "backward": "triangle-down", "mixed": "circle"}
    assert list(first.marker.symbol) == [senses[s] for s in found.dataset()["whirl"].values[:, 0]]
    assert figure.layout.xaxis2.title.text == "speed [rpm]"


def test_map_of_critical_speeds_is_logarithmic_and_complete(rotor):
    found = rotor.run_ucs((1e6, 1e9), num=4)
    figure = report.critical_speed_map(found.dataset())
    assert len(figure.data) == 4 and figure.layout.xaxis.type == "log"
    assert figure.data[1].y == pytest.approx(found.wn[1] * 30 / np.pi, rel=1e-4)


def test_unbalance_response_is_drawn_where_the_shaft_moves_most(rotor):
    found = rotor.run_unbalance_response(2, 1e-4, 0.0, np.linspace(20.0, 200.0, 40)).dataset()
    figure = report.unbalance_response(found)
    assert figure.data[0].y.max() == pytest.approx(float(found["major"].max()) * 1e6, rel=1e-4)
    assert len(report.unbalance_response(found, (0, 2)).data) == 4


def test_speeds_without_an_answer_take_no_phase_from_the_others():
    a = np.exp(-0.1j * np.arange(12.0))
    assert phase_lag(np.where(np.arange(12) < 2, np.nan, a))[2:] == pytest.approx(phase_lag(a)[2:])


def test_sag_is_drawn_downwards_in_micrometres(rotor):
    found = rotor.run_static()
    y = report.sag(found.dataset()).data[1].y
    assert y == pytest.approx(found.displacement[1::4] * 1e6, rel=1e-4) and max(y) < 0


@pytest.mark.parametrize(
    "draw", [report.shaft_campbell, report.critical_speed_map, report.unbalance_response, report.sag]
)
def test_another_dataset_is_refused_in_a_sentence(draw):
    with pytest.raises(DataError, match=f"{draw.__name__}: there is no '.*'; give the .dataset"):
        draw(xr.Dataset({"time": ("time", [0.0, 1.0])}))
