"""Resampling of a record at a lower rate, by a polyphase filter that leaves nothing to fold back."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.signal import resample_poly

from identification.errors import SchemaError
from identification.records.sampling import sampling_time

if TYPE_CHECKING:
    import xarray as xr

MOST = 20_000
"""Largest numerator or denominator of the ratio of two rates."""
EXACT = 1e-9


def resample(record: xr.Dataset, rate: float) -> xr.Dataset:
    """The record at `rate` [Hz], from its first time on; attributes say from which rate.

    Every channel passes the same linear-phase low-pass filter below half the new rate; flags take the value of the
    nearest sample before.

    Raises
    ------
    SchemaError
        If the rate is above the record's own, in no simple ratio to it, or values are missing.
    """
    Ts = sampling_time(record)
    own = 1 / Ts
    # time stamps are rounded: the rate is taken for the simple number that it is
    own = round(own, 3) if abs(round(own, 3) / own - 1) < EXACT else own
    ratio = Fraction(rate / own).limit_denominator(MOST)
    if rate > own * (1 + EXACT):
        raise SchemaError(f"record: is sampled at {own:.6g} Hz; {rate:.6g} Hz would invent what is between")
    if abs(float(ratio) * own / rate - 1) > EXACT or ratio.numerator > MOST:
        raise SchemaError(f"record: {own:.9g} Hz and {rate:.9g} Hz are in no simple ratio; take a rate that divides it")
    n = -(-record.sizes["time"] * ratio.numerator // ratio.denominator)
    start = float(record["time"].values[0])
    variables: dict[str, Any] = {}
    for name, variable in record.data_vars.items():
        values = variable.values
        if "time" not in variable.dims:
            variables[str(name)] = variable
            continue
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise SchemaError(f"{name}: has missing values; cut them out before resampling")
        axis = variable.dims.index("time")
        if values.dtype.kind == "f":
            new = resample_poly(values, ratio.numerator, ratio.denominator, axis=axis, padtype="line")
        else:
            new = np.take(values, np.arange(n) * ratio.denominator // ratio.numerator, axis=axis)
        variables[str(name)] = (variable.dims, new, variable.attrs)
    coords: dict[str, Any] = {str(k): v for k, v in record.coords.items() if "time" not in v.dims}
    coords["time"] = ("time", start + np.arange(n) / rate, record["time"].attrs)
    attrs = record.attrs | {"resampled": f"from {own:.6g} Hz to {rate:.6g} Hz, polyphase filter"}
    return type(record)(variables, coords, attrs)
