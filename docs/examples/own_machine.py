"""Your own machine

A machine file is text with units. Here one is written, read and analysed: a shaft on two bearings with an overhung
disc. `rotorsim machine new my_rotor.toml` writes a commented one to start from.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

text = rs.machine_text("plain_rotor")  # shaft of 600 mm, disc in the middle, bearings at both ends
text = text.replace('position = "600 mm"', 'position = "400 mm"')  # the right bearing moves in
text = text.replace('position = "300 mm"', 'position = "600 mm"')  # and the disc to the free end
text = text.replace('name = "plain_rotor"', 'name = "overhung"')
Path("overhung.toml").write_text(text)

machine = rs.load_machine("overhung.toml")  # a slip in the file ends in one sentence here
plant = rs.Plant(machine)
model = plant.linearise(speed=2 * np.pi * 50, pressure=0.0)
print("natural frequencies [Hz]:", np.round(model.wn[:4] / 2 / np.pi, 1))

shapes = rs.analysis.mode_shapes(plant, speed=2 * np.pi * 50, pressure=0.0)
figure, axes = plt.subplots(figsize=(8, 4))
for mode in range(4):
    shape = (shapes["shape_re"] + 1j * shapes["shape_im"]).isel(mode=mode).sel(axis="x")
    label = f"{float(shapes['wn'][mode]) / 2 / np.pi:.1f} Hz, {shapes['whirl'].values[mode]}"
    axes.plot(
        shapes["z"] * 1e3, np.real(shape * np.exp(-1j * np.angle(shape[-1]))), "--" if mode % 2 else "-", label=label
    )
for bearing in machine.bearings:
    axes.plot(bearing.position * 1e3, 0.0, "k^", markersize=10)
axes.plot(machine.discs[0].position * 1e3, 0.0, "ks", markersize=14)
axes.set(xlabel="z [mm]", ylabel="shape along x [1]", title="Overhung disc (square) on two bearings (triangles)")
axes.legend()
figure.savefig("own_machine.png", dpi=100, bbox_inches="tight")
