"""Campbell diagram of a rotor

Natural frequencies against speed, with the order lines 1X and 2X; where a line meets a mode is a critical speed.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

rpm, hertz = 2 * np.pi / 60, 2 * np.pi
plant = rs.Plant("plain_rotor")
speeds = np.linspace(0.0, 9000 * rpm, 13)
modes = np.array([plant.linearise(speed, 0.0).wn[:6] for speed in speeds])  # rad/s
critical = rs.analysis.critical_speeds(plant, [0.0], orders=(1, 2), highest=float(speeds[-1]))
found = critical["critical_speed"].sel(order=1).values.ravel() / rpm
print("critical speeds of 1X [rpm]:", np.round(found[np.isfinite(found)]))

figure, axes = plt.subplots(figsize=(8, 4.5))
axes.plot(speeds / rpm, modes / hertz, color="tab:blue")
for order, style in ((1, "k--"), (2, "k:")):
    axes.plot(speeds / rpm, order * speeds / hertz, style, label=f"{order}X")
    crossing = critical["critical_speed"].sel(order=order).values.ravel()
    axes.plot(crossing / rpm, order * crossing / hertz, "ro")
axes.set(
    xlabel="speed [rpm]", ylabel="natural frequency [Hz]", title="Campbell diagram of the plain rotor", ylim=(0, 400)
)
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("campbell.png", dpi=100, bbox_inches="tight")
