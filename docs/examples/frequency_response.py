"""Frequency response: excitation against the linear model

A multisine on both axes at once gives the frequency response of the nonlinear plant, which is drawn on that of its
linearisation. The linear model has ideal actuators: above the resonance the lag of piezos and amplifiers shows.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
point = dict(speed=0.0, pressure=0.5e6)
record = rs.experiments.multisine(plant, **point, amplitude=0.5, low=20.0, high=300.0, period=0.5, periods=6)
model = plant.linearise(**point)

start = round(2 * 0.5 / 2e-4)  # the first two periods settle
inputs = np.fft.rfft(record["reference"].sel(axis="x").values[start:])
outputs = np.fft.rfft(record["disc"].sel(axis="x").values[start:] - float(record["disc"].sel(axis="x").mean()))
hertz = np.fft.rfftfreq(len(record["time"]) - start, 2e-4)
driven = abs(inputs) > 0.2 * abs(inputs).max()

lines = np.linspace(20.0, 300.0, 400)
k, j = model.inputs.index("reference_x"), model.outputs.index("disc_x")
states = np.eye(len(model.A))
gain = [(model.C[j] @ np.linalg.solve(2j * np.pi * f * states - model.A, model.B[:, k])) for f in lines]
print(
    f"largest gain of the linear model: {1e6 * max(map(abs, gain)):.1f} um/V at {lines[np.argmax(np.abs(gain))]:.0f} Hz"
)

figure, axes = plt.subplots(figsize=(8, 4.5))
axes.semilogy(lines, np.abs(gain) * 1e6, label="linear model")
axes.semilogy(hertz[driven], abs(outputs[driven] / inputs[driven]) * 1e6, "o", markersize=3, label="multisine")
axes.set(xlabel="frequency [Hz]", ylabel="disc x by reference x [um/V]", title="Frequency response at 0.5 MPa")
axes.legend()
axes.grid(alpha=0.3, which="both")
figure.savefig("frequency_response.png", dpi=100, bbox_inches="tight")
