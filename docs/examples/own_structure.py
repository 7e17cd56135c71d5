"""A grey-box structure of your own

Model 3 has one lag for actuators and film. Here the actuators are known from the pins, and a structure of nine
parameters adds the film's lag. Fitted to a record or to its frequency response, it is closer to the plant.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
record = rs.experiments.prbs(plant, speed=0.0, pressure=0.5e6, amplitude=0.3, duration=6.0)
piezo = rs.identify(record, model="actuator").model  # pins behind references, four states


def bearing(theta):
    """Rotor on stiffness and damping, behind a film of one lag, behind the actuators."""
    kx, ky, k_cross, dx, dy, d_cross, bx, by, lag = theta
    eye, none, wide = np.eye(2), np.zeros((2, 2)), np.zeros((2, 4))
    K, D, gain = [[kx, k_cross], [-k_cross, ky]], [[dx, d_cross], [-d_cross, dy]], np.diag([bx, by] / scale)
    A = np.block([
        [none, eye, none, wide],
        [-np.array(K), -np.array(D), gain, wide],
        [none, none, -lag * eye, lag * piezo.C],
        [wide.T, wide.T, wide.T, piezo.A],
    ])  # fmt: skip
    return A, np.vstack([np.zeros((6, 2)), piezo.B]), np.eye(2, 10), none


scale = np.diag(piezo.static_gain)
names = ("k_x", "k_y", "k_cross", "d_x", "d_y", "d_cross", "b_x", "b_y", "lag")
start = (6e5, 6e5, 0.0, 80.0, 80.0, 0.0, 2.0, 2.0, 1500.0)
bounds = tuple((-np.inf if name.endswith("cross") else 0.0, np.inf) for name in names)
units = ("1/s^2",) * 3 + ("1/s",) * 3 + ("m/(s^2 V)",) * 2 + ("rad/s",)
own = rs.identification.Structure("film behind actuators", names, bearing, start, bounds, units)

truth = plant.linearise(0.0, 0.5e6)
found = {"the plant": truth, "Model 3": rs.identify(record, 3, dead_time=0), "own structure": rs.identify(record, own)}
measured = rs.identification.frequency_response(record["reference"].values, record["disc_measured"].values, 2e-4)
found["the same by frequency response"] = rs.identification.fit_frequency_response(measured, own, band=(10, 400))
for name, one in found.items():
    f, zeta, gain = one.wn[0] / (2 * np.pi), one.zeta[0], one.static_gain[0, 0] * 1e6
    print(f"{name}: {f:.1f} Hz, damping ratio {zeta:.4f}, gain of x at rest {gain:.2f} um/V")

figure, axes = plt.subplots(figsize=(8, 4.5))
lines = (measured.omega > 2 * np.pi * 10) & (measured.omega < 2 * np.pi * 190)
f = measured.omega[lines] / (2 * np.pi)
axes.semilogy(f, np.abs(measured.G[lines, 1, 1]) * 1e6, ".", color="0.6", markersize=3, label="measured")
for (name, one), style in zip(list(found.items())[1:3], ("--", "-"), strict=True):
    axes.semilogy(f, np.abs(one.model.transfer(measured.omega[lines])[:, 1, 1]) * 1e6, style, label=name)
axes.set(xlabel="frequency [Hz]", ylabel="disc y per reference y [um/V]", title="Model 3 and a structure of your own")
axes.set_yticks([2, 3, 5, 10, 20, 30], labels=[2, 3, 5, 10, 20, 30])
axes.minorticks_off()
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("own_structure.png", dpi=100, bbox_inches="tight")
