"""Read data of a lab

A CSV file with the lab's own names and units becomes a record by a mapping: which column is what, in which unit. From
then on it is treated as a simulated one. `rotorsim data check run.csv --propose rig.toml` proposes a mapping.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

rng = np.random.default_rng(1)  # this stands for the lab: 2 s at 10 kHz, 45 Hz, two probes in mil
time = np.arange(20000) / 1e4
turns = 45.0 * time
rows = np.c_[time, 1.2 * np.cos(2 * np.pi * turns), 0.9 * np.sin(2 * np.pi * turns + 0.3)]
rows[:, 1:] += 0.05 * rng.normal(size=(20000, 2))
np.savetxt("lab.csv", rows, delimiter=",", header="t s,PROBE A,PROBE B", comments="", fmt="%.6f")
Path("lab.toml").write_text(
    """
[time]
column = "t s"
unit = "s"

[channels.disc_measured.x]
column = "PROBE A"
unit = "mil"

[channels.disc_measured.y]
column = "PROBE B"
unit = "mil"

[constants]
speed = "2700 rpm"
pressure = "0 MPa"
"""
)
record = rs.read("lab.csv", "lab.toml")
print(record["disc_measured"].attrs["units"], dict(record.sizes))
figure, axes = plt.subplots(figsize=(5, 5))
last = record["disc_measured"].isel(time=slice(0, 1000)) * 1e6
axes.plot(last.sel(axis="x"), last.sel(axis="y"), linewidth=0.8)
axes.set(xlabel="x [um]", ylabel="y [um]", title="Orbit from a CSV file in mil", aspect="equal")
figure.savefig("lab_data.png", dpi=100, bbox_inches="tight")
