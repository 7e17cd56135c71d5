"""Machines whose films have lobes, steps, grooves or foils: equilibrium, linear model and time steps agree."""

import re

import numpy as np
import pytest
from scipy.linalg import expm, matrix_balance

from random_machines import random_machine
from rotorsim.base.errors import MachineFileError, NoLiftOffError
from rotorsim.machine import Machine, machine_text as load_text
from rotorsim.plant import Plant

FORMS = {
    "foil": 'foil = { stiffness = "5 GN/m^3", loss_factor = 0.3 }',
    "strips": 'foil = { bumps = "strips", stiffness = "5 GN/m^3", loss_factor = 0.3 }',
    "foil without loss": 'foil = { stiffness = "5 GN/m^3" }',
    "grooves": 'grooves = { on = "journal", depth = "20 um", share = 0.5, angle = "28 deg" }',
    "steps": 'steps = [{ count = 3, depth = "10 um", arc = "45 deg" }]',
    "lobes": "lobes = { count = 3, preload = 0.5 }",
    "fed foil": 'foil = { stiffness = "20 GN/m^3", loss_factor = 0.3 }\n'
                'orifices = [{ count = 8, diameter = "0.2 mm", offset = "5 mm" }]',
    "fed strips": 'foil = { bumps = "strips", stiffness = "10 GN/m^3", loss_factor = 0.3 }\n'
                  'orifices = [{ count = 8, diameter = "0.2 mm" }]',
}  # fmt: skip


GROOVES = '[bearings.grooves]\non = "sleeve"\ndepth = "9 um"\nshare = 0.5\nangle = "28 deg"'


def machine(*forms, extra=""):
    films = [
        f'[[bearings]]\nkind = "gas_film"\nposition = "{z} mm"\ndiameter = "40 mm"\nlength = "40 mm"\n'
        f'clearance = "20 um"\n{form}\n'
        for z, form in zip((40, 160), forms, strict=True)
    ]
    return Machine.from_text(f"""
name = "formed"
[shaft]
max_element_length = "40 mm"
[shaft.material]
density = "7850 kg/m^3"
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[[shaft.sections]]
length = "200 mm"
outer_diameter = "40 mm"
{"".join(films)}
[grid]
n_theta = 16
n_z = 8
[solver]
modes_per_plane = 3
tolerance = 1e-11
time_step = "10 us"
[effects.gravity]
acceleration = "9.81 m/s^2"
{extra}
""")


@pytest.mark.parametrize(
    "names",
    [
        ("foil", "steps"),
        ("lobes", "grooves"),
        ("strips", "steps"),
        ("fed strips", "fed strips"),
        *(pytest.param((n, n), marks=pytest.mark.slow) for n in FORMS),
    ],
)
def test_the_linear_model_is_the_plant_for_small_motion(names):
    """A push of 10 mN on the plant, of 0.1 N on stiffer fed films, against exp(A t) of its linear model over 8 ms.

    Steps of 5 us: fed strips are .41 % off at 10 us, .91 % at 50 us, 1.7 % at .1 ms, whatever the push.
    """
    plant = Plant(machine(*(FORMS[name] for name in names)), dt=5e-6)
    speed, samples, supply = 2000.0, 40, 0.3e6 if "fed" in names[0] else 0.0
    push = np.zeros((samples, 2))
    push[:5, 0] = 0.1 if supply else 0.01
    run = plant.simulate(samples * 2e-4, speed, supply, disc_force=push)
    moved = run["disc"].values - run["disc"].values[0]
    linear = plant.linearise(speed, supply)
    A, B, H, steps = linear.A, linear.B, linear.H, np.zeros((samples, 2))
    n = len(A)
    # states of 1e10 Pa^2 and 1e-6 m: without balance the exponential loses its digits
    even, (scale, _) = matrix_balance(np.block([[A, B], [np.zeros((5, n + 5))]]) * 2e-4, permute=False, separate=True)
    both = expm(even) * scale[:, None] / scale
    state = np.zeros(n)
    for k in range(samples):
        steps[k] = H @ state
        state = both[:n, :n] @ state + both[:n, n:] @ np.r_[0.0, 0.0, push[k], 0.0]
    np.testing.assert_allclose(moved, steps, atol=4e-3 * np.abs(steps).max())


def test_strips_carry_a_rotor_beyond_the_clearance():
    """An equilibrium under 149 N on each film, which a run keeps."""
    wheel = 'position = "100 mm"\nmass = "28.4 kg"\npolar_inertia = "0.1 kg*m^2"\ndiametral_inertia = "0.1 kg*m^2"'
    heavy = f"[[discs]]\n{wheel}"
    plant = Plant(machine(FORMS["strips"], FORMS["strips"], extra=heavy))
    rest = plant.equilibrium(4000.0, 0.0)
    assert np.hypot(*rest.journals.T).min() > 20e-6
    assert rest.h_min > 0
    run = plant.simulate(2e-3, 4000.0, 0.0)
    np.testing.assert_allclose(run["disc"].values[-1], run["disc"].values[0], atol=1e-9)


def test_films_of_different_forms_stand_on_one_rotor():
    plant = Plant(machine(FORMS["foil"], FORMS["steps"]))
    rest = plant.equilibrium(2000.0, 0.0)
    np.testing.assert_allclose(rest.forces.sum(axis=0), (0.0, plant.machine.mass * 9.81), atol=0.02)
    assert rest.journals[0] != pytest.approx(rest.journals[1], rel=1e-3)


def test_effects_on_the_gap_add_to_the_form_of_the_sleeve():
    """The sleeve's lobes as an effect: out of round by two lobes of 2 um is the static form with an ovality on it."""
    extra = '[effects.out_of_round]\nbearing = 0\nsleeve = "2 um"\n'
    forms = FORMS["lobes"], FORMS["grooves"]
    plain = Plant(machine(*forms)).equilibrium(2000.0, 0.0)
    oval = Plant(machine(*forms, extra=extra)).equilibrium(2000.0, 0.0)
    assert abs(oval.journals[0] - plain.journals[0]).max() > 1e-8
    nothing = Plant(machine(*forms, extra=extra.replace("2 um", "0 um")))
    np.testing.assert_array_equal(nothing.equilibrium(2000.0, 0.0).journals, plain.journals)


@pytest.mark.parametrize(
    ("form", "message"),
    {
        f'{FORMS["grooves"]}\norifices = [{{ count = 4, diameter = "0.2 mm" }}]':
            "bearings.0.grooves: orifices and injectors need a land of '0.2 mm'",
        f'{FORMS["foil"]}\norifices = [{{ count = 4, diameter = "0.2 mm", pocket_diameter = "2 mm" }}]':
            "bearings.0.orifices.0.pocket_diameter: '2 mm' is cut into a sleeve, not into a foil; remove it",
        'grooves = { on = "sleeve", depth = "9 um", share = 0.5, angle = "28 deg", land = "50 mm" }':
            "bearings.0.grooves.land: '50 mm' leaves no grooves in a film of '40 mm'",
        'steps = [{ count = 8, depth = "9 um", arc = "60 deg" }]': "leaves no land between 8 pockets",
        'grooves = { on = "sleeve", pattern = "spiral", depth = "9 um", share = 0.5, angle = "28 deg", land = "5 mm" }':
            "goes with a herringbone; remove it",
        'foil = { stiffness = "5 MN/m" }': "is not a stiffness per area or cubic stiffness; write e.g. '4.7 GN/m^3'",
        "lobes = { count = 3, preload = 1.5 }": "preload: 1.5",
    }.items(),
)  # fmt: skip
def test_forms_that_do_not_fit_are_refused_in_a_sentence(form, message):
    with pytest.raises(MachineFileError, match=re.escape(message)):
        machine(form, "")


def test_a_foil_softer_than_its_load_is_refused_with_the_stiffness_that_it_needs():
    soft = 'foil = { stiffness = "50 MN/m^3" }'  # 19.4 N on it over 40 x 40 mm bend it by 240 um
    with pytest.raises(NoLiftOffError, match=r"the load bends the foil by '?0?\.?\d+ .?m'?; give a foil well above '"):
        Plant(machine(soft, FORMS["steps"])).equilibrium(2000.0, 0.0)


@pytest.mark.parametrize(
    ("forms", "argument", "inwards"),
    [
        ((FORMS["foil"], FORMS["strips"]), "foils", False),
        (('orifices = [{ count = 4, diameter = "1 mm", offset = "19.4 mm" }]', ""), "injectors", True),
    ],
)
def test_what_films_cannot_be_built_of_is_refused_with_its_own_way_out(forms, argument, inwards):
    """Foils of two kinds had the sentence and the way out of an orifice too near to the edge."""
    with pytest.raises(MachineFileError) as caught:
        Plant(machine(*forms)).assembly  # noqa: B018
    assert caught.value.argument == argument and str(caught.value).startswith(f"{argument}: ")
    assert ("inwards" in str(caught.value)) == inwards


def test_all_faults_of_a_machine_file_are_told_in_one_go():
    text = load_text("aerostatic_spindle").replace('position = "190 mm"', 'position = "50 mm"')
    text = text.replace('name = "front"', 'name = "rear"').replace('offset = "10 mm"', 'offset = "25 mm"', 1)
    text = text.replace("[[bearings.orifices]]", f"{GROOVES}\n[[bearings.orifices]]", 1)
    text += '[[bearings]]\nkind = "table"\nposition = "120 mm"\n' + "".join(
        f'[[bearings.points]]\nspeed = "{rpm} rpm"\nkxx = "1 MN/m"\ncxx = "{c} N*s/m"\n' for rpm, c in ((0, 1), (9, -1))
    )
    text = text.replace('viscosity = "18.5 uPa*s"', 'viscosity = "0 Pa*s"')
    text += '[[injectors]]\nangle = "0 deg"\nreference = "+x"\n'
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(text)
    for fault in (
        "bearings.1.position: '50 mm' is where bearings.0 is; move one",
        "bearings.1.name: 'rear' is the name of bearings.0 too",
        "bearings.0.orifices.1.offset: '25 mm' puts the orifice outside the film; write at most '19.9 mm'",
        "bearings.0.grooves: orifices and injectors need a land",
        "bearings.2.points.1.cxx: '-1 N*s/m' is below the limit",
        "gas.viscosity: '0 Pa*s' must be above 0",
        "injection: missing, but there are injectors",
    ):
        assert fault in str(caught.value)


@pytest.mark.slow
def test_close_behind_a_fold_the_rotor_is_carried_where_it_comes_to_rest_next():
    """Two lobes whose load lies between them: a place of rest ceases to exist at a speed, and the next one carries."""
    plant = Plant(random_machine(52)[0])
    low, high = 377.0, 398.0
    behind = plant.equilibrium(high, 0.0)
    weight = behind.forces.sum(axis=0)

    def journal(speed):
        return plant.equilibrium(speed, 0.0).journals[1, 0]

    before = journal(low)
    assert behind.journals[1, 0] - before > 3e-6
    while high - low > 2e-10 * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if journal(middle) > 1.9e-5 else (middle, high)
    for part in (0.0, 1e-9, 1e-8, 1e-7, 3e-7, 5e-7, 1e-6):
        found = plant.equilibrium(high * (1 + part), 0.0)
        assert found.journals[1, 0] == pytest.approx(behind.journals[1, 0], rel=0.05)
        assert found.forces.sum(axis=0) == pytest.approx(weight, abs=1e-3)
