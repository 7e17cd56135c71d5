"""Starts without a blow, a lost blade, a shock of the base

A steady run begins on the synchronous orbit, where one from rest shows its start transient for seconds. Then an
unbalance appears, as of a lost blade, and the base gets a half-sine shock.
"""

import matplotlib.pyplot as plt

import rotorsim as rs

plant = rs.Plant("plain_rotor")
blade = {"me": "100 g*mm", "phase": "90 deg", "time": "0.2 s"}
broken = rs.Plant(plant.machine.with_({"effects.sudden_unbalance": blade}))
speed = 150.0  # rad/s

figure, (start, loss, shock) = plt.subplots(3, 1, figsize=(8, 8), sharex=True)
for begin, colour in (("rest", "0.7"), ("orbit", "C0")):
    record = rs.experiments.steady(plant, speed, duration=1.0, begin=begin)
    start.plot(record["time"], 1e6 * record["disc"][:, 0], color=colour, label=f"begin = {begin!r}")
lost = rs.experiments.steady(broken, speed, duration=1.0)
loss.plot(lost["time"], 1e6 * lost["disc"][:, 0], label="blade lost at 0.2 s")
shaken = rs.experiments.shock(plant, speed, peak=50.0, width=11e-3, lead=0.2, rest=0.789)
shock.plot(shaken["time"], 1e6 * shaken["disc"][:, 1], label="50 m/s$^2$ for 11 ms at 0.2 s")
before, after = (float(abs(lost["disc"][part, 0]).max()) for part in (slice(1000), slice(1000, None)))
print(f"largest x before and after the loss: {1e6 * before:.0f} um, {1e6 * after:.0f} um")
for axes, name in ((start, "x"), (loss, "x"), (shock, "y")):
    axes.set(ylabel=f"disc {name} [um]")
    axes.grid(alpha=0.3)
    axes.legend(loc="upper right")
shock.set(xlabel="time [s]")
figure.savefig("starts.png", dpi=100, bbox_inches="tight")
