"""A law that no catalogue has, discovered

Something at the disc pushes back with the cube of its displacement, and no effect of the catalogue does that. From
records at five speeds with two forces `diagnose` proposes the law, writes it as an effect of your own, and tries it on
a speed that took no part.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs
from reynolds.jit import inlined
from rotorsim.effects import Effect, param, register


@inlined
def hardening(t, angle, speed, x, y, vx, vy, p):
    """Force (fx, fy) [N] at displacement x, y [m]."""
    return -p.size * x * x * x, -p.size * y * y * y


@register
class Hardening(Effect):
    """Part that the machine has and its file has not."""

    port, kernel, steady = "motion", hardening, True
    size: float = param("N/m^3", doc="Force over the cube of the displacement.")


believed = rs.load_machine("plain_rotor").replace("effects.gravity.acceleration", "0 m/s^2")
believed = believed.replace("shaft.damping_ratio", 0.02)
real = rs.Plant(believed.replace("effects.hardening.size", "3e12 N/m^3"))
rng, Ts, n = np.random.default_rng(1), 2e-4, 2500  # a period of 0.5 s
lines = np.zeros((n // 2 + 1, 2), complex)
lines[3:60:2] = 0.4 * np.exp(2j * np.pi * rng.random((29, 2)))  # 6 to 118 Hz
force = np.tile(np.fft.irfft(lines * n / 2, n, axis=0), (8, 1))
records = []
for role, hertz in (("fit", 20), ("fit", 30), ("fit", 60), ("held_out", 36), ("untouched", 52)):
    for size in (1.0, 0.5):
        made = real.simulate(4.0, speed=2 * np.pi * hertz, disc_force=size * force).isel(time=slice(4 * n, None))
        noisy = made["disc_measured"] + rng.normal(0, 5e-8, made["disc_measured"].shape)
        attrs = {"record": f"{hertz} Hz, {size:g}", "role": role}
        records.append(made.assign(disc_measured=noisy).assign_attrs(attrs))  # stands for a measurement

found = rs.diagnose(believed, records, effects=["shaft_bow", "runout"])
law = found.discovered
print(f"{found.status}: {law.sentence}; {100 * rs.discrepancy.reduction(found.gap):.0f} % of the untouched gap gone")

u, measured, fitted, spread = (law.curve[key][:, 0] for key in ("displacement", "measured", "law", "spread"))
order = np.argsort(u)
figure, axes = plt.subplots(figsize=(8, 4.5))
axes.plot(1e6 * u, measured, ".", color="0.6", label="measured")
axes.plot(1e6 * u[order], fitted[order], label=law.kinds[0])
axes.fill_between(1e6 * u[order], (fitted - 2 * spread)[order], (fitted + 2 * spread)[order], alpha=0.3, label="2 sd")
axes.set(xlabel="x of the disc [um]", ylabel="force [N]", title=f"{law.kinds[0]} at {law.place}")
axes.legend()
figure.savefig("discover_law.png", dpi=100, bbox_inches="tight")
