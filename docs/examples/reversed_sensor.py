"""A sensor that is reversed while the controller runs

After 0.4 s the sensor of x has the wrong sign for 0.3 s. A law that was designed on a model compares what it measures
with the model's predictions for each way in which its sensors may be connected; without these checks it drives the
rotor away.
"""

import matplotlib.pyplot as plt

import rotorsim as rs

point = {"speed": 50.0, "pressure": 0.5e6}
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
found = rs.identify(rs.experiments.prbs(plant, **point, amplitude=1.0, duration=4.0), model=3)
law = rs.control.lqr.design(found.model, rs.control.lqr.Spec(**point))


class Reversed:
    """The law behind a sensor of x that is reversed from 0.4 to 0.7 s."""

    def __init__(self, law):
        self.law, self.samples, self.alarms = law, 0, []

    def step(self, measured, speed, pressure):
        """Reference [V] of the law for what it is shown."""
        wrong = 2000 <= self.samples < 3500
        self.samples += 1
        output = self.law.step(measured * [-1, 1] if wrong else measured, speed, pressure)
        self.alarms.append(self.law.alarm)
        return output


figure, axes = plt.subplots(2, 1, figsize=(8, 6), sharex=True)
for given, label in ((law.with_(plausibility=None), "finite numbers alone"), (law, "plausibility limits")):
    controller = Reversed(given.with_())
    record = plant.simulate(1.2, **point, controller=controller)
    motion = record["disc"].sel(axis="x") * 1e6
    motion = motion - motion.isel(time=slice(1500, 2000)).mean()
    first = next((k for k, alarm in enumerate(controller.alarms) if alarm), None)
    print(f"{label}: up to {float(abs(motion).max()):.0f} um")
    if first:
        distance = float(abs(motion.isel(time=slice(2000, first + 1))).max())
        print(f"alarm after {first - 2000} samples, at {distance:.0f} um: {controller.alarms[first]}")
    axes[0].plot(record["time"], motion, label=label)
    axes[1].plot(record["time"], record["reference"].sel(axis="x"), label=label)
for axis in axes:
    axis.axvspan(0.4, 0.7, color="0.9")
    axis.grid(alpha=0.3)
axes[0].set(ylabel="disc x [um]", xlim=(0.3, 1.2), title="Sensor of x reversed from 0.4 to 0.7 s")
axes[1].set(ylabel="reference x [V]", xlabel="time [s]")
axes[0].legend(loc="lower right")
figure.savefig("reversed_sensor.png", dpi=100, bbox_inches="tight")
