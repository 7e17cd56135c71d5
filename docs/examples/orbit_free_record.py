"""References that follow the orbit: what they do to the modes of a closed-loop record, and how to take them away

At 6000 rpm the orbit of imbalance and runout moves an LQR law's references by more than the PRBS does, and the film
answers such strokes with another stiffness and damping. Harmonics of the speed next to the law keep the references
from following; the loop stays the same. Shown for Model 2 and for Model 2 with rates of the pins.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

point = dict(speed=6000 * np.pi / 30, pressure=0.7e6)
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
first = rs.identify(rs.experiments.prbs(plant, **point, amplitude=0.5, duration=4.0), model=2)
law = rs.control.lqr.design(first.model, rs.control.lqr.Spec(**point))
calm = rs.experiments.without_orbit(plant, law, **point)

dither = rs.experiments.Prbs(amplitude=0.3, duration=12.0, sequence=1)
records = {
    name: rs.experiments.controlled(plant, one, **point, duration=12.0, excitations=[dither], seed=1)
    for name, one in (("as it is", law), ("without the orbit", calm))
}
true = plant.linearise(**point)
wanted = [true.wn[0] / 2 / np.pi, true.zeta[0], true.wn[1] / 2 / np.pi, true.zeta[1]]
titles = ("first mode, Hz", "its damping ratio", "second mode, Hz", "its damping ratio")

figure, axes = plt.subplots(1, 5, figsize=(13, 4), layout="constrained")
for k, (name, record) in enumerate(records.items()):
    harmonics = rs.experiments.harmonics_of(record, point["speed"], 2)
    angle = np.linspace(0, 2 * np.pi, 200)
    x, y = (np.exp(1j * np.outer(angle, [1, 2])) @ harmonics).real.T
    axes[0].plot(x, y, color=f"C{k}", label=name)
    print(f"{name}: 1X of reference x {abs(harmonics[0, 0]):.1f} V")
    for j, model in enumerate(("2", "2-rate")):
        found = rs.identify(record, model=model)
        off = [one.value / value - 1 for one, value in zip(found.intervals, wanted, strict=False)]
        print(f"model {model}: frequencies {off[0]:+.2%}, {off[2]:+.2%}, damping ratios {off[1]:+.1%}, {off[3]:+.1%}")
        for axis, one in zip(axes[1:], found.intervals, strict=False):
            axis.errorbar(2 * k + j, one.value, one.half_width, fmt="os"[j], capsize=4, color=f"C{k}")
for axis, value, title in zip(axes[1:], wanted, titles, strict=True):
    axis.axhline(value, color="tab:red", lw=1)
    axis.set(title=title, xticks=range(4), xlim=(-0.5, 3.5), xticklabels=["2", "2-rate"] * 2)
    axis.grid(alpha=0.3)
axes[0].set(title="references at 1X and 2X [V]", aspect="equal", xlabel="x", ylabel="y", ylim=(-1.3, 2.2))
axes[0].legend(loc="upper right")
axes[0].grid(alpha=0.3)
figure.suptitle("Modes from records under LQR, by model, with 90 % intervals of their variance; plant (red)")
figure.savefig("orbit_free_record.png", dpi=90)
