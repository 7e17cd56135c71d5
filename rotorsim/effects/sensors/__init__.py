"""Effects on the sensors and their signals, and the random numbers that they draw.

A random number is a function of seed, channel and sample, the same on every machine. The three are mixed by the
finaliser of SplitMix64 (Steele, Lea & Flood 2014).

A normal deviate is the sum of twelve uniform ones of 16 bits less 6 (Irwin & Hall): variance 1, kurtosis 2.9, nothing
beyond 6; it needs no library function, whose last bit differs from platform to platform.
"""

import numpy as np

from reynolds.jit import inlined

STEP = np.uint64(0x9E3779B97F4A7C15)
FIRST = np.uint64(0xBF58476D1CE4E5B9)
SECOND = np.uint64(0x94D049BB133111EB)
CHANNEL = np.uint64(0xD1342543DE82EF95)
LOW = np.uint64(0xFFFF)
SHIFTS = (np.uint64(30), np.uint64(27), np.uint64(31))
SIXTEEN = np.uint64(16)


@inlined
def mix(z):
    """Scramble 64 bits."""
    z = (z ^ (z >> SHIFTS[0])) * FIRST
    z = (z ^ (z >> SHIFTS[1])) * SECOND
    return z ^ (z >> SHIFTS[2])


@inlined
def normal(seed, channel, sample):
    """Normal deviate of mean 0 and variance 1; the arguments are whole numbers in doubles."""
    key = mix(mix(np.uint64(seed) + STEP) ^ (np.uint64(channel) * CHANNEL + FIRST))
    total = 0.0
    for part in range(3):
        bits = mix(key + STEP * (np.uint64(3) * np.uint64(sample) + np.uint64(part + 1)))
        for _ in range(4):
            total += np.float64(bits & LOW) + 0.5
            bits = bits >> SIXTEEN
    return total / 65536.0 - 6.0
