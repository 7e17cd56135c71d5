# A plant's unit in Julia: ten thousand samples at 300 rad/s with a hit on the disc.
#
#   rotorsim fmu export dtu_gas_bearing --fmi 2 --out rig.fmu
using FMI

const SAMPLE = 2e-4
unit = loadFMU("rig.fmu"; type = :CS)

function hold_inputs(t, values)
    values[1] = 300.0
    values[2] = 0.05 <= t < 0.05 + SAMPLE ? 20.0 : 0.0
    return nothing
end

rows = simulateCS(
    unit,
    (0.0, 2.0);
    dt = SAMPLE,
    saveat = 0.0:SAMPLE:2.0,
    parameters = Dict("bearing.clearance" => 26e-6),
    inputValueReferences = ["shaft.speed_ref", "disc.force_x"],
    inputFunction = hold_inputs,
    recordValues = ["disc.x", "disc.y"],
)
println(rows)
unloadFMU(unit)
