"""Probes where the rig has them

Two pairs of proximity probes at 45 and 135 degrees, one at each end of a rotor whose right bearing is soft: the
orbits of the two planes differ.
"""

import matplotlib.pyplot as plt

import rotorsim as rs
from rotorsim.machine import ShaftProbe

planes = {"drive_end": "100 mm", "free_end": "520 mm"}
probes = tuple(
    ShaftProbe(name=f"{plane}_{side}", position=z, angle=angle, quantity="relative_displacement")
    for plane, z in planes.items()
    for side, angle in (("left", "135 deg"), ("right", "45 deg"))
)
soft = {"bearings.1.kxx": 0.3e6, "bearings.1.kyy": 0.2e6}
machine = rs.load_machine("plain_rotor").with_({"probes": probes, **soft})
record = rs.Plant(machine).simulate(3.0, speed=230.0, pressure=0.0)

figure, axes = plt.subplots(1, 2, figsize=(9, 4.5), sharex=True, sharey=True)
last = record["probe_measured"].isel(time=slice(-137, None))  # one turn [m]
for panel, plane in zip(axes, planes, strict=True):
    right, left = (last.sel(probe=f"{plane}_{side}") * 1e6 for side in ("right", "left"))
    right, left = right - right.mean(), left - left.mean()
    x, y = (right - left) / 2**0.5, (right + left) / 2**0.5  # from the probes' directions to x and y
    print(f"{plane}: {float(abs(x).max()):.1f} um along x, {float(abs(y).max()):.1f} um along y")
    panel.plot(x, y)
    panel.set(title=plane, xlabel="x [um]", aspect="equal")
axes[0].set_ylabel("y [um]")
figure.savefig("probes.png", dpi=100, bbox_inches="tight")
