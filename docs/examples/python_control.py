"""A controller of python-control in the loop

The plant's linear model becomes a `control.StateSpace`, a law designed with the package `control` becomes a `Law`, and
the nonlinear plant runs with it at 5 kHz.
"""

import control
import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

point = {"speed": 0.0, "pressure": 0.5e6}
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
system = plant.linearise(**point).to_control()  # inputs and outputs have their names
print(f"{system.nstates} states, least damping {min(system.damp()[1]):.3f}")

# Positive feedback through a lag: with the lag of film and piezos it acts against the velocity at 120 Hz.
lag = control.sample_system(control.ss(control.tf([8e4], [1e-3, 1.0])), 2e-4, method="tustin")  # V/m
law = rs.Law.from_control(control.append(lag, lag), name="lag")  # x and y alike

hit = np.zeros((4000, 2))
hit[2500:2505, 0] = 20.0  # N for 1 ms, once the law has found its centre
figure, axes = plt.subplots(figsize=(8, 4.5))
for controller, label in ((None, "without control"), (law, "with control")):
    record = plant.simulate(0.8, **point, disc_force=hit, controller=controller)
    motion = record["disc"].sel(axis="x") * 1e6
    motion = motion - motion.isel(time=slice(2300, 2500)).mean()
    print(f"{label}: {float((motion.isel(time=slice(2500, None)) ** 2).sum() * 2e-4):.2f} um^2 s")
    axes.plot((record["time"] - 0.5) * 1e3, motion, label=label)
axes.set(xlabel="time after the hit [ms]", ylabel="disc x [um]", xlim=(-10, 200), title="Hit of 20 N on the disc")
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("python_control.png", dpi=100, bbox_inches="tight")
