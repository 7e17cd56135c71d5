"""Pins as their sensors read them: the lag that a model of a record counts to the pins

The position sensor of a pin is behind the pin, which the loop of the pin makes up for in part: the pin is ahead of its
reading. A model that takes the measured pins as inputs counts the lag of the sensors to the pins, and finds a film that
answers earlier than it does, by that lag.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

speed, pressure = 300.0, 0.5e6
machine = rs.load_machine("dtu_gas_bearing")
lags, delays = (0.0, 0.15, 0.315), []
figure, (step, found) = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
for number, lag in enumerate(lags):
    plant = rs.Plant(machine.replace("effects.pin_sensor.lag", f"{lag} ms"), n_theta=16, n_z=8)
    jump = plant.simulate(0.02, speed, pressure, reference=lambda t: (1.0, 1.0) if t > 0.0099 else (0.0, 0.0))
    for name, style in (("pin", "-"), ("pin_measured", "o")):
        travel = jump[name].isel(injector=0) * 1e6
        step.plot(jump["time"] * 1e3, travel - travel[0], style, ms=4, color=f"C{number}",
                  label=f"{'pin' if name == 'pin' else 'its reading'}, sensor of {lag} ms")  # fmt: skip
    record = rs.experiments.prbs(plant, speed, pressure, duration=5.0)
    delays.append(1e3 * np.asarray(rs.identify(record, model=2, dead_time=0).delay))
    print(f"lag {lag} ms: measured pins to disc {delays[-1][0]:.2f} and {delays[-1][1]:.2f} ms")
for axis in range(2):
    values = np.array(delays)[:, axis]
    found.plot(lags, values, "s", color=f"C{axis + 3}", label=f"Model 2, {'xy'[axis]}")
    found.plot(lags, values[0] - np.array(lags), "--", color=f"C{axis + 3}", label="without sensors, less their lag")
found.set(xlabel="lag of the sensors [ms]", ylabel="delay [ms]", title="Delay from the measured pins to the disc")
step.set(xlabel="time [ms]", ylabel="travel of pin 1 [um]", xlim=(9.5, 13), title="References of 1 V at 10 ms")
for panel in (step, found):
    panel.grid(alpha=0.3)
    panel.legend()
figure.savefig("pin_sensors.png", dpi=100)
