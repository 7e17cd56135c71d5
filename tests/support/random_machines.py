"""Seeded machines with modes that are hard to follow: self-acting films of several forms, tables over the speed."""

from functools import lru_cache

import numpy as np

from rotorsim.machine.schema import Machine

COUNT = 200
"""Machines in all; even numbers stand on films, odd ones on tables."""
FORMS = ("plain", "lobes", "grooves", "steps", "foil")
SHAPES = ("rising", "falling", "soft at rest", "crossing", "steep", "constant")
POINTS = 6

HEAD = """
name = "random {number}"
[shaft]
start = "0 mm"
damping_ratio = {damping:.5f}
max_element_length = "{element} mm"
[shaft.material]
density = "7850 kg/m^3"
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[[shaft.sections]]
length = "{length} mm"
outer_diameter = "{diameter} mm"
[grid]
n_theta = 16
n_z = 8
[solver]
modes_per_plane = 5
time_step = "20 us"
"""
DISC = """
[[discs]]
position = "{z:.3f} mm"
mass = "{m:.6g} kg"
polar_inertia = "{ip:.6g} kg*m^2"
diametral_inertia = "{it:.6g} kg*m^2"
"""


@lru_cache(maxsize=COUNT)
def random_machine(number: int) -> tuple[Machine, float]:
    """Machine of a number below `COUNT` and its highest speed [rad/s]."""
    rng = np.random.default_rng([20_37, number])
    return _on_films(number, rng) if number % 2 == 0 else _on_tables(number, rng)


def _discs(rng: np.random.Generator, length: float, diameter: float) -> str:
    """One to three gyroscopic discs, one of them overhung now and then; lengths in mm."""
    text = ""
    for z in rng.choice(np.linspace(0, length, 9), rng.integers(1, 4), replace=False):
        radius, width = diameter * rng.uniform(0.8, 2.2) / 1000, diameter * rng.uniform(0.2, 0.6) / 1000
        mass = 7850 * np.pi * radius**2 * width
        text += DISC.format(z=z, m=mass, ip=mass * radius**2 / 2, it=mass * (3 * radius**2 + width**2) / 12)
    return text


def _on_films(number: int, rng: np.random.Generator) -> tuple[Machine, float]:
    """A rotor on two alike self-acting films of the form that belongs to the number."""
    diameter = rng.uniform(10, 30)
    length, clearance = diameter * rng.uniform(5, 9), diameter * rng.uniform(0.3, 0.7)
    form = FORMS[number // 2 % len(FORMS)]
    first, many = rng.uniform(-180, 180), rng.integers(2, 5)
    deep, on = clearance * rng.uniform(0.5, 2.5), rng.choice(["journal", "sleeve"])
    share, slant, arc = rng.uniform(0.4, 0.65), rng.uniform(20, 40), rng.uniform(20, 60)
    sleeve = {
        "plain": "",
        "lobes": f'lobes = {{ count = {many}, preload = {share:.3f}, first_angle = "{first:.1f} deg" }}',
        "grooves": f'grooves = {{ on = "{on}", depth = "{deep:.3f} um", share = {share:.3f},'
        f' angle = "{slant:.2f} deg" }}',
        "steps": f'steps = [{{ count = {many}, depth = "{deep:.3f} um", arc = "{arc:.1f} deg",'
        f' first_angle = "{first:.1f} deg" }}]',
        "foil": f'foil = {{ stiffness = "{slant / 4:.3f} GN/m^3", loss_factor = {share / 2:.2f} }}',
    }[form]
    text = HEAD.format(number=number, damping=rng.uniform(0.001, 0.01), element=round(length / 8, 3),
                       length=round(length, 3), diameter=round(diameter, 3))  # fmt: skip
    text += _discs(rng, length, diameter)
    for share in (rng.uniform(0.1, 0.25), rng.uniform(0.7, 0.9)):
        text += (
            f'\n[[bearings]]\nkind = "gas_film"\nposition = "{share * length:.3f} mm"\ndiameter = "{diameter:.3f} mm"\n'
            f'length = "{diameter * rng.uniform(0.8, 1.3):.3f} mm"\nclearance = "{clearance:.3f} um"\n'
            f'nominal_stiffness = "1 MN/m"\n{sleeve}\n'
        )
    text += '\n[effects.gravity]\nacceleration = "9.81 m/s^2"\n'
    return Machine.from_text(text), float(rng.uniform(1.5e5, 3e5) / diameter)


def _on_tables(number: int, rng: np.random.Generator) -> tuple[Machine, float]:
    """A rotor on two tables of a shape that belongs to the number, anisotropic and, now and then, cross-coupled."""
    diameter = rng.uniform(15, 40)
    length = diameter * rng.uniform(15, 30)
    top = 8e6 * diameter / length**2 * rng.uniform(0.8, 2.0)
    text = HEAD.format(number=number, damping=rng.uniform(0.001, 0.01), element=round(length / 8, 3),
                       length=round(length, 3), diameter=round(diameter, 3))  # fmt: skip
    text += _discs(rng, length, 3 * diameter)
    speeds = np.linspace(0, top, POINTS)
    k, c = 10 ** rng.uniform(5.5, 7.2), 10 ** rng.uniform(1.5, 3)
    cross = rng.uniform(0, 0.15) * (number % 4 == 1)
    shape = SHAPES[number // 2 % len(SHAPES)]
    for position in (0.0, length):
        skew, turn = rng.uniform(0.6, 1.6), rng.uniform(-1, 1)
        text += f'\n[[bearings]]\nkind = "table"\nposition = "{position:.3f} mm"\npoints = [\n'
        for x, speed in zip(np.linspace(0, 1, POINTS), speeds, strict=True):
            kx, ky = k * _shape(shape, x, turn), k * skew * _shape(shape, 1 - x if shape == "crossing" else x, turn)
            cx = c * (1.5 - x)
            text += (
                f'    {{speed = "{speed:.12g} rad/s", kxx = "{kx:.8g} N/m", kyy = "{ky:.8g} N/m", '
                f'kxy = "{cross * x * k:.8g} N/m", kyx = "{-cross * x * k:.8g} N/m", '
                f'cxx = "{cx:.6g} N*s/m", cyy = "{cx * skew:.6g} N*s/m"}},\n'
            )
        text += "]\n"
    return Machine.from_text(text), float(top)


def _shape(shape: str, x: float, turn: float) -> float:
    """Stiffness at a share x of the highest speed, over that of the bearing."""
    if shape == "constant":
        return 1.0
    if shape == "steep":  # a magnetic bearing whose gain is raised in the middle of the range
        return 0.1 if x < 0.5 else 4.0
    return {"rising": 0.4 + 2.0 * x**2, "falling": 2.0 - 1.5 * x, "soft at rest": 1e-3 + 1.5 * x ** (1.5 + turn),
            "crossing": 0.3 + 1.6 * x}[shape]  # fmt: skip
