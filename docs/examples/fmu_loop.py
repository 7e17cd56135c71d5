"""A loop over an exported FMU

The plant as a functional mock-up unit, stepped by FMPy at 5 kHz with a controller outside: what any other simulator
does with it.
"""

import shutil

import matplotlib.pyplot as plt
import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi3 import FMU3Slave

import rotorsim as rs

rs.fmu.export(rs.Plant("plain_rotor"), "rotor.fmu", fmi=(3,))
description, folder = read_model_description("rotor.fmu"), extract("rotor.fmu")
reference = {v.name: v.valueReference for v in description.modelVariables}
unit = FMU3Slave(
    guid=description.guid,
    unzipDirectory=folder,
    modelIdentifier=description.coSimulation.modelIdentifier,
    instanceName="rotor",
)
unit.instantiate()
unit.enterInitializationMode()
unit.setFloat64([reference["shaft.speed_ref"]], [200.0])  # rad/s
unit.exitInitializationMode()

inputs = [reference[f"disc.force_{axis}"] for axis in "xy"]
outputs = [reference[f"disc.{axis}"] for axis in "xy"]
motion, force = np.zeros((7500, 2)), np.zeros(2)
for k in range(len(motion)):
    motion[k] = unit.getFloat64(outputs)
    if k > 2500:  # after half a second a magnetic damper: force against the velocity [N]
        force = -300.0 * (motion[k] - motion[k - 1]) / 2e-4
    unit.setFloat64(inputs, force.tolist())
    unit.doStep(currentCommunicationPoint=k * 2e-4, communicationStepSize=2e-4)
unit.terminate()
unit.freeInstance()
shutil.rmtree(folder)

x = motion[:, 0] * 1e6
print(f"half range along x: {np.ptp(x[1500:2500]) / 2:.1f} um without, {np.ptp(x[-1000:]) / 2:.1f} um with damper")
figure, axes = plt.subplots(figsize=(8, 4))
axes.plot(np.arange(len(x)) * 0.2, x, linewidth=0.7)
axes.axvline(500, color="k", linestyle="--")
axes.set(xlabel="time [ms]", ylabel="disc x [um]", title="FMU in FMPy's loop: a damper comes on at 500 ms")
figure.savefig("fmu_loop.png", dpi=100, bbox_inches="tight")
