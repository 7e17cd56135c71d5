"""A hit with the hammer

A half-sine of 20 N for 1 ms hits the disc of the rig at rest. The ring-down gives frequency and damping ratio, which
are held against the eigenvalues of the linear model.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
record = rs.experiments.impact(plant, speed=0.0, pressure=0.5e6, peak=20.0, spacing=0.4)
model = plant.linearise(speed=0.0, pressure=0.5e6)

time = record["time"].values
motion = record["disc"].sel(axis="x").values
motion = motion - motion[:400].mean()
after = time > 0.105  # the hit ends at 0.101 s
decay = rs.signals.decay_of(time[after], motion[after])
print(f"ring-down: {decay.frequency:.1f} Hz, damping ratio {decay.zeta:.4f}")
print(f"linear model: {model.wn[0] / 2 / np.pi:.1f} Hz, damping ratio {model.zeta[0]:.4f}")

figure, axes = plt.subplots(figsize=(8, 4))
axes.plot(time * 1e3, motion * 1e6)
envelope = np.exp(-model.zeta[0] * model.wn[0] * (time[after] - time[after][0])) * abs(motion[after]).max()
axes.plot(time[after] * 1e3, envelope * 1e6, "k--", label="decay of the linear model")
axes.set(xlabel="time [ms]", ylabel="disc x [um]", title="Hit of 20 N on the disc at 0.5 MPa", xlim=(80, 400))
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("impact.png", dpi=100, bbox_inches="tight")
