"""Random machines: closed forms of distributions, shares and probabilities; followed speeds against whole searches."""

import numpy as np
import pytest

import rotorsim as rs
from rotorsim.analysis.design_review import design_review
from rotorsim.analysis.optimise import margin
from rotorsim.analysis.tolerances import (
    AGREED,
    Equilibria,
    Requirement,
    clopper_pearson,
    random_machines,
    rank_shares,
    read_requirements,
    read_variations,
)
from rotorsim.campaign.scheduler import spread_on
from rotorsim.errors import NoLiftOffError
from rotorsim.plant.simulation import describe, settle
from rotorsim.report.random import miss_rows, optimisation_page

MASS = "discs.0.mass=+- 4 %, bearings.*.kxx=10 MN/m +- 0.5 MN/m normal"


@pytest.fixture(scope="module")
def rotor():
    return rs.load_machine("plain_rotor")


@pytest.fixture(scope="module")
def found(rotor):
    return random_machines(rotor, MASS, 60, "criticals", ["critical_2 > 2640 rpm"], highest="4000 rpm", seed=3)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("discs.0.mass=4 kg +- 0.1 kg", [("discs.0.mass", 4.0, 0.1, "kg", False)]),
        ("discs.0.mass=4 kg +/- 100 g NORMAL", [("discs.0.mass", 4.0, 0.1, "kg", True)]),
        ("discs.0.mass=± 10%", [("discs.0.mass", 3.946, 0.3946, "kg", False)]),
        ("bearings.*.kxx = 10 MN/m +- 5 % uniform", [(f"bearings.{k}.kxx", 10.0, 0.5, "MN/m", False) for k in (0, 1)]),
        ("shaft.damping_ratio=0.002 +- 0.001", [("shaft.damping_ratio", 0.002, 0.001, "", False)]),
    ],
)
def test_a_tolerance_is_read_with_its_units(rotor, text, expected):
    got = [(v.path, v.centre, pytest.approx(v.half), v.unit, v.normal) for v in read_variations([text], rotor)]
    assert got == expected


@pytest.mark.parametrize(
    "text", ["discs.0.mass", "discs.0.mass=4 kg", "discs.0.mass=4 kg +- 1 mm", "discs.0.mass=4 kg +- 5 kg",
             "discs.0.mas=4 kg +- 1 kg", "discs.0.mass=4 kg +- 0 kg", "discs.0.mass=+- 1 %, discs.0.mass=+- 2 %", ""],
)  # fmt: skip
def test_what_is_mistyped_is_refused(rotor, text):
    with pytest.raises((rs.errors.DataError, rs.errors.MachineFileError)):
        read_variations([text], rotor)


@pytest.mark.parametrize("text", ["onset", "onset > 3 kg", "onst > 3000 rpm", "onset = 3000 rpm"])
def test_a_requirement_that_is_mistyped_is_refused(text):
    with pytest.raises(rs.errors.DataError):
        read_requirements([text], ["onset"])
    assert read_requirements(["onset > 60 rpm"], ["onset"]) == (
        Requirement("onset", True, pytest.approx(2 * np.pi), "onset > 60 rpm"),
    )


def test_a_latin_hypercube_has_one_value_in_every_stratum_and_the_moments_of_its_distributions(found):
    mass, stiffness = found.data["discs.0.mass"].values, found.data["bearings.0.kxx"].values
    strata = np.floor((mass / 3.946 - 0.96) / 0.08 * len(mass))
    assert sorted(strata.astype(int).tolist()) == list(range(len(mass)))
    assert stiffness.mean() == pytest.approx(10.0, abs=5e-3) and stiffness.std() == pytest.approx(0.25, rel=0.05)


def test_followed_critical_speeds_are_those_of_whole_searches_and_scale_with_the_mass(found, rotor):
    assert max(found.confirmed.values()) < AGREED
    k = int(found.data["discs.0.mass"].values.argmax())
    changes = {"discs.0.mass": float(found.data["discs.0.mass"][k])}
    changes |= {f"bearings.{b}.kxx": 1e6 * float(found.data[f"bearings.{b}.kxx"][k]) for b in (0, 1)}
    own = rs.analysis.critical_speeds(rs.Plant(rotor.with_(changes)), [0.0], (1,), 420.0)["critical_speed"].values
    assert found.data["critical_2"][k] == pytest.approx(np.nanmax(own), rel=1e-4)
    assert found.shares("critical_2")[0]["discs.0.mass"] > 0.95


def test_every_page_names_a_critical_speed_by_its_sense_frequency_and_nodes(rotor, found):
    """The disc in the middle moves in the first pair and tilts about a node in the third mode, which is backward."""
    own = rs.analysis.critical_speeds(rs.Plant(rotor), [0.0], (1,), 2000.0)
    hertz, sense = own["critical_speed"].values.ravel() / (2 * np.pi), own["critical_whirl"].values.ravel()
    words = [f"{s}, {f:.4g} Hz, {n}" for s, f, n in zip(sense, hertz, ("no node", "no node", "one node"), strict=True)]
    assert sense.tolist() == ["backward", "forward", "backward"]
    assert found.modes == {"critical_1": words[0], "critical_2": words[1]}
    assert miss_rows(found)[0][0] == f"critical_2 > 2640 rpm ({words[1]})"
    best = rs.analysis.optimise(rotor, {"discs.0.mass": "3.946 kg, 4 kg"}, "-critical_1", highest="4000 rpm")
    assert f"critical speed 1 ({best.modes['critical_1']})." in optimisation_page(best).introduction
    review = design_review(rs.Plant(rotor), (1000.0, 1100.0))
    assert [mode.in_words for mode in review.criticals[:3]] == words
    named = [check.name for check in review.checks if check.rule == "margin"]
    assert len(named) == 1 and named[0].endswith(f" rpm, {words[1]}")


def test_the_probability_of_a_miss_is_counted_with_its_interval(found):
    missed, unknown, p, low, high = found.misses(found.requirements[0])
    assert missed == int((found.data["critical_2"].values <= 2640 * np.pi / 30).sum()) and unknown == 0
    assert low < p < high and p == missed / 60


def test_what_is_not_known_counts_as_a_miss(found):
    known = found.data["critical_2"].values.copy()
    found.data["gap"] = ("sample", np.where(np.arange(60) < 6, np.nan, known))
    assert found.misses(Requirement("gap", True, 0.0, "gap > 0"))[:2] == (6, 6)


def test_the_same_seed_gives_the_same_machines(rotor, found):
    again = random_machines(rotor, MASS, 60, "criticals", highest="4000 rpm", seed=3)
    assert np.array_equal(again.data["critical_2"], found.data["critical_2"])
    other = random_machines(rotor, MASS, 60, "criticals", highest="4000 rpm", seed=4)
    assert not np.array_equal(other.data["discs.0.mass"], found.data["discs.0.mass"])


def test_the_interval_of_a_probability_is_the_published_one():
    # 10 of 100: 4.900 % to 17.622 %, as tables of exact binomial intervals have it
    assert clopper_pearson(10, 100) == pytest.approx((0.04900, 0.17622), abs=1e-5)
    assert clopper_pearson(0, 59)[1] == pytest.approx(1 - 0.025 ** (1 / 59), rel=1e-9)


def test_the_shares_of_a_sum_are_those_of_its_variances():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(4000, 3))
    shares, r2 = rank_shares(X, X @ [3.0, 2.0, 1.0], ("a", "b", "c"))
    correlation = np.array([3.0, 2.0, 1.0]) / np.sqrt(14)
    expected = (6 / np.pi * np.arcsin(correlation / 2)) ** 2  # ranks of normal values, Pearson (1907)
    assert list(shares.values()) == pytest.approx(expected, abs=0.02)
    assert r2 == pytest.approx(expected.sum(), abs=0.02)


def test_shares_of_few_machines_may_be_below_zero_and_above_one_and_still_add_up():
    """Six ranks that go together by chance, against r . R^-1 r of their correlations."""
    X, y = np.array([[0.0, 3, 4, 1, 2, 5], [5.0, 4, 1, 3, 2, 0]]).T, np.array([1.0, 0, 3, 4, 2, 5])
    shares, r2 = rank_shares(X, y, ("a", "b"))
    R = np.corrcoef(X.T, y)
    assert shares["a"] < 0.0 and shares["b"] > 1.0
    assert r2 == pytest.approx(R[2, :2] @ np.linalg.solve(R[:2, :2], R[2, :2]), rel=1e-9)


def test_the_onset_of_a_film_is_followed_to_that_of_its_own_search():
    over = "bearings.1.clearance=+- 4 %"
    found = random_machines("dtu_gas_bearing", over, 4, "onset, flow", pressure="0.5 MPa")
    assert found.confirmed["onset"] < AGREED
    clearance = 1e-6 * float(found.data["bearings.1.clearance"][2])
    own = rs.Plant(rs.load_machine("dtu_gas_bearing").with_({"bearings.1.clearance": clearance}))
    assert float(found.data["flow"][2]) == pytest.approx(own.equilibrium(0.0, 0.5e6).mass_flow.sum(), rel=1e-9)


def test_the_best_mass_is_the_one_at_which_the_limit_is_just_kept(rotor):
    # the first critical speed falls with the mass: the lowest one that is allowed is the limit itself
    found = rs.analysis.optimise(
        rotor, {"discs.0.mass": "3 kg, 5 kg"}, "-critical_1", ["critical_1 > 2600 rpm"], highest="5000 rpm"
    )
    best = float(found.data["critical_1"][found.best]) * 30 / np.pi
    assert 2600 <= best < 2602 and max(found.confirmed.values()) < AGREED
    mass = float(found.data["discs_0_mass"][found.best])
    own = rs.Plant(rotor.with_({"discs.0.mass": mass}))
    own = rs.analysis.critical_speeds(own, [0.0], (1,), 420.0)["critical_speed"].values
    assert np.nanmin(own) * 30 / np.pi == pytest.approx(best, rel=1e-4)


def test_a_best_value_at_a_bound_is_the_bound_and_limits_that_nothing_keeps_leave_none(rotor):
    over = {"discs.0.mass": "3 kg, 5 kg"}
    assert rs.analysis.optimise(rotor, over, "critical_1", highest="5000 rpm").machine == {"discs.0.mass": "3 kg"}
    found = rs.analysis.optimise(rotor, over, "critical_1", ["critical_1 > 4000 rpm"], highest="5000 rpm")
    assert found.best is None and found.machine == {}


@pytest.mark.parametrize(("name", "there"), [("critical_1", True), ("critical_9", False), ("onset", False)])
def test_a_limit_of_a_quantity_that_is_not_there_is_refused_by_its_name(rotor, name, there):
    def run():
        return random_machines(rotor, MASS, 2, "criticals", [f"{name} > 3 rpm"], highest="4000 rpm")

    if there:
        assert run().requirements[0].quantity == name
        return
    with pytest.raises(rs.errors.DataError) as refused:
        run()
    assert name in str(refused.value)


@pytest.mark.parametrize(
    ("over", "objective"),
    [
        ("pressure=1 bar, 2 bar", "onset"),
        ("discs.0.mass=3 kg", "critical_1"),
        ("discs.0.mass=3 kg, 5 kg", "critical_9"),
    ],
)
def test_a_search_without_bounds_or_quantity_is_refused(rotor, over, objective):
    with pytest.raises(rs.errors.DataError):
        rs.analysis.optimise(rotor, [over], objective, highest="5000 rpm")


def test_two_processes_give_the_bits_of_one():
    """Films too: each machine is followed from the nominal one by itself, whoever computes it."""
    spindle = rs.load_machine("aerostatic_spindle").with_({"grid.n_theta": 16, "grid.n_z": 8})
    one, two = (
        random_machines(spindle, "bearings.*.clearance=+- 5 %", 11, "flow,damping", pressure=0.5e6, workers=workers)
        for workers in (1, 2)
    )
    for name in one.data:
        assert np.array_equal(one.data[name].values, two.data[name].values)
    assert np.isfinite(one.data["damping"].values).all() and np.ptp(one.data["flow"].values) > 0


def test_a_cluster_gives_the_machines_of_this_computer(rotor):
    from distributed import LocalCluster

    options = {"count": 12, "what": "criticals", "highest": "4000 rpm"}
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as one,
        spread_on(one.scheduler_address, None, None) as each,
    ):
        there = random_machines(rotor, "discs.0.mass=+- 5 %", each=each, **options)
    here = random_machines(rotor, "discs.0.mass=+- 5 %", **options)
    assert np.array_equal(there.data["critical_1"], here.data["critical_1"])


@pytest.mark.parametrize("text", ["20 degC +- 5 degC", "293.15 K +- 5 K"])
def test_a_unit_with_an_offset_gives_the_machines_of_its_value(text):
    found = random_machines("aerostatic_spindle", f"gas.temperature={text}", 2, "flow")
    own = rs.Plant(rs.load_machine("aerostatic_spindle").with_({"gas.temperature": 293.15}))
    assert found.nominal["flow"] == pytest.approx(own.equilibrium(0.0, 0.5e6).mass_flow.sum(), rel=1e-9)
    assert found.data["flow"].values == pytest.approx(found.nominal["flow"], rel=0.02)


def test_an_onset_above_the_highest_speed_is_no_miss_and_not_unknown():
    require = ["onset > 900 rad/s"]
    found = random_machines("aerostatic_spindle", "bearings.*.clearance=+- 5 %", 2, "onset", require, highest=1000.0)
    assert found.data["onset"].values.tolist() == [np.inf, np.inf]
    assert found.misses(found.requirements[0])[:2] == (0, 0)
    assert found.distribution("onset")["above the highest"] == 2 and found.distribution("onset")["not known"] == 0


@pytest.mark.parametrize(
    ("above", "limit", "value", "left"), [(True, 0.0, 3.0, 3.0), (True, -2.0, -1.0, 0.5), (False, 4.0, 5.0, -0.25)]
)
def test_the_distance_of_a_limit_keeps_its_sense_at_and_below_zero(above, limit, value, left):
    assert margin(Requirement("onset", above, limit, ""), value) == pytest.approx(left, rel=1e-12)


def test_the_bounds_of_a_search_may_be_in_a_unit_with_an_offset():
    found = rs.analysis.optimise("aerostatic_spindle", {"gas.temperature": "10 degC, 30 degC"}, "-flow")
    assert float(found.data["flow"][0]) == pytest.approx(4.4e-4, rel=0.01)  # begins at the file's own 293.15 K
    assert float(found.data["gas_temperature"][0]) == pytest.approx(20.0, abs=1e-9)


def test_critical_speeds_ascend_where_modes_pass_each_other(rotor):
    """Supports of like stiffness along x and y, 20 % apart from machine to machine."""
    text = rotor.text.replace('kxx = "10 MN/m"', 'kxx = "1 MN/m"\nkyy = "1.05 MN/m"')
    vary = "bearings.*.kxx=+- 20 %, bearings.*.kyy=+- 20 %"
    swapped = random_machines(rs.machine.Machine.from_text(text), vary, 30, "criticals", ["critical_1 > 2420 rpm"],
                              highest="4000 rpm", seed=2)  # fmt: skip
    first, second = (swapped.data[f"critical_{k}"].values for k in (1, 2))
    limit = swapped.requirements[0]
    assert (first <= second).all() and swapped.misses(limit)[0] == (np.minimum(first, second) <= limit.limit).sum() > 0
    assert max(swapped.confirmed.values()) < AGREED


@pytest.mark.parametrize("name", ["aerostatic_spindle", "foil_turbo_rotor"])
def test_an_equilibrium_from_another_speed_is_that_from_ambient_pressure(name):
    """Newton's iteration ends at 1e-11 of the pressures, wherever it begins; a film that carries nothing is refused."""
    plant, pressure = rs.Plant(name), 0.5e6 if name == "aerostatic_spindle" else 0.0
    equilibria = Equilibria(plant, pressure)
    for speed in (3000.0, 4500.0, 2600.0):
        near = describe(plant.assembly, equilibria.at(speed))
        cold = plant.equilibrium(speed, pressure)
        assert near.journals == pytest.approx(cold.journals, rel=1e-9, abs=1e-14)
        assert near.h_min == pytest.approx(cold.h_min, rel=1e-9)
    with pytest.raises(NoLiftOffError):
        settle(plant.assembly, 0.0, 0.0, equilibria.w)
