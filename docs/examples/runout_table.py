"""Runout in a law: a slow roll becomes a table that is taken off every sample

Proximity probes read the surface of the disc too, and a law answers it as if the shaft moved. A slow roll shows the
surface over the shaft angle; with its table the law answers the motion, with smaller references and a smaller orbit.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

speed, pressure = 500.0, 0.6e6
machine = rs.load_machine("dtu_gas_bearing")
surface = {"amplitude_1x": "2 um", "amplitude_2x": "1 um", "phase_2x": "40 deg", "roughness": "0.2 um"}
for parameter, value in surface.items():
    machine = machine.replace(f"effects.runout.{parameter}", value)
plant = rs.Plant(machine, n_theta=16, n_z=8)

slow = rs.experiments.slow_roll(plant, speed=10.5, pressure=pressure, revolutions=4)
table = rs.control.runout_table(slow)
print(table.text)

model = rs.identify(rs.experiments.prbs(plant, speed, pressure, duration=4.0), model=3).model
law = rs.control.lqr.design(model, rs.control.lqr.Spec(speed=speed, pressure=pressure))
figure, (reading, orbit, output) = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
angle = np.degrees(slow["angle_measured"].values % (2 * np.pi))
for column, axis in enumerate("xy"):
    seen = slow["disc_measured"].sel(axis=axis) * 1e6
    reading.plot(angle, seen - seen.mean(), ".", ms=1, alpha=0.2, color=f"C{column + 2}")
    reading.plot(np.arange(720) / 2, table.values[:, column] * 1e6, color=f"C{column + 2}", label=f"table, {axis}")

for used, label in ((law, "without a table"), (law.with_(runout=table), "with the table")):
    record = plant.simulate(1.5, speed, pressure, controller=used)
    end = record.isel(time=slice(-1250, None))  # some twenty turns
    disc = (end["disc"] - end["disc"].mean("time")) * 1e6
    rms = float(np.sqrt(end["reference"].var("time").mean()))
    print(f"{label}: reference {rms:.2f} V rms, orbit {float(np.hypot(*disc.values.T).max()):.1f} um")
    orbit.plot(*disc.isel(time=slice(-250, None)).values.T, label=label)
    output.plot((end["time"] - end["time"][0]) * 1e3, end["reference"].sel(axis="x"), label=label)
reading.set(xlabel="shaft angle [deg]", ylabel="reading less its mean [um]", title="Slow roll at 100 rpm", ylim=(-4, 6))
orbit.set(xlabel="x [um]", ylabel="y [um]", title="Motion of the disc", xlim=(-5, 5), ylim=(-5, 5))
output.set(xlabel="time [ms]", ylabel="reference x [V]", title="What the law asks for", xlim=(0, 60), ylim=(-1.5, 1.7))
for panel in (reading, orbit, output):
    panel.grid(alpha=0.3)
    panel.legend(loc="upper right")
figure.savefig("runout_table.png", dpi=100)
