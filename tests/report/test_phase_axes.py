"""Phases of synchronous vibration are drawn in one way: lags, downwards, a tick every 90 deg."""

import numpy as np
import pytest

import rotorsim as rs
from fe_shaft import BearingElement, DiskElement, Rotor, ShaftElement, steel
from identification import make_vectors
from rotorsim.report.diagnosis import bode

SPEED = np.linspace(50.0, 400.0, 200)
PEAK = 1e-6 / (1 - (SPEED / 200) ** 2 + 0.1j * SPEED / 200)


def comparison():
    runs = {name: make_vectors(SPEED, np.abs(PEAK)[:, None, None], -np.angle(PEAK)[:, None, None], (1,), axes=("x",))
            for name in "ab"}  # fmt: skip
    return rs.report.overlay(rs.signals.compare_runs(runs))


def shaft():
    parts = [ShaftElement(0.05, 0.0, 0.02, material=steel) for _ in range(4)]
    disc = DiskElement.from_geometry(n=2, material=steel, width=0.02, i_d=0.02, o_d=0.1)
    rotor = Rotor(parts, [disc], [BearingElement(n, kxx=1e6, cxx=300.0) for n in (0, 4)])
    return rs.report.unbalance_response(rotor.run_unbalance_response(2, 1e-5, 0.0, SPEED * 5).dataset())


def diagnosis():
    vectors = PEAK[None, None, :]
    part = {"channels": ("x",), "speeds": SPEED, "measured_vectors": vectors, "simulated_vectors": [vectors] * 2}
    return bode([part], 0, False)


@pytest.mark.parametrize("drawn", [comparison, shaft, diagnosis])
def test_a_phase_is_a_lag_that_grows_downwards_through_a_resonance(drawn):
    figure = drawn()
    axis = next(one for one in figure.select_yaxes() if "phase lag" in (one.title.text or ""))
    assert axis.title.text.endswith("[deg]") and axis.autorange == "reversed" and axis.dtick == 90
    lag = next(np.asarray(t.y, float) for t in figure.data if t.yaxis == axis.plotly_name.replace("axis", ""))
    lag = lag[np.isfinite(lag)]
    assert lag[0] == pytest.approx(0, abs=10) and lag[-1] == pytest.approx(180, abs=20)
