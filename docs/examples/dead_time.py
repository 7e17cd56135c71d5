"""Dead time and bias: what a record states about modes and static gain, and the plant's own values

Model 3 of the thesis has one lag for two actuator poles and a film, which raises its static gain; a dead time on each
axis sets that right. The intervals hold variance and the bias that the record shows, about the value less that bias;
crosses are the linearised plant.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

speed, pressure = 4500 * np.pi / 30, 0.45e6
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
record, second = (
    rs.experiments.prbs(plant, speed, pressure, duration=6.0, sequence=number, seed=number) for number in (1, 2)
)
found = {"Model 3, dead time": rs.identify(record, 3), "Model 3 of the thesis": rs.identify(record, 3, dead_time=0)}
found["Model 2"] = rs.identify(record, 2)
fits = {row.name: row.fit for row in rs.identification.compare_models(found, second).rows}

true = plant.linearise(speed, pressure)
values = [true.wn[0] / 2 / np.pi, true.zeta[0], true.wn[1] / 2 / np.pi, true.zeta[1], *1e6 * true.static_gain.ravel()]
shown = {"first mode, Hz": 0, "its damping ratio": 1, "second mode, Hz": 2, "its damping": 3, "gain xx, um/V": 4}
shown["gain yy, um/V"] = 7

figure, axes = plt.subplots(2, 3, figsize=(9, 5), layout="constrained")
for axis, (title, place) in zip(axes.ravel(), shown.items(), strict=True):
    for k, one in enumerate(found.values()):
        interval = one.intervals[place]
        axis.errorbar(k, interval.value - interval.bias, interval.half_width, fmt="none", capsize=4)
        axis.errorbar(k, interval.value, 1.645 * interval.sd, fmt="o", elinewidth=4, alpha=0.5, color="black")
    axis.axhline(values[place], color="tab:red", lw=1)
    axis.plot(range(3), [values[place]] * 3, "x", color="tab:red")
    axis.set(title=title, xticks=range(3), xlim=(-0.5, 2.5), xticklabels=["3-delay", "3", "2"])
    axis.grid(alpha=0.3)
figure.suptitle("Values (dots) and 90 % intervals: variance alone (thick), less bias (thin); plant (red)")
figure.savefig("dead_time.png", dpi=100)
for name, one in found.items():
    held = sum(i.low <= v <= i.high for i, v in zip(one.intervals, values, strict=True))
    print(f"{name}: fit of the held-out record {fits[name][0]:.1%}, {fits[name][1]:.1%}; {held} of 8 intervals hold")
