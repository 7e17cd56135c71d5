from .decay import Decay as Decay, decay_of as decay_of, dominant_frequency as dominant_frequency
from .deceleration import Deceleration as Deceleration, deceleration_of as deceleration_of
from .impact import RingDown as RingDown, impact_transfer as impact_transfer, ring_downs as ring_downs
from .missing import MissingError as MissingError
from .order_tracking import find_resonances as find_resonances, track_orders as track_orders
from .prepare import prepared as prepared
from .probes import probe_planes as probe_planes
from .pulses import Pulse as Pulse, find_pulses as find_pulses
from .record_blocks import open_record as open_record
from .run_comparison import RunComparison as RunComparison, compare_runs as compare_runs
from .runout_profile import RunoutProfile as RunoutProfile, runout_of as runout_of
from .spectrum import Spectrum as Spectrum, spectrum_of as spectrum_of
from .static_gain import static_gain_map as static_gain_map
from .transfer import Transfer as Transfer, welch_transfer as welch_transfer
