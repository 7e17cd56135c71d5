"""A model from a record under control: two stages against the direct fit

The bearing runs under an H-infinity law that may not be switched off, and a PRBS is added to the law's output. The
record holds that external reference, so `identify` recognises the closed loop and fits in two stages. A direct fit,
even one that starts at the answer, takes part of the law for damping of the rotor: it feeds noise and imbalance back.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

point = dict(speed=200.0, pressure=0.5e6)
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
first = rs.identify(rs.experiments.prbs(plant, **point, amplitude=0.5, duration=4.0), model=2)
hinf = rs.control.hinf
law = hinf.design(first.model, hinf.Spec(**point, weights=hinf.PRESETS["rig"].weights, delay=None))

dither = rs.experiments.Prbs(amplitude=0.5, duration=8.0, sequence=1)
record = rs.experiments.controlled(plant, law, **point, duration=8.0, excitations=[dither], seed=1)
found = rs.identify(record, model=2)
direct = rs.identify(record, model=2, method="oe", check=False, start=found.theta)
print(found.notes[-1])

true = plant.linearise(**point)
modes = [true.mode_of_axis(axis) for axis in (0, 1)]
for name, one in (("two-stage", found), ("direct", direct)):
    df, dzeta = one.wn / true.wn[modes] - 1, one.zeta / true.zeta[modes] - 1
    print(f"{name}: frequencies {df[0]:+.2%} and {df[1]:+.2%}, damping ratios {dzeta[0]:+.1%} and {dzeta[1]:+.1%}")

lines = np.linspace(60, 180, 400)
figure, axes = plt.subplots(figsize=(8, 4.5))
drawn = (("open loop", first, "-"), ("closed loop, two-stage", found, "--"), ("closed loop, direct", direct, ":"))
for label, one, style in drawn:
    axes.plot(lines, np.abs(one.model.transfer(2 * np.pi * lines)[:, 1, 1]) * 1e6, style, label=label)
axes.set(
    xlabel="frequency [Hz]",
    ylabel="disc y by reference y [um/V]",
    title="Models of the bearing, from records without and with the law",
)
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("closed_loop_record.png", dpi=100, bbox_inches="tight")
