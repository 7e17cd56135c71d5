"""Runs that pass a limit of their machine end there with the reason; what is beyond the checked range is stated."""

import warnings

import numpy as np
import pytest
import xarray as xr

import rotorsim as rs
from identification import validate
from refusals import refused
from rotorsim import experiments as ex
from rotorsim.base.errors import LimitError, OtherMachine
from rotorsim.control import LawError
from rotorsim.experiments.running import BEYOND, sentences
from rotorsim.experiments.summary import summarise, summarise_experiment
from rotorsim.machine import Limits
from rotorsim.signals.orders import track_orders

P = 0.6e6
RAMP = (500.0, 700.0, 1000.0, P)
"""0.2 s, 1000 samples; the disc's rim, of 70 mm, moves at 40 m/s at 571 rad/s."""


@pytest.fixture(scope="module")
def plant():
    return rs.Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)


@pytest.fixture(scope="module")
def limited(plant):
    return rs.Plant(plant.machine.with_({"limits": Limits(tip_speed="40 m/s")}))


def test_a_run_up_ends_at_the_limit_with_the_bits_of_the_one_without(plant, limited):
    whole, cut = (ex.runup(one, *RAMP) for one in (plant, limited))
    n = cut.sizes["time"]
    assert validate(cut) is not None and 300 < n < 400 and whole.sizes["time"] == 1000
    assert float(whole["speed"][n - 1]) <= 40.0 / 0.07 < float(whole["speed"][n])
    for name in whole.data_vars:
        np.testing.assert_array_equal(cut[name].values, whole[name].values[:n])
    assert whole.attrs["ended"] == "complete"
    assert cut.attrs["ended"].startswith("ended at 5458 rpm: the rim of discs.0, radius 70 mm, moves at 40.0")


@pytest.mark.parametrize("block", [5000, 137])
def test_memory_file_and_any_length_of_a_block_end_alike(limited, tmp_path, block):
    ramp = ex.Runup(*RAMP)
    outcome = rs.record(limited, ramp, tmp_path / "run.nc", block=block)
    memory = rs.run(limited, ramp)
    assert (outcome.samples, outcome.complete) == (memory.sizes["time"], False)
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as kept:
        assert kept.attrs["ended"] == memory.attrs["ended"] == outcome.ended
        np.testing.assert_array_equal(kept["disc"].values, memory["disc"].values)


def test_a_pressure_that_changes_ends_alike(limited):
    steady, changing = ex.runup(limited, *RAMP), ex.runup(limited, *RAMP[:3], lambda t: P)
    assert changing.attrs["ended"] == steady.attrs["ended"] and changing.sizes == steady.sizes
    np.testing.assert_array_equal(changing["disc"].values, steady["disc"].values)


def test_a_coast_down_that_ends_by_itself_knows_no_limit(limited):
    down = rs.run(limited, ex.Coastdown(100.0, 99.99, None, P, longest=0.5))
    assert down.attrs["ended"] == "complete" and down.sizes["time"] < 2500


@pytest.mark.parametrize("run", [ex.runup, lambda plant, *ramp: ex.runup(plant, *ramp[:3], lambda t: P)])
def test_a_run_that_would_begin_beyond_a_limit_is_refused(limited, run):
    with refused(LimitError, "limits", lambda text: "limits.tip_speed 40 m/s" in text) as caught:
        run(limited, 600.0, 700.0, 1000.0, P)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.slow
def test_a_film_that_warms_up_ends_a_run_at_constant_speed():
    """Journal and sleeve of little capacity take up the friction within the run, from the equilibrium on."""
    machine = rs.load_machine("grooved_turbo_rotor").with_({"grid.n_theta": 24, "grid.n_z": 8})
    heat = {"friction_share": 1.0, "journal_capacity": "1e-3 J/K", "sleeve_capacity": "1e-3 J/K"}
    heat |= {"journal_conductance": "0.1 W/K", "sleeve_conductance": "0.5 W/K"}
    warm = machine.replace("effects.heat_balance", heat)
    ramp = (3000.0, 6000.0, 60000.0)
    whole = ex.runup(rs.Plant(warm), *ramp, 0.0)
    rises = whole["temperature_rise"].values.reshape(whole.sizes["time"], -1).max(axis=1)
    limit = 293.15 + 0.5 * (rises[0] + rises[-1])
    cut = ex.runup(rs.Plant(warm.with_({"limits": Limits(temperature=f"{limit} K")})), *ramp, 0.0)
    n = cut.sizes["time"]
    assert (rises[:n] <= limit - 293.15).all() and rises[n] > limit - 293.15
    assert "degC in a film, above limits.temperature" in cut.attrs["ended"]


def test_choked_feed_holes_end_a_run_where_a_machine_limits_them(plant):
    """The flow through narrow curtains becomes sonic at the pins that a reference opens."""
    narrow = plant.machine.replace("injection.curtain_discharge", 0.18)
    free = rs.Plant(narrow.replace("limits.choked_feeds", 1.0))
    bound = rs.Plant(narrow.replace("limits.choked_feeds", 0.0))
    hold = ex.Controlled(100.0, P, 0.3, 0.0, 0.0, lambda measured, speed, pressure: (3.0, 3.0))
    assert rs.run(free, hold).attrs["ended"] == "complete"
    cut = rs.run(bound, hold)
    assert cut.sizes["time"] % 250 == 0 and cut.sizes["time"] < 1500
    assert "of the feed holes of bearing 1 are choked where they enter the film" in cut.attrs["ended"]
    again = rs.run(bound, hold, block=137)
    assert again.attrs["ended"] == cut.attrs["ended"] and again.sizes == cut.sizes


def test_a_closed_loop_ends_with_the_bits_of_the_one_without(plant):
    """The block in which it ends is computed again up to there, with the references that the law gave at first."""
    heat = {"friction_share": 1.0, "journal_capacity": "0 J/K", "sleeve_capacity": "0 J/K"}
    warm = plant.machine.replace("effects.heat_balance", heat)
    loop = ex.Controlled(400.0, P, 0.2, 0.2, 0.0, ex.ProportionalLaw(), (ex.Prbs(amplitude=0.4, bias=0.0),))
    whole = rs.run(rs.Plant(warm), loop)
    rises = whole["temperature_rise"].values.reshape(whole.sizes["time"], -1).max(axis=1)
    limit = 293.15 + 0.5 * (rises[0] + rises.max())
    cut = rs.run(rs.Plant(warm.with_({"limits": Limits(temperature=f"{limit} K")})), loop)
    n = cut.sizes["time"]
    assert (rises[:n] <= limit - 293.15).all() and rises[n] > limit - 293.15 and 1 < n < 1000
    for name in whole.data_vars:
        np.testing.assert_array_equal(cut[name].values, whole[name].values[:n])
    assert np.abs(cut["reference"].values).max() > 0.1


def test_records_state_what_they_exceed_and_within_the_range_nothing(plant):
    inside = ex.runup(plant, 500.0, 600.0, 1000.0, P)
    assert BEYOND not in inside.attrs and sentences(inside.attrs) == []
    beyond = ex.runup(plant, *RAMP)
    (text,) = sentences(beyond.attrs)
    assert text.startswith("above 6000 rpm: 6683 rpm, 1.11 times the highest speed at which the machine's model")
    low = rs.run(plant, ex.Steady(100.0, 0.25e6, 0.1))
    assert sentences(low.attrs)[0].startswith("0.25 MPa, below the pressures at which")
    assert summarise_experiment(low)[BEYOND] == sentences(low.attrs)
    assert summarise(beyond, track_orders(beyond))[BEYOND] == [text]
    assert BEYOND not in summarise_experiment(inside)
    falling = ex.runup(plant, *RAMP[:3], lambda t: 0.35e6 - 0.4e6 * t)
    found = sentences(falling.attrs)
    assert (
        sum("MPa, below the pressures at which" in text for text in found) == 1 and falling.attrs["ended"] == "complete"
    )
    assert sum(text.startswith("above 6000 rpm: ") for text in found) == 1


def test_the_page_and_a_file_state_it_too(plant, tmp_path):
    rs.record(plant, ex.Runup(*RAMP), tmp_path / "run.nc")
    rs.write_report(tmp_path / "run.nc", tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "Beyond the range in which the model was checked: above 6000 rpm: " in page


def law_of(machine, **settings):
    law = rs.Law(
        "softener", np.zeros((1, 1, 0, 0)), np.zeros((1, 1, 0, 2)), np.zeros((1, 1, 2, 0)), 1e4 * np.eye(2)[None, None],
        np.zeros((1, 1, 0, 2)), [0.0], [0.0], **settings,
    )  # fmt: skip
    return law.with_(about={"machine": machine} if machine else {})


def test_a_law_of_another_machine_warns_and_a_changed_machine_of_its_name_does_not(plant):
    own, other = law_of(f"dtu_gas_bearing {plant.machine.hash}"), law_of("my_rig 0123")
    changed = rs.Plant(plant.machine.with_({"bearings.1.clearance": 26e-6}))
    with warnings.catch_warnings():
        warnings.simplefilter("error", OtherMachine)
        for law in (own, law_of("")):
            changed.simulate(0.01, 100.0, P, controller=law)
            ex.controlled(plant, law, 100.0, P, duration=0.01)
    words = "law softener: was designed on a model of my_rig, and the machine is dtu_gas_bearing: a test of robustness"
    with pytest.warns(OtherMachine, match=words):
        plant.simulate(0.01, 100.0, P, controller=other)
    with pytest.warns(OtherMachine, match=words):
        record = ex.controlled(plant, other, 100.0, P, duration=0.01)
    assert record.attrs["law_machine"] == "my_rig 0123"
    with pytest.warns(OtherMachine, match=words):
        rs.verify.safe_speed(plant, other, start=300.0, stop=310.0, rate=300.0)


def test_a_law_of_another_rate_is_refused(plant):
    law = law_of("", Ts=1e-4)
    for run in (
        lambda: plant.simulate(0.01, 100.0, P, controller=law),
        lambda: ex.controlled(plant, law, 100.0, P, duration=0.01),
        lambda: rs.verify.safe_speed(plant, law, start=300.0, stop=310.0, rate=300.0),
        lambda: rs.verify.closed_loop(law, plant),
    ):
        with refused(LawError, "Ts", 1e-4):
            run()
