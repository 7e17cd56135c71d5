"""A rotor on grooved bearings

Two self-acting journal bearings carry a small turbo rotor. Plain ones whirl at less than half the speed; herringbone
grooves on the journals keep the rotor stable. The least damping ratio of its linear model shows it.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

rpm = 2 * np.pi / 60
grooved = rs.load_machine("grooved_turbo_rotor").with_({"grid.n_theta": 24, "grid.n_z": 12})
plain = grooved.with_({"bearings.0.grooves": None, "bearings.1.grooves": None})
speeds = np.linspace(20_000, 200_000, 10) * rpm

figure, axes = plt.subplots(figsize=(8, 4.5))
for machine, name in ((grooved, "herringbone grooves"), (plain, "plain")):
    plant = rs.Plant(machine)
    models = [plant.linearise(speed, 0.0) for speed in speeds]
    least = [float(model.zeta.min()) for model in models]
    worst = models[-1].zeta.argmin()
    print(f"{name}: least damping ratio {min(least):.3f}, at {models[-1].wn[worst] / (2 * np.pi):.0f} Hz")
    axes.plot(speeds / rpm / 1000, least, "o-", label=name)
axes.axhline(0.0, color="k", linewidth=0.8)
axes.set(xlabel="speed [krpm]", ylabel="least damping ratio", title="Turbo rotor on two self-acting bearings")
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("grooved_rotor.png", dpi=100, bbox_inches="tight")
