"""Simulation case without physics, for benchmarks and tests of the campaign's workers and store.

It sleeps for its `duration`, if it has one; the record is a few numbers drawn from the seed.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from identification import make_record
from rotorsim.campaign.plan import Case
from rotorsim.campaign.simulate_case import adopt, publish
from rotorsim.campaign.store import record_path

SAMPLES = 5


def prepare(case: Case, text: str) -> None:
    """Import the libraries, so that the time limit does not count it; nothing is compiled."""
    import h5py  # noqa: F401
    import xarray  # noqa: F401


def solve(folder: Path, case: Case, text: str, summary: Sequence[str]) -> dict[str, Any]:
    """Run a dummy case; interface of `rotorsim.campaign.simulate_case.solve`."""
    path = record_path(folder, case.key)
    found = adopt(path, case.key) if case.keep != () and path.exists() else None
    if found is not None:
        return found
    time.sleep(float(dict(case.parameters).get("duration", 0.0)))
    disc = np.random.default_rng(case.seed).normal(size=(SAMPLES, 2))
    row = {"numbers.disc.rms_um.x": float(disc[:, 0].std())}
    if case.keep == ():
        return {"summary": row, "bytes": 0}
    attrs = {"campaign_key": case.key, "campaign_row": json.dumps(row), "seed": case.seed}
    record = make_record(np.arange(SAMPLES) * 2e-4, {"disc": disc})
    return {"summary": row, "bytes": publish(folder, case, record, attrs)}
