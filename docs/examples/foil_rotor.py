"""A turbo rotor on bump foil bearings

The foils give way under the film and their friction damps the rotor. The faster it turns, the more the pressure bends
them out of the shape that the shims give the sleeves, and from about 18,400 rpm on the light rotor whirls. Rigid
sleeves of the same shape stand next to it.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

rpm = 2 * np.pi / 60
foils = rs.load_machine("foil_turbo_rotor").with_({"grid.n_theta": 24, "grid.n_z": 12})
rigid = foils.with_({"bearings.0.foil": None, "bearings.1.foil": None})
speeds = np.linspace(6000, 28_000, 12) * rpm

figure, (damping, thickness) = plt.subplots(1, 2, figsize=(10, 4.2))
for machine, name in ((foils, "bump foils"), (rigid, "rigid sleeves")):
    plant = rs.Plant(machine)
    least = [float(plant.linearise(speed, 0.0).zeta.min()) for speed in speeds]
    film = [plant.equilibrium(speed, 0.0).h_min * 1e6 for speed in speeds]
    print(
        f"{name}: least damping ratio {min(least):.3f}, film {film[0]:.1f} um at 6000 rpm, {film[-1]:.1f} um at 28000"
    )
    damping.plot(speeds / rpm / 1000, least, "o-", label=name)
    thickness.plot(speeds / rpm / 1000, film, "o-", label=name)
damping.axhline(0.0, color="k", linewidth=0.8)
damping.set(xlabel="speed [krpm]", ylabel="least damping ratio")
thickness.set(xlabel="speed [krpm]", ylabel="smallest film [um]", ylim=(0, None))
for axes in (damping, thickness):
    axes.grid(alpha=0.3)
    axes.legend()
figure.savefig("foil_rotor.png", dpi=100, bbox_inches="tight")
