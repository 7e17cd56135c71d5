from .plan import Plan as Plan
from .read_plan import load_plan as load_plan, shipped_plans as shipped_plans
from .records import collect as collect, write_table as write_table
from .run import (
    CampaignOutcome as CampaignOutcome,
    Settings as Settings,
    retry as retry,
    run_campaign as run_campaign,
    sweep_in_folder as sweep_in_folder,
)
from .scheduler import ClusterError as ClusterError
from .store import Store as Store, StoreError as StoreError, open_store as open_store, status as status
