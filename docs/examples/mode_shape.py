"""Mode shapes, and one that moves

The first whirling mode of the plain rotor as a picture and as an animated GIF, drawn without a window.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter

import rotorsim as rs

plant = rs.Plant("plain_rotor")
shapes = rs.analysis.mode_shapes(plant, speed=400.0, pressure=0.0)
shape = (shapes["shape_re"] + 1j * shapes["shape_im"]).isel(mode=0)  # over nodes and axes
hertz = float(shapes["wn"][0]) / 2 / np.pi
print(f"first mode: {hertz:.1f} Hz, damping ratio {float(shapes['zeta'][0]):.4f}")

figure = plt.figure(figsize=(7, 4.5))
axes = figure.add_subplot(projection="3d")
turn = np.exp(1j * np.linspace(0.0, 2 * np.pi, 60))
z = shapes["z"].values * 1e3
x, y = shape.sel(axis="x").values, shape.sel(axis="y").values
for node in range(0, len(z), 3):
    axes.plot(np.full(60, z[node]), np.real(x[node] * turn), np.real(y[node] * turn), color="0.7")
(line,) = axes.plot(z, np.real(x), np.real(y), color="tab:blue", linewidth=3)
axes.set(xlabel="z [mm]", ylabel="x", zlabel="y", title=f"First mode at 3820 rpm: {hertz:.1f} Hz")
axes.set_box_aspect((2, 1, 1))
figure.savefig("mode_shape.png", dpi=100, bbox_inches="tight")


def draw(frame):
    """Move the shaft to one of 24 instants of a period."""
    rotated = np.exp(2j * np.pi * frame / 24)
    line.set_data_3d(z, np.real(x * rotated), np.real(y * rotated))


FuncAnimation(figure, draw, frames=24).save("mode_shape.gif", PillowWriter(fps=12))
