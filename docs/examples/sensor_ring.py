"""A ring of probes that is turned

Two machines read alike: one with bearings that are softer along x, one with a probe that reads a half too much. Where
the ring of both probes is turned by 45 degrees the orbit of the shaft turns with it; the error of a probe does not.
"""

import matplotlib.pyplot as plt

import rotorsim as rs

damped = rs.load_machine("plain_rotor").replace("shaft.damping_ratio", 0.05)
soft = damped.with_({f"bearings.{end}.{k}": value for end in (0, 1) for k, value in (("kxx", 0.5e6), ("kyy", 1e6))})
machines = {"bearings softer along x": soft, "gain of probe 1": damped.replace("effects.sensor_gain.x", 0.5)}

figure, axes = plt.subplots(1, 2, figsize=(9, 4.5))
for panel, (name, machine) in zip(axes, machines.items(), strict=True):
    for angle, line in (("0 deg", "-"), ("45 deg", "--")):
        turned = machine.replace("effects.sensor_ring.angle", angle)
        record = rs.Plant(turned).simulate(4.0, speed=200.0, pressure=0.0)
        last = record["disc_measured"].isel(time=slice(-157, None)) * 1e6  # one turn [um]
        first, second = (last.sel(axis=axis) - last.sel(axis=axis).mean() for axis in "xy")
        print(f"{name}, ring at {angle}: {float(abs(first).max()):.1f} and {float(abs(second).max()):.1f} um")
        panel.plot(first, second, line, label=f"ring at {angle}")
    panel.set(xlabel="probe 1 [um]", title=name, aspect="equal")
    panel.legend()
axes[0].set_ylabel("probe 2 [um]")
figure.savefig("sensor_ring.png", dpi=100, bbox_inches="tight")
