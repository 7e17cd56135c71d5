"""Modes tracked online during a run-up

Binary references excite the rig while it runs up to 6000 rpm, and a recursive estimate follows its modes sample by
sample. For one second the sensors are lost; the estimate waits, counts what it skipped, and continues.

python studies/recursive_lpv/runup.py
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2]))

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs
from rotorsim.experiments.catalogue.prbs import bits
from studies.recursive_lpv.estimate import RecursiveLpv

Ts, seconds, top, pressure = 2e-4, 16.0, 6000 * np.pi / 30, 0.5e6
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
start = rs.identify(rs.experiments.prbs(plant, 0.0, pressure, duration=4.0), model=3).model  # at standstill

t = np.arange(round(seconds / Ts)) * Ts
speed = np.clip((t - 1) / (seconds - 2), 0, 1) * top
reference = np.column_stack([bits(1, axis, np.arange(len(t)) // 25) for axis in range(2)])
record = plant.simulate(seconds, speed=speed, pressure=pressure, reference=reference)
y = record["disc_measured"].values.copy()
y[(t > 9) & (t < 10)] = np.nan  # a loose plug

online = RecursiveLpv(start, Ts, speeds=(0.0, top), pressures=(pressure, pressure))
times, tracked = [], []
for k in range(len(t)):
    online.update(reference[k], y[k], speed[k], pressure)  # a loop on the rig would call this at every sample
    if k % 500 == 499:
        frozen = online.at(speed[k], pressure)
        times.append(t[k])
        tracked.append([*frozen.wn[:2] / (2 * np.pi), *frozen.zeta[:2]])

speeds = np.linspace(0, top, 7)
physics = [plant.linearise(one, pressure) for one in speeds]
true = np.array([[*one.wn[:2] / (2 * np.pi), *one.zeta[:2]] for one in physics])
modes, at = np.array(tracked), np.interp(times, t, speed)
off = modes / np.column_stack([np.interp(at, speeds, column) for column in true.T]) - 1
worst = np.abs(off[np.array(times) > 2]).max(axis=0)
print(f"largest error of frequencies {worst[:2].max():.2%}, of damping ratios {worst[2:].max():.1%}")
print(f"samples skipped: {online.counts['skipped']}, updates refused: {online.counts['refused']}")

figure, axes = plt.subplots(1, 2, figsize=(10, 4.2))
for axis, columns, name in ((axes[0], (0, 1), "natural frequency [Hz]"), (axes[1], (2, 3), "damping ratio")):
    for column, color in zip(columns, ("tab:blue", "tab:orange"), strict=True):
        axis.plot(at * 30 / np.pi, modes[:, column], color=color, linewidth=1, label=f"mode {column % 2 + 1}, tracked")
        axis.plot(speeds * 30 / np.pi, true[:, column], "--", color=color, label="eigenvalues of the plant")
    axis.axvspan(*np.interp([9, 10], t, speed) * 30 / np.pi, color="0.9")
    axis.set(xlabel="speed [rpm]", ylabel=name)
    axis.grid(alpha=0.3)
axes[0].set_ylim(110, 130)
axes[1].set_ylim(0, 0.1)
axes[0].legend(fontsize=8)
figure.suptitle("Modes tracked during a run-up; grey: sensors lost")
figure.savefig("runup.png", dpi=100, bbox_inches="tight")
