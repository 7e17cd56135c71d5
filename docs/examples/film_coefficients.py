"""Stiffness and damping of a gas film depend on frequency

A compressible film has no constant stiffness and damping: at high frequency it stiffens and its damping fades. Here
for a bearing with four injectors at two supply pressures.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

plant = rs.Plant("dtu_gas_bearing", n_theta=24, n_z=12)
frequencies = np.geomspace(5.0, 1000.0, 25)  # Hz
found = rs.analysis.operating_map(plant, [300.0], [0.3e6, 0.7e6], frequencies=2 * np.pi * frequencies)
figure, (above, below) = plt.subplots(2, 1, figsize=(8, 6), sharex=True)
for pressure in (0.3e6, 0.7e6):
    one = found.sel(pressure=pressure).squeeze("speed")
    label = f"{pressure / 1e6:.1f} MPa"
    above.semilogx(frequencies, one["film_stiffness"].sel(axis="x", to="x") / 1e6, label=label)
    below.semilogx(frequencies, one["film_damping"].sel(axis="x", to="x"), label=label)
above.set(ylabel="stiffness k_xx [N/um]", title="Gas film with injection at 2865 rpm")
below.set(xlabel="frequency [Hz]", ylabel="damping c_xx [N s/m]")
stiffness = found["film_stiffness"].sel(axis="x", to="x").sel(pressure=0.7e6).values.ravel()
print(f"k_xx at 0.7 MPa: {stiffness[0] / 1e6:.1f} N/um at 5 Hz, {stiffness[-1] / 1e6:.1f} N/um at 1000 Hz")
for axes in (above, below):
    axes.legend()
    axes.grid(alpha=0.3, which="both")
figure.savefig("film_coefficients.png", dpi=100, bbox_inches="tight")
