"""A controller of python-control in the loop

The plant's linearisation becomes a `control.StateSpace`; a damper designed there runs in the nonlinear plant at 5
kHz.
"""

import control
import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

point = dict(speed=0.0, pressure=0.5e6)
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
linear = plant.linearise(**point)
inputs = [linear.inputs.index(f"reference_{axis}") for axis in "xy"]
outputs = [linear.outputs.index(f"disc_{axis}") for axis in "xy"]
system = control.ss(linear.A, linear.B[:, inputs], linear.C[outputs], np.zeros((2, 2)))
print(f"{system.nstates} states, least damping {min(system.damp()[1]):.3f}")

lag = control.tf([8e4], [1e-3, 1.0])  # V/m; positive feedback: the lag of film, piezo and filter makes it damping
one = control.sample_system(control.ss(lag), 2e-4, method="tustin")
law = control.append(one, one)  # the same for x and y


class Controller:
    """Any object with `step` is a controller."""

    def __init__(self, centre):
        self.state, self.centre = np.zeros(law.nstates), centre

    def step(self, measured, speed, pressure):
        error = measured - self.centre
        reference = law.C @ self.state + law.D @ error
        self.state = law.A @ self.state + law.B @ error
        return np.clip(reference, -5.0, 5.0)


hit = np.zeros((2500, 2))
hit[500:505, 0] = 20.0  # N for 1 ms
figure, axes = plt.subplots(figsize=(8, 4.5))
for controller, label in ((None, "without control"), (Controller(plant.equilibrium(**point).disc), "with control")):
    record = plant.simulate(0.5, **point, disc_force=hit, controller=controller)
    motion = record["disc"].sel(axis="x") * 1e6
    print(f"{label}: {float(abs(motion - motion[0]).isel(time=slice(1000, None)).max()):.2f} um after 0.1 s")
    axes.plot((record["time"] - 0.1) * 1e3, motion - motion[0], label=label)
axes.set(xlabel="time after the hit [ms]", ylabel="disc x [um]", xlim=(-10, 250), title="Hit of 20 N")
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("python_control.png", dpi=100, bbox_inches="tight")
