"""A map of the operating range

Damping ratio of the least damped mode over speed and supply pressure, from linear models alone: no time simulation.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

rpm = 2 * np.pi / 60
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
speeds, pressures = np.linspace(0.0, 9000 * rpm, 7), np.linspace(0.3e6, 0.7e6, 5)
found = rs.analysis.operating_map(plant, speeds, pressures)
least = found["zeta"].min("mode").transpose("pressure", "speed")
print(f"damping ratio from {float(least.min()):.3f} to {float(least.max()):.3f}")

figure, axes = plt.subplots(figsize=(8, 4.5))
picture = axes.contourf(speeds / rpm, pressures / 1e6, least, levels=12, cmap="viridis")
figure.colorbar(picture, label="least damping ratio [1]")
axes.set(xlabel="speed [rpm]", ylabel="supply pressure, gauge [MPa]", title="Damping of the gas bearing rig")
figure.savefig("operating_map.png", dpi=100, bbox_inches="tight")
