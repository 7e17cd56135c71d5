"""The point a law is designed at: run-ups to 6000 rpm

Two LQR laws are designed on models of two operating points, one at rest and one at full speed and low pressure, where
imbalance is largest. On the nonlinear plant both are run up at 60 krpm/s and compared with no control.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs
from rotorsim.verify.transients import amplitude, excursion, speed_ramp

plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
rate = 60_000 * 2 * np.pi / 60


def law_at(speed, pressure):
    """LQR on Model 3 of one operating point, from a record of 3 s."""
    steady = rs.experiments.steady(plant, speed, pressure, duration=2.0) if speed else None
    found = rs.identify(rs.experiments.prbs(plant, speed, pressure, duration=3.0), model=3, steady=steady)
    return rs.control.lqr.design(found.model, rs.control.lqr.Spec(speed=speed, pressure=pressure))


laws = {
    "no control": None,
    "LQR from 0 rpm, 0.7 MPa": law_at(0.0, 0.7e6),
    "LQR from 6000 rpm, 0.3 MPa": law_at(628.0, 0.3e6),
}
figure, axes = plt.subplots(figsize=(8, 4.5))
for name, law in laws.items():
    run = speed_ramp(plant, law, rate, 0.3e6)
    end = amplitude(run, run.count(0.65), len(run.table)) * 1e6
    print(f"{name}: peak {excursion(run) * 1e6:.1f} um, amplitude at 6000 rpm {end:.2f} um")
    axes.plot(run.time, (run.disc[:, 0] - run.disc[-1000:, 0].mean()) * 1e6, linewidth=0.9, label=name)
axes.axvspan(0.4, 0.5, color="0.9", label="speed rises by 60 krpm/s")
axes.set(
    xlabel="time [s]",
    ylabel="disc x [um]",
    xlim=(0.3, 0.9),
    ylim=(-14, 20),
    title="Run-up at 0.3 MPa under laws from two points",
)
axes.legend(loc="upper left", ncols=2)
axes.grid(alpha=0.3)
figure.savefig("design_point.png", dpi=100, bbox_inches="tight")
