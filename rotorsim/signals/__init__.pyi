from .impact import (
    Decay as Decay,
    Pulse as Pulse,
    RingDown as RingDown,
    decay_of as decay_of,
    dominant_frequency as dominant_frequency,
    find_pulses as find_pulses,
    impact_transfer as impact_transfer,
    mode_pair as mode_pair,
    ring_downs as ring_downs,
)
from .orders import (
    Deceleration as Deceleration,
    RunComparison as RunComparison,
    compare_runs as compare_runs,
    deceleration_of as deceleration_of,
    find_resonances as find_resonances,
    track_orders as track_orders,
)
from .record_blocks import (
    MissingError as MissingError,
    RunoutProfile as RunoutProfile,
    open_record as open_record,
    prepared as prepared,
    probe_planes as probe_planes,
    runout_of as runout_of,
)
from .spectra import (
    Spectrum as Spectrum,
    Transfer as Transfer,
    spectrum_of as spectrum_of,
    welch_transfer as welch_transfer,
)
from .static_gain import static_gain_map as static_gain_map
