"""A measured run-up and the simulated one

1X of a rotor kit, measured by others with one probe in a sweep of 229 rpm/s, and a slow run-up of the shipped machine
file of that kit. The fast sweep beats behind its peak; the peak itself lies where the model has it. What the rest of
the gap is, `diagnose` finds out: see the example of a measured run-up, diagnosed.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

data = next((folder / "rk4" for folder in Path(__file__).resolve().parents if (folder / "rk4").exists()), None)
if data is None:
    raise SystemExit("no folder rk4 with runup.csv here or above: the page of this example has them")
rpm, amplitude = np.loadtxt(data / "runup.csv", delimiter=",", skiprows=1, usecols=(0, 3)).T  # um, 0-pk, of one probe

plant = rs.Plant("bently_rk4")
record = rs.experiments.runup(plant, start=1000 * np.pi / 30, stop=2650 * np.pi / 30, rate=6.0, pressure=0.0)
orders = rs.signals.track_orders(record)
simulated = abs(orders["amplitude"].sel(order=1)).max("axis") * 1e6
highest = float(orders["speed"][int(simulated.values.argmax())]) * 30 / np.pi
print(f"measured peak at {rpm[amplitude.argmax()]:.0f} rpm, simulated at {highest:.0f} rpm")

figure, axes = plt.subplots(figsize=(8, 4.5))
axes.plot(rpm, amplitude, ".", label="measured, one probe, 229 rpm/s")
axes.plot(orders["speed"] * 30 / np.pi, simulated, label="machine file bently_rk4, larger axis, 57 rpm/s")
axes.set(
    xlabel="speed [rpm]", ylabel="1X amplitude, 0-pk [um]", title="Run-up of a rotor kit with two discs", ylim=(0, 140)
)
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("measured_runup.png", dpi=100, bbox_inches="tight")
