"""Pressure in the gas film

The film alone, without a rotor: a journal at 60 % of the clearance, turning at 20000 rpm, without injection. The
force follows from the pressure.
"""

import matplotlib.pyplot as plt
import numpy as np

from reynolds import GasBearing

clearance = 25e-6
bearing = GasBearing(radius=20e-3, length=40e-3, clearance=clearance, n_theta=32, n_z=16)
film = bearing.steady(journal=(0.6 * clearance, 0.0), speed=20000 * 2 * np.pi / 60)
force = np.hypot(*film.force)
print(f"film force {force:.1f} N, attitude {180 - np.degrees(np.arctan2(*film.force[::-1])) % 360:.0f} deg")

figure, axes = plt.subplots(figsize=(8, 4.5))
picture = axes.contourf(np.degrees(film.theta), film.z * 1e3, film.pressure.T / 1e3, levels=20, cmap="magma")
figure.colorbar(picture, label="absolute pressure [kPa]")
axes.set(xlabel="angle round the bearing [deg]", ylabel="z [mm]", title=f"Gas film at 20000 rpm: {force:.1f} N")
figure.savefig("film_pressure.png", dpi=100, bbox_inches="tight")
