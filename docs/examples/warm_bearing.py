"""Friction warms a bearing

A fast rotor of steel in sleeves of ceramics: the power of the films' friction grows with the square of the speed and
warms gas, journal and sleeve alike. The steel grows more than the ceramics, and a fifth of the film is
gone.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

rpm = 2 * np.pi / 60
cold = rs.load_machine("grooved_turbo_rotor").with_({"grid.n_theta": 24, "grid.n_z": 8})
heat = {"friction_share": 1.0, "journal_conductance": "0.1 W/K", "sleeve_conductance": "0.5 W/K"}
warm = cold.replace("effects.heat_balance", heat | {"sleeve_expansion": "4e-6 1/K"})
speeds = np.linspace(20_000, 150_000, 9) * rpm

figure, (rises, thickness) = plt.subplots(1, 2, figsize=(10, 4.2))
points = [rs.Plant(warm).equilibrium(speed, 0.0) for speed in speeds]
for k, (body, style) in enumerate((("gas", "o-"), ("journal", "s-"), ("sleeve", "^-"))):
    values = [point.temperature_rises[0, k] for point in points]
    print(f"{body}: {values[-1]:.1f} K warmer at 150 krpm")
    rises.plot(speeds / rpm / 1000, values, style, label=body)
for machine, name in ((cold, "without heat"), (warm, "with heat")):
    film = [rs.Plant(machine).equilibrium(speed, 0.0).h_min * 1e6 for speed in speeds]
    print(f"{name}: film {film[-1]:.2f} um at 150 krpm")
    thickness.plot(speeds / rpm / 1000, film, "o-", label=name)
rises.set(xlabel="speed [krpm]", ylabel="rise of temperature [K]")
thickness.set(xlabel="speed [krpm]", ylabel="smallest film [um]", ylim=(0, None))
for axes in (rises, thickness):
    axes.grid(alpha=0.3)
    axes.legend()
figure.savefig("warm_bearing.png", dpi=100, bbox_inches="tight")
