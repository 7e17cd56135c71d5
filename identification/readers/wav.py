"""WAV files: a column a channel, in shares of full scale (unit FS), with the file's own clock.

A mapping states what full scale is: `full_scale = "10 V"`. Integer samples are divided by the largest number of their
format, floating-point ones are taken as shares already.
"""

import warnings
from pathlib import Path

import numpy as np

from identification.readers import reader
from identification.records.columns import FULL_SCALE, MAX_VALUES, Column, DataTable
from rotorsim.base.errors import ReadError

_UNSIGNED = 128.0
"""Middle of the codes of 8 bits, which WAV stores without sign."""


@reader(".wav", magic=rb"(RIFF|RIFX|RF64).{4}WAVE")
def read_wav(path: Path) -> DataTable:
    """Table of a WAV file of 8 to 64 bits, PCM or IEEE float."""
    from scipy.io import wavfile

    with warnings.catch_warnings():
        warnings.simplefilter("error", wavfile.WavFileWarning)  # of a cut off file
        warnings.filterwarnings("ignore", "Chunk", wavfile.WavFileWarning)
        rate, samples = wavfile.read(path)
    if samples.size == 0 or rate <= 0:
        raise ReadError("holds no samples; record or copy it again")
    if samples.size > MAX_VALUES:
        raise ReadError(f"holds {samples.size} values, above the limit of {MAX_VALUES}; cut it")
    columns = samples.reshape(len(samples), -1).T
    found = (Column(f"channel {i + 1}", _shares(column), FULL_SCALE) for i, column in enumerate(columns))
    return DataTable("WAV", tuple(found), time=np.arange(len(samples)) / rate)


def _shares(codes: np.ndarray) -> np.ndarray:
    """Codes (n,) as shares of full scale."""
    if codes.dtype.kind == "f":
        return codes.astype(float)
    if codes.dtype.kind == "u":
        return (codes.astype(float) - _UNSIGNED) / _UNSIGNED
    return codes.astype(float) / -float(np.iinfo(codes.dtype).min)
