"""Your own physical effect

A belt pulls at the disc, once a turn a little more. The effect is a class of parameters and one compiled kernel;
nothing in the package is edited.
"""

import math

import matplotlib.pyplot as plt

import rotorsim as rs
from reynolds.jit import inlined
from rotorsim.effects import Effect, param, register


@inlined
def belt(t, angle, speed, acceleration, p):
    """Force (fx, fy) [N] at shaft angle `angle` [rad]."""
    return 0.0, p.tension * (1.0 + p.ripple * math.cos(angle))


@register
class Belt(Effect):
    """Belt that pulls the disc upwards, with a seam that comes round once a turn."""

    port, kernel = "force", belt
    tension: float = param("N", bounds=(0.0, 1e4), doc="Mean pull.")
    ripple: float = param("1", bounds=(0.0, 1.0), doc="Part that changes once a turn.")


without = rs.load_machine("plain_rotor").replace("shaft.damping_ratio", 0.02)
with_belt = without.replace("effects.belt.tension", "20 N").replace("effects.belt.ripple", 0.1)

figure, axes = plt.subplots(figsize=(5, 5))
for machine, label in ((without, "without belt"), (with_belt, "with belt")):
    record = rs.Plant(machine).simulate(3.0, speed=250.0, pressure=0.0)
    last = record["disc"].isel(time=slice(-126, None)) * 1e6  # one turn
    print(f"{label}: mean height {float(last.sel(axis='y').mean()):.1f} um")
    axes.plot(last.sel(axis="x"), last.sel(axis="y") - last.sel(axis="y").mean(), label=label)
axes.set(xlabel="x [um]", ylabel="y about its mean [um]", title="Orbit of the disc at 2387 rpm", aspect="equal")
axes.legend()
figure.savefig("own_effect.png", dpi=100, bbox_inches="tight")
