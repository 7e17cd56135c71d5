"""Limits in the controller: MPC and LQR

Both laws answer a hit of 40 N. On the left the predictive one is to keep 10 um of film, on the right 1 V of reference.
Where a limit binds it acts up to a millisecond sooner than LQR, and gains next to nothing: the first swing is over
before the actuators move the rotor. The film becomes thinner under both laws, not thicker: a limit of the film is one
of the disc here, and the jets that brake the disc push the journal.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

point = {"speed": 100 * np.pi, "pressure": 0.5e6}
plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
steady = rs.experiments.steady(plant, **point, duration=2.0)
model = rs.identify(rs.experiments.prbs(plant, **point, duration=3.0), model=3, steady=steady).model
at_rest = 1e6 * plant.equilibrium(**point).h_min
hit = np.zeros((2500, 2))
hit[2000:2005, 0] = 40.0  # N, for 1 ms from 0.4 s on


def predictive(**limits):
    """MPC at the point; film in um, reference in V."""
    return rs.control.mpc.design(model, rs.control.mpc.Spec(**point, film_at_rest=at_rest, **limits))


lqr = rs.control.lqr.design(model, rs.control.lqr.Spec(**point))
print(f"{lqr.plausibility.range * 1e6:.1f} um from the centre is a bad sample of LQR: left out, MPC has no such limit")
lqr = lqr.with_(plausibility=None)
thick, weak = predictive(film=10.0), predictive(film=1.0, limit=1.0)
columns = {
    f"Film of 10 um or more: disc within {thick.spec.reach:.0f} um": {"no control": None, "LQR": lqr, "MPC": thick},
    "Reference of 1 V at most": {"no control": None, "LQR, cut off at 1 V": lqr.with_(limit=1.0), "MPC": weak},
}
figure, axes = plt.subplots(3, 2, figsize=(10, 7), sharex=True, sharey="row")
for column, (title, laws) in zip(axes.T, columns.items(), strict=True):
    print(title)
    for (name, law), style in zip(laws.items(), ("0.6", "tab:blue", "tab:orange"), strict=True):
        run = plant.simulate(0.5, **point, controller=law, disc_force=hit)
        time = 1e3 * (run["time"] - 0.4)
        disc = 1e6 * (run["disc"] - run["disc"].isel(time=slice(1500, 2000)).mean("time"))
        swings = [float(abs(disc.sel(axis="x").isel(time=slice(*k))).max()) for k in ((2000, 2020), (2022, 2500))]
        film = float(1e6 * run["h_min"].isel(time=slice(2000, None)).min())
        print(f"  {name}: first swing {swings[0]:.1f} um, later {swings[1]:.1f} um, film {film:.1f} um at least")
        column[0].plot(time, disc.sel(axis="x"), style)
        column[1].plot(time, run["reference"].sel(axis="x"), style, label=name)
        column[2].plot(time, 1e6 * run["h_min"], style)
    column[0].set(title=title, xlim=(-3, 40))
    column[1].legend(loc="upper right")
    column[2].set(xlabel="time after the hit [ms]")
for sign in (-1, 1):
    axes[0, 0].axhline(sign * thick.spec.reach, color="k", linestyle=":", linewidth=1)
for axis, label in zip(axes[:, 0], ("disc x [um]", "reference x [V]", "thinnest film [um]"), strict=True):
    axis.set(ylabel=label)
for axis in axes.flat:
    axis.grid(alpha=0.3)
figure.savefig("mpc.png", dpi=100, bbox_inches="tight")
