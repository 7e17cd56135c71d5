"""A clearance that differs from the drawing

Any field of a machine file can be an axis of a map: the onset of whirl over clearance and supply pressure.
"""

import matplotlib.pyplot as plt
import numpy as np

import rotorsim as rs

plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
field = rs.analysis.read_field("bearings.1.clearance=23 um, 25 um, 27 um")
found = rs.analysis.over_fields(plant, [field], lambda varied: rs.analysis.whirl_onset(varied, [0.3e6, 0.5e6, 0.7e6]))

figure, axes = plt.subplots(figsize=(8, 4.5))
rows = found["onset_speed"].values.reshape(3, 3) * 30 / np.pi  # (clearance, pressure) [rpm]
for clearance, row in zip((23, 25, 27), rows, strict=True):
    print(f"{clearance} um: onset at 0.5 MPa {row[1]:.0f} rpm")
    axes.plot([0.3, 0.5, 0.7], row, "o-", label=f"{clearance} um")
axes.set(xlabel="supply pressure, gauge [MPa]", ylabel="onset of whirl [rpm]", title="Onset of whirl by clearance")
axes.legend(title="clearance")
axes.grid(alpha=0.3)
figure.savefig("sensitivity.png", dpi=100, bbox_inches="tight")
