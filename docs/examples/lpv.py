"""A parameter-varying model from records at several points

Models of six operating points become surfaces over speed and pressure; between the points the surface is held against
a record that was not fitted.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
points = [(speed, pressure) for speed in (0.0, 300.0, 600.0) for pressure in (0.4e6, 0.6e6)]


def local(speed, pressure):
    """Model of one operating point, from a record of 3 s; the runout is taken from a run without excitation."""
    steady = rs.experiments.steady(plant, speed, pressure, duration=2.0) if speed else None
    return rs.identify(rs.experiments.prbs(plant, speed, pressure, duration=3.0), model=3, steady=steady)


surface = rs.fit_lpv([local(*point) for point in points], order=1)
between = local(150.0, 0.5e6).model  # took no part
figure, axes = plt.subplots(figsize=(8, 4.5))
speeds = np.linspace(0.0, 600.0, 13)
for pressure, color in ((0.4e6, "tab:blue"), (0.5e6, "tab:green"), (0.6e6, "tab:orange")):
    frequencies = [np.sort(surface.at(speed, pressure).wn)[:2] / 2 / np.pi for speed in speeds]
    axes.plot(speeds * 30 / np.pi, frequencies, color=color)
    axes.plot([], [], color=color, label=f"{pressure / 1e6:.1f} MPa")
held = np.sort(between.wn)[:2] / 2 / np.pi
axes.plot([150 * 30 / np.pi] * 2, held, "kx", markersize=10, label="local model at 0.5 MPa, not fitted")
error = np.sort(surface.at(150.0, 0.5e6).wn)[:2] / 2 / np.pi - held
print("surface minus local model between the points [Hz]:", np.round(error, 2))
axes.set(
    xlabel="speed [rpm]", ylabel="natural frequency [Hz]", title="Natural frequencies of the LPV model", ylim=(114, 132)
)
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("lpv.png", dpi=100, bbox_inches="tight")
