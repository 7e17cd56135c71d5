"""Campaigns: many virtual experiments by one plan, on all cores or on a Dask cluster, in a store that loses nothing.

    from rotorsim import campaign
    plan = campaign.load_plan("thesis")
    campaign.run_campaign(plan, Path("my_campaign"))
    records = campaign.collect(Path("my_campaign"), "identification")

One case is one pure function of machine, experiment and seed, and its key is the hash of these. Names are imported
when they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotorsim.campaign.collecting import collect, write_table
    from rotorsim.campaign.plan import Plan, load_plan, shipped_plans
    from rotorsim.campaign.run import Outcome, Settings, run_campaign
    from rotorsim.campaign.store import Store, open_store

__all__ = [
    "Outcome",
    "Plan",
    "Settings",
    "Store",
    "collect",
    "load_plan",
    "open_store",
    "run_campaign",
    "shipped_plans",
    "write_table",
]

_HOMES = {
    "collect": "collecting",
    "write_table": "collecting",
    "Plan": "plan",
    "load_plan": "plan",
    "shipped_plans": "plan",
    "Outcome": "run",
    "Settings": "run",
    "run_campaign": "run",
    "Store": "store",
    "open_store": "store",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rotorsim.campaign' has no attribute {name!r}")
    return getattr(import_module(f"rotorsim.campaign.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
