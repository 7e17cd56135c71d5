"""Records of programs that share no kernel with the plant: time responses of `fe_shaft`, and ROSS where it is there.

A name is right only if it is what is hidden, alone or in a tie; a second effect is a wrong name.
"""

import subprocess
import sys
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest

from fe_shaft import BearingElement, DiskElement, Material, Rotor, ShaftElement
from fe_shaft.transient import Unbalance
from identification import make_record
from rotorsim.discrepancy import diagnose
from rotorsim.machine import load_machine

BENCHMARKS = Path(__file__).parents[2] / "studies" / "benchmarks"
STEEL = Material("steel", rho=7850.0, E=210e9, Poisson=0.3)
ELEMENTS, DISC = 12, 6
K_B, C_B = 1e6, 2e3
SAMPLE, SETTLING, SECONDS = 2e-4, 1.0, 1.4
SPEEDS = {"fit": (17, 20, 22, 25, 31, 35), "held_out": (19, 23, 28, 33), "untouched": (18, 21, 29, 34)}
"""Speeds [Hz] by role, about half the first critical one of 40 Hz."""


def machine():
    """The plain rotor on softer bearings, which alone damp it."""
    values = {f"bearings.{i}.{key}": value for i in (0, 1) for key, value in (("kxx", K_B), ("cxx", C_B))}
    return load_machine("plain_rotor").with_({**values, "shaft.damping_ratio": 0.0})


def rotor():
    shaft = [ShaftElement(0.6 / ELEMENTS, 0.0, 0.02, material=STEEL) for _ in range(ELEMENTS)]
    disc = DiskElement(n=DISC, m=3.946, Id=0.006519, Ip=0.012627)
    return Rotor(shaft, [disc], [BearingElement(n, kxx=K_B, cxx=C_B) for n in (0, ELEMENTS)])


def bow(one, angle):
    """Force (n, dof) [N] of a bow of 5 um at 63 deg: the shaft's own stiffness, less the bearings'."""
    held = one.K().copy()
    for n in (0, ELEMENTS):
        held[4 * n, 4 * n] -= K_B
        held[4 * n + 1, 4 * n + 1] -= K_B
    z = np.arange(ELEMENTS + 1) / ELEMENTS
    u, slope = 5e-6 * np.sin(np.pi * z), 5e-6 * np.pi / 0.6 * np.cos(np.pi * z)
    q = np.zeros((one.K().shape[0], 2))
    q[0::4, 0], q[3::4, 0], q[1::4, 1], q[2::4, 1] = u, slope, u, -slope
    turned = angle + np.radians(63)
    return np.column_stack([np.cos(turned), np.sin(turned)]) @ (held @ q).T


def coupling(one, angle):
    """Force (n, dof) [N] of 20 N at 2X, turning forward, at the left end."""
    F = np.zeros((len(angle), one.K().shape[0]))
    F[:, 0], F[:, 1] = 20 * np.cos(2 * angle + 0.5), 20 * np.sin(2 * angle + 0.5)
    return F


def nothing(one, angle):
    return np.zeros((len(angle), one.K().shape[0]))


def records(force, planes=()):
    """Steady records with the weight and unbalances (node, magnitude, phase); one is made twice."""
    one, rng, found = rotor(), np.random.default_rng(5), []
    n, skipped = round(SECONDS / SAMPLE), round(SETTLING / SAMPLE)
    t = np.arange(n + skipped) * SAMPLE
    plan = [(role, hertz) for role, own in SPEEDS.items() for hertz in own]
    unbalance = [Unbalance(DISC, 25e-6), *(Unbalance(*plane) for plane in planes)]
    for i, (role, hertz) in enumerate([*plan, ("fit", 22)]):
        speed = 2 * np.pi * hertz
        angle = speed * t
        y = one.run_time_response(speed, force(one, angle), t, unbalance=unbalance, gravity=9.81).yout
        y = y[skipped:, 4 * DISC : 4 * DISC + 2] + rng.normal(0, 1e-7, (n, 2))
        values = {"disc_measured": y, "angle_measured": angle[skipped:], "speed_measured": np.full(n, speed)}
        found.append(make_record(t[:n], values, {"role": role, "record": f"{role} {i}"}))
    return found


def proposed(found):
    """Sets of effects that a diagnosis proposes, those that no record distinguishes included."""
    alike = [{key.split(".")[0]} for f in found.effects for key in f.tie_class] if len(found.effects) == 1 else []
    return [{f.effect for f in found.effects}, *alike, *({k.split(".")[0] for k in keys} for keys in found.ties)]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("force", "hidden"), [(bow, "shaft_bow"), (coupling, "coupling")], ids=lambda v: getattr(v, "__name__", v)
)
def test_what_fe_shaft_shakes_the_rotor_with_is_named_and_nothing_else(force, hidden):
    found = diagnose(machine(), records(force))
    assert found.status in ("named", "tie")
    assert {hidden} in proposed(found) and len(found.effects) == 1


@pytest.mark.nightly
@pytest.mark.parametrize("planes", [(), ((3, 20e-6, 1.9),)], ids=["one plane", "two planes"])
def test_a_rotor_of_fe_shaft_in_which_nothing_is_missing_gets_no_name(planes):
    """A second plane of unbalance moves the disc as one at the disc does."""
    assert diagnose(machine(), records(nothing, planes)).status in ("no_disagreement", "unknown")


@pytest.mark.slow
def test_the_time_response_and_the_plant_agree_before_anything_is_fitted():
    """The same rotor in two programs: unbalance at 25 Hz to 0.5 % of the amplitude."""
    from rotorsim.plant import Plant

    speed = 2 * np.pi * 25
    t = np.arange(10000) * SAMPLE
    mine = rotor().run_time_response(speed, None, t, unbalance=[Unbalance(DISC, 25e-6)]).yout[5000:, 4 * DISC]
    rows = np.zeros((10000, 6))
    rows[:, 0] = speed
    run = Plant(machine().with_({"effects.gravity.acceleration": 0.0})).start(speed)
    theirs = run.advance(rows)[5000:, 0]
    size = [np.sqrt(2) * np.std(x) for x in (mine, theirs)]
    assert size[1] == pytest.approx(size[0], rel=5e-3)


ROSS_CASES = ("bow_2", "bow_8", "coupling_parallel_100", "coupling_angular_5", "crack_15", "rub_100")


def script(name):
    spec = spec_from_file_location(name, BENCHMARKS / f"{name}.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.nightly
@pytest.mark.skipif(find_spec("ross") is None, reason="needs ROSS: pip install rotorsim[benchmarks]")
@pytest.mark.parametrize(
    "case", ["bow_2", "bow_8", "coupling_parallel_100", "coupling_angular_5", "crack_15", "rub_100"]
)
def test_records_of_ross_get_no_wrong_name(case, tmp_path):
    judge = script("diagnose_ross")
    subprocess.run([sys.executable, str(BENCHMARKS / "ross_records.py"), str(tmp_path), case], check=True, timeout=3000)
    own = {role: sorted((tmp_path / case).glob(f"{role}_*.csv")) for role in ("fit", "held_out", "untouched")}
    found = diagnose(judge.machine(case), own["fit"], own["held_out"], own["untouched"])
    assert judge.verdict(judge.truth(case), found) != "wrong"
