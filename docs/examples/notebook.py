"""A notebook

The lines `# %%` make this script a notebook in Jupyter (by jupytext), VS Code and Spyder: each part is a cell, and
what stands last in a cell is shown.
"""

# %% Load a machine and look at it
import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

machine = rs.load_machine("plain_rotor")
machine

# %% Its natural frequencies at two speeds [Hz]
plant = rs.Plant(machine)
{rpm: np.round(plant.linearise(rpm * np.pi / 30, 0.0).wn[:4] / 2 / np.pi, 1) for rpm in (0, 6000)}

# %% A record is an xarray.Dataset
record = rs.experiments.runup(plant, start=0.0, stop=500.0, rate=100.0, pressure=0.0)
record

# %% Which xarray can draw
figure, axes = plt.subplots(figsize=(8, 4))
(record["disc"] * 1e6).plot.line(ax=axes, x="time", linewidth=0.5)
axes.set(xlabel="time [s]", ylabel="disc [um]", title="Run-up of the plain rotor")
figure.savefig("notebook.png", dpi=100, bbox_inches="tight")
print(f"largest displacement: {float(abs(record['disc'].sel(axis='x')).max()) * 1e6:.0f} um")
