"""Run-up of the gas bearing rig

The shipped rig runs from rest to 9000 rpm at 0.5 MPa. The amplitude of the first order (1X) against speed shows the
critical speed; `rotorsim runup` writes a report of such a run.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

rpm = 2 * np.pi / 60
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)  # a coarse film: quicker
record = rs.experiments.runup(plant, start=0.0, stop=9000 * rpm, rate=300 * rpm, pressure=0.5e6)

orders = rs.signals.track_orders(record)  # complex amplitudes [m] of 1X, 2X, 3X
peak = rs.signals.find_resonances(orders, 1, "x")[0]
print(f"largest 1X along x: {peak['um']:.1f} um at {peak['rpm']:.0f} rpm")

figure, axes = plt.subplots(figsize=(8, 4.5))
for axis in ("x", "y"):
    amplitude = abs(orders["amplitude"].sel(order=1, axis=axis))
    axes.plot(orders["speed"] / rpm, amplitude * 1e6, label=f"disc {axis}")
axes.set(xlabel="speed [rpm]", ylabel="1X amplitude, 0-pk [um]", title="Run-up of the gas bearing rig at 0.5 MPa")
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("runup.png", dpi=100, bbox_inches="tight")
