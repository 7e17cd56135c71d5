"""From a record to a controller: PRBS, Model 3, LQR, verification

Binary references excite the rig; a low-order model is identified from the record alone; an LQR is designed on the
model, and a hit on the nonlinear plant, which the design never saw, shows what the controller does.
"""

import matplotlib.pyplot as plt

import rotorsim as rs

point = dict(speed=0.0, pressure=0.5e6)
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
record = rs.experiments.prbs(plant, **point, amplitude=1.0, duration=4.0)

found = rs.identify(record, model=3)
print(f"fit of x and y: {found.fit[0]:.1%} and {found.fit[1]:.1%}, noise allows {found.ceiling[0]:.1%}")
law = rs.control.lqr.design(found.model, rs.control.lqr.Spec(**point))

hit = dict(peak=20.0, spacing=0.3, lead=0.5)  # the law looks for its centre for 0.2 s, then fades in
without = rs.experiments.impact(plant, **point, **hit)
with_law = rs.experiments.controlled(
    plant, law, **point, duration=float(without["time"][-1]), excitations=[rs.experiments.Impact(**hit)]
)
figure, axes = plt.subplots(figsize=(8, 4.5))
for run, label in ((without, "without control"), (with_law, "with LQR")):
    motion = run["disc"].sel(axis="x")
    motion = (motion - motion.sel(time=slice(0.4, 0.49)).mean()) * 1e6
    energy = float((motion.sel(time=slice(0.5, None)) ** 2).sum() * 2e-4)
    print(f"{label}: energy of the answer {energy:.3f} um^2 s")
    axes.plot((run["time"] - 0.5) * 1e3, motion, label=label)
axes.set(
    xlabel="time after the hit [ms]",
    ylabel="disc x [um]",
    xlim=(-10, 200),
    title="Hit of 20 N, with and without control",
)
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("prbs_to_controller.png", dpi=100, bbox_inches="tight")
