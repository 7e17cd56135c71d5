"""Whirl onset and lift-off over the supply pressure

From which pressure does the film carry, and up to which speed is it stable? Both are found by iteration on linear
models.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

rpm = 2 * np.pi / 60
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
pressures = np.linspace(0.3e6, 0.7e6, 5)
onset = rs.analysis.whirl_onset(plant, pressures)
lifted = rs.analysis.lift_off(plant, [0.0])[0]
print(f"lift-off at rest: {lifted / 1e6:.2f} MPa; onset at 0.5 MPa: {float(onset['onset_speed'][2]) / rpm:.0f} rpm")

figure, axes = plt.subplots(figsize=(8, 4.5))
axes.plot(pressures / 1e6, onset["onset_speed"] / rpm, "o-", label="onset of whirl")
axes.axvline(lifted / 1e6, color="k", linestyle="--", label="lift-off at rest")
for pressure, speed, ratio in zip(pressures, onset["onset_speed"], onset["onset_ratio"], strict=True):
    axes.annotate(f"{float(ratio):.2f}", (pressure / 1e6, float(speed) / rpm + 500), ha="center")
axes.set(xlabel="supply pressure, gauge [MPa]", ylabel="speed [rpm]", xlim=(0.1, 0.75), ylim=(0, 21000))
axes.set_title("Gas bearing rig: onset of whirl, with the ratio of whirl frequency to speed")
axes.legend(loc="lower right")
axes.grid(alpha=0.3)
figure.savefig("whirl_onset.png", dpi=100, bbox_inches="tight")
