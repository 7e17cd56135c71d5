"""Controller designs on the rig's identified model: stable sampled loops, specified damping, refusals."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from refusals import refused
from rotorsim.base.quantity import quantities
from rotorsim.base.rounding import DECAYS
from rotorsim.base.units import KRPM, RIG_SAMPLE
from rotorsim.control import DesignError
from rotorsim.control.catalogue import DESIGNS, make_spec, module_of
from rotorsim.control.designs import h2_scheduled, hinf, lead, lpv, lqr, mpc, p, placement, youla
from rotorsim.control.designs.h2_scheduled import held_out
from rotorsim.control.law_from_system import biased, without_dc
from rotorsim.control.plants import sampled_plant
from rotorsim.control.sampled_loop import (  # fmt: skip
    closed_poles,
    law_system,
    loop_of,
    model_loop,
    root_locus,
    smallest_damping,
    sweep,
)
from rotorsim.control.systems import response
from studies.thesis.claims.control_numbers import stable_gains

pytestmark = pytest.mark.numerical

POINT = (0.0, 0.5e6)
SPEEDS, PRESSURES = np.linspace(0, 6 * KRPM, 40), np.linspace(0.3e6, 0.7e6, 15)


def open_damping(model, speed, pressure):
    return smallest_damping(np.linalg.eigvals(sampled_plant(model, speed, pressure).A), RIG_SAMPLE)


def closed_damping(law, model, speed, pressure):
    return smallest_damping(
        closed_poles(sampled_plant(model, speed, pressure), law_system(law, speed, pressure)), RIG_SAMPLE
    )


@pytest.mark.parametrize("design", [p.design, lqr.design, hinf.design, lead.design])
def test_no_point_of_a_fine_grid_is_unstable(model, design):
    assert sweep(design(model), model, SPEEDS[::4], PRESSURES[::3]).unstable == 0


def test_the_published_p_gains_raise_the_smallest_damping_fivefold_and_the_other_sign_destabilises(model):
    law = p.design(model)
    for q in (POINT, (3 * KRPM, 0.5e6), (6 * KRPM, 0.7e6)):
        assert closed_damping(law, model, *q) > 5 * open_damping(model, *q)
    with pytest.raises(DesignError, match=r"unstable at 0 rpm, 0\.5 MPa"):
        p.design(model, p.Spec(kappa_x=-1.125, kappa_y=-0.99))


def test_the_root_locus_starts_at_the_open_loop_and_bounds_the_gain(model):
    plant, K = sampled_plant(model, *POINT), law_system(p.design(model), *POINT)
    rows = root_locus(plant, K, np.linspace(0, 1.2, 7))
    np.testing.assert_allclose(
        np.sort(np.abs(rows[0]))[-4:], np.sort(np.abs(np.linalg.eigvals(plant.A)))[-4:], rtol=1e-9
    )
    low, high = stable_gains(plant, K, np.linspace(-1, 2, 301))
    assert -0.3 < low < 0 < 1 < high < 1.3


def test_placement_halves_the_imaginary_parts(model):
    spec = placement.Spec()
    law = placement.design(model, spec)
    plant = sampled_plant(model, spec.speed, spec.pressure)
    poles = np.linalg.eigvals(plant.A)
    found = closed_poles(plant, law_system(law, spec.speed, spec.pressure))
    for wanted in placement.target(poles, 0.5, 0.3)[np.abs(poles) > 0.1]:
        assert np.abs(found - wanted).min() < 1e-5
    assert closed_damping(law, model, spec.speed, spec.pressure) > 3 * open_damping(model, spec.speed, spec.pressure)


def bode_integral(plant, controller, points=20000):
    r"""Both sides of Bode's integral of a sampled loop, whose plant is late by a sample.

    .. math:: \frac{1}{\pi} \int_0^\pi \ln |\det S_o| \, d\omega = \sum_k \ln |p_k|

    over the poles p_k of G and K outside the unit circle (Sung and Hara 1988).
    """
    w = (np.arange(points) + 0.5) * np.pi / points
    z = np.exp(1j * w)
    difference = np.eye(2) - response(plant, z) @ response(controller, z)
    left = -float(np.mean(np.log(np.abs(np.linalg.det(difference)))))
    poles = np.concatenate([np.linalg.eigvals(plant.A), np.linalg.eigvals(controller.A)])
    right = float(np.log(np.abs(poles[np.abs(poles) > 2 - DECAYS])).sum())
    return left, right


def test_bodes_integral_holds_for_a_sampled_loop(model):
    plant = sampled_plant(model, *POINT)
    for law in (lqr.design(model), hinf.design(model)):
        left, right = bode_integral(plant, law_system(law, *POINT))
        assert left == pytest.approx(right, abs=2e-3)


def test_the_disk_margin_is_met_by_gain_and_phase(model):
    law = lqr.design(model)
    loop = model_loop(law, model, *POINT)
    plant, K = sampled_plant(model, *POINT), law_system(law, *POINT)
    for factor in (loop.gain_margin, 1 / loop.gain_margin):
        scaled = (
            K._replace(C=0.999 * factor * K.C, D=0.999 * factor * K.D)
            if factor > 1
            else K._replace(C=K.C * factor, D=K.D * factor)
        )
        assert np.abs(closed_poles(plant, scaled)).max() < 1
    assert loop.peak >= 1


def test_tustin_refuses_poles_beyond_its_reach(model):
    with pytest.raises(DesignError, match=r"fastest pole.*exceeds 10/Ts"):
        p.design(model, p.Spec(low_pass=1e5))
    with refused(DesignError, "p.Ts", 0.0):
        p.design(model, p.Spec(Ts=0.0))


def test_a_law_without_dc_has_no_gain_at_rest_and_keeps_its_damping(model):
    law = p.design(model, p.Spec(kappa_x=0.375, kappa_y=0.33))
    quiet = without_dc(law, 5.0)
    low, at = (
        loop_of(sampled_plant(model, *POINT), law_system(quiet, *POINT), RIG_SAMPLE, np.array([f])) for f in (0.01, 119)
    )
    assert np.abs(low.K).max() < 3e-3 * np.abs(at.K).max()
    assert closed_damping(quiet, model, *POINT) > 0.8 * closed_damping(law, model, *POINT)


def test_a_biased_law_asks_for_its_bias_at_the_centre(model):
    law = biased(p.design(model), (0.5, -0.25)).with_(average=0.0, fade=0.0)
    law.reset()
    np.testing.assert_allclose(law.step([0.0, 0.0], 0.0, 5e5), (0.5, -0.25))


@pytest.fixture(scope="module")
def scheduled(model):
    return h2_scheduled.design(model)


def test_the_interpolated_h2_law_keeps_the_notch_between_its_designs_and_youla_does_not(model, scheduled):
    spec = youla.Spec()
    q = spec.speed, spec.pressure
    laws = {"interpolated": scheduled, "local": h2_scheduled.local(model, *q), "youla": youla.design(model, spec)}
    at = {name: h2_scheduled.imbalance_response(model, law_system(law, *q), *q) for name, law in laws.items()}
    assert at["interpolated"] <= 1.1 * at["local"]
    assert at["youla"] >= 1.5 * at["interpolated"]
    assert at["local"] < 0.1 * h2_scheduled.imbalance_response(model, None, *q)


def test_the_interpolated_h2_law_is_stable_on_the_fine_grid_and_was_measured_on_held_out_designs(scheduled, model):
    speeds = np.linspace(KRPM, 6 * KRPM, 40)
    assert sweep(scheduled, model, speeds, PRESSURES).unstable == 0
    assert (scheduled.about["designs"], scheduled.about["held_out"]) == (100, int(held_out(10, 10).sum()))
    assert scheduled.order == 16


def test_an_order_of_interpolation_that_fails_the_gate_is_refused(model):
    with refused(DesignError, "orders", (0,)):
        h2_scheduled.design(model, h2_scheduled.Spec(orders=(0,), fine=(8, 5)))


def test_a_point_outside_the_models_range_is_refused(model):
    for module, spec in ((hinf, hinf.Spec(speed=9 * KRPM)), (lqr, lqr.Spec(pressure=0.9e6))):
        with pytest.raises(DesignError, match="lies outside the 0 to 6000 rpm"):
            module.design(model, spec)


def test_a_model_of_one_point_has_no_schedule(model):
    with pytest.raises(DesignError, match="holds for one operating point"):
        h2_scheduled.design(model.at(300.0, 5e5))


@pytest.mark.parametrize(("name", "word"), [("B", "uncontrollable"), ("C", "unobservable")])
def test_a_mode_that_cannot_be_moved_or_seen_is_named(model, name, word):
    """Motion along y decoupled from x, and then neither driven nor measured."""
    from dataclasses import replace

    one = replace(model.at(0.0, 5e5), speed=float("nan"))
    A, B, C = one.A.copy(), one.B.copy(), one.C.copy()
    A[2, [1, 3, 5]] = A[3, [0, 2, 4]] = 0.0
    if name == "B":
        A[3, 5] = 0.0
    else:
        C[1] = C[0]
    with pytest.raises(DesignError, match=f"Hz is {word}"):
        lqr.design(replace(one, A=A, B=B, C=C))


@pytest.mark.parametrize("name", ["y", "u", "force", "noise"])
def test_a_weight_that_is_not_positive_is_refused_with_its_meaning(name):
    with refused(DesignError, f"lqr.{name}", 0.0):
        lqr.Spec(**{name: 0.0})


@pytest.mark.parametrize("given", [[-0.1, -0.2], np.array([-0.1, -0.2]), (-0.1, -0.2)])
def test_values_by_axis_may_be_a_list_or_an_array_and_are_kept_as_a_tuple(given):
    spec = lead.Spec(kappa=given)
    assert spec.kappa == (-0.1, -0.2) and type(spec.kappa) is tuple
    assert all(type(value) is float for value in spec.kappa)
    assert type(hash(spec)) is int


@pytest.mark.parametrize(
    ("make", "values", "sentence"),
    [
        (lead.Spec, {"kappa": (-0.1,)}, r"lead\.kappa: .* is not 2 values; write e\.g\. \(-0\.132, -0\.09\)"),
        (lead.Spec, {"kappa": -0.1}, r"lead\.kappa: -0\.1 is not 2 values"),
        (lead.Spec, {"kappa": "12"}, r"lead\.kappa: '12' is not 2 values"),
        (lead.Spec, {"kappa": np.array(-0.1)}, r"lead\.kappa: .* is not 2 values"),
        (lead.Spec, {"kappa": [-0.1, "x"]}, r"lead\.kappa: 'x' is not "),
        (lpv.Spec, {"grid": (8,)}, r"lpv\.grid: \(8,\) is not 2 values; write e\.g\. \(8, 8\)"),
        (lpv.Spec, {"refresh": 0.0}, r"lpv\.refresh: .* must be above 0"),
        (h2_scheduled.Spec, {"orders": ()}, r"h2_scheduled\.orders: \(\) is not one or more values"),
        (h2_scheduled.Spec, {"refresh": -0.01}, r"h2_scheduled\.refresh: .* must be above 0"),
        (lqr.Spec, {"speed": -1.0}, r"lqr\.speed: .* is below the limit; write at least '0 "),
        (h2_scheduled.Spec, {"slowest": -1.0}, r"h2_scheduled\.slowest: .* is below the limit"),
    ],
)
def test_a_specification_is_refused_when_it_is_made(make, values, sentence):
    with pytest.raises(DesignError, match=f"^{sentence}"):
        make(**values)


def test_every_number_of_a_specification_is_declared():
    for name in DESIGNS:
        spec = module_of(name).Spec()
        for one in (spec, getattr(spec, "weights", spec)):
            loose = [f.name for f in fields(one) if f.name not in quantities(one)]
            assert all(isinstance(getattr(one, f), bool) or is_dataclass(getattr(one, f)) for f in loose)


def test_the_documentation_of_a_specification_states_the_unit_of_every_number():
    for spec in (*(module_of(name).Spec for name in DESIGNS), mpc.Spec, hinf.Weights, h2_scheduled.H2Weights):
        for name, quantity in quantities(spec).items():
            entry = spec.__doc__.partition(f"\n{name} : ")[2].split("\n")
            assert entry[1].startswith("    ") and entry[1].endswith(f"[{quantity.unit}]."), (spec, name)
    assert "film : float, default 5\n    Least film thickness [um]." in mpc.Spec.__doc__


def test_every_design_has_a_name_and_text_changes_its_specification():
    for name in DESIGNS:
        assert module_of(name).Spec() == make_spec(name)
    spec = make_spec("hinf", ["speed=4000 rpm", "pressure=0.4 MPa", "weights.k_0=0.7", "order=auto"])
    assert spec.speed == pytest.approx(4 * KRPM)
    assert (spec.pressure, spec.weights.k_0, spec.order) == (0.4e6, 0.7, None)
    assert make_spec("lpv", ["grid=4x3"]).grid == (4, 3)
    for text, word in (
        ("k_0=1", "no field"),
        ("speed", "is not FIELD=VALUE"),
        ("backoff=x", "'x' is not a number; write e.g. 1.02"),
    ):
        with pytest.raises(DesignError, match=word):
            make_spec("hinf", [text])
    with pytest.raises(DesignError, match="did you mean 'hinf'"):
        module_of("hinv")
