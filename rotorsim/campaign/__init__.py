"""Campaigns of virtual experiments: a plan, parallel workers on all cores or a Dask cluster, a crash-safe store.

    from rotorsim import campaign
    plan = campaign.load_plan("thesis")
    campaign.run_campaign(plan, Path("my_campaign"))
    records = campaign.collect(Path("my_campaign"), "identification")

One case is one pure function of machine, experiment and seed, and its key is the hash of these. Names are imported
when they are first used.
"""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
