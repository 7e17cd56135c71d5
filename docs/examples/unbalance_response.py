"""Unbalance response of a shaft, by finite elements alone

`fe_shaft` is a rotordynamics library of its own: shaft elements, discs, bearings. Amplitude and phase of a rotor
through its first critical speeds.
"""

import matplotlib.pyplot as plt
import numpy as np

from fe_shaft import BearingElement, DiskElement, Rotor, ShaftElement, steel

shaft = [ShaftElement(0.05, 0.0, 0.02, material=steel) for _ in range(12)]  # 600 mm, diameter 20 mm
disc = DiskElement.from_geometry(n=4, material=steel, width=0.02, i_d=0.02, o_d=0.15)
bearings = [BearingElement(n, kxx=8e5, cxx=600.0, kyy=4e5, cyy=600.0) for n in (0, 12)]
rotor = Rotor(shaft, [disc], bearings)

speeds = np.linspace(50.0, 900.0, 600)  # rad/s
response = rotor.run_unbalance_response(4, 10e-6, 0.0, speeds).response  # (ndof, n_speed) [m], 10 g mm at the disc
x, y = response[4 * 4], response[4 * 4 + 1]
print(f"largest amplitude along x: {abs(x).max() * 1e6:.0f} um at {speeds[abs(x).argmax()] * 30 / np.pi:.0f} rpm")

figure, (above, below) = plt.subplots(2, 1, figsize=(8, 6), sharex=True)
for part, label in ((x, "x"), (y, "y")):
    above.semilogy(speeds * 30 / np.pi, abs(part) * 1e6, label=f"disc {label}")
    below.plot(speeds * 30 / np.pi, np.degrees(np.unwrap(-np.angle(part))))
above.set(ylabel="amplitude, 0-pk [um]", title="Unbalance response, bearings softer along y")
below.set(xlabel="speed [rpm]", ylabel="phase lag [deg]")
below.invert_yaxis()
above.legend()
for axes in (above, below):
    axes.grid(alpha=0.3, which="both")
figure.savefig("unbalance_response.png", dpi=100, bbox_inches="tight")
