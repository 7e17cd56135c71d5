"""A broadband force that grows with the speed: non-synchronous vibration between the orders

Flow in seals and wheels shakes a rotor at all frequencies, the more the faster it turns. Between the orders of the
unbalance the spectrum of the disc is that of its modes under this force; with a speed that wanders by 1 % the orders
become broad.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import welch

import rotorsim as rs

machine = rs.load_machine("plain_rotor").replace("shaft.damping_ratio", 0.03)
for path, value in {"density": "1e-3 N^2/Hz", "speed": "6000 rpm", "exponent": 2.0, "corner": "300 Hz"}.items():
    machine = machine.replace(f"effects.broadband_force.{path}", value)
still = machine.replace("effects.speed_wander.time", "0.5 s")

figure, panels = plt.subplots(1, 2, figsize=(11, 4), sharey=True, layout="constrained")
for panel, (title, wander) in zip(panels, {"speed held": 0.0, "speed wanders by 1 %": 0.01}.items(), strict=True):
    plant = rs.Plant(still.replace("effects.speed_wander.sd", wander))
    for number, rpm in enumerate((1200, 3600, 6000)):
        record = plant.simulate(20.0, speed=rpm * np.pi / 30, seed=1).isel(time=slice(10_000, None))
        f, density = welch(record["disc"].sel(axis="x"), 5000, nperseg=10_000)
        between = (f > 5) & (f < 500) & (np.abs(f / (rpm / 60) - 1) > 0.1)
        rms = 1e6 * np.sqrt(density[between].sum() * f[1])
        print(f"{title}, {rpm} rpm: {rms:.2f} um rms outside 1X")
        panel.semilogy(f, 1e6 * np.sqrt(density), color=f"C{number}", lw=0.9, label=f"{rpm} rpm, {rms:.2f} um rms")
        if not wander:
            line = plant.linearise(rpm * np.pi / 30)
            rows, n = plant.assembly.mesh.shape(plant.assembly.mesh.probe), len(line.A) // 2
            inside = np.vstack([np.zeros((n, 2)), rows.T])
            answer = [line.C @ np.linalg.solve(2j * np.pi * v * np.eye(2 * n) - line.A, inside) for v in f[10:600:4]]
            force = 1e-3 * (rpm / 6000) ** 2 / (1 + (f[10:600:4] / 300) ** 2)
            panel.semilogy(f[10:600:4], 1e6 * np.abs([one[0, 0] for one in answer]) * np.sqrt(force), "k--", lw=0.8)
    panel.set(xlim=(0, 300), ylim=(1e-3, 30), xlabel="frequency [Hz]", title=f"{title}; rms outside 1X")
    panel.grid(alpha=0.3)
    panel.legend()
panels[0].set_ylabel("disc x [um/Hz^0.5]; dashed: modes")
figure.savefig("broadband_force.png", dpi=100)
