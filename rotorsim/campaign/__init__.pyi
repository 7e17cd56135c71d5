from .collection import collect as collect, write_table as write_table
from .errors import ClusterError as ClusterError, StoreError as StoreError
from .plan import Plan as Plan
from .read_plan import load_plan as load_plan, shipped_plans as shipped_plans
from .run import CampaignOutcome as CampaignOutcome, Settings as Settings, retry as retry, run_campaign as run_campaign
from .store import Store as Store, open_store as open_store, status as status
from .sweep import sweep_in_folder as sweep_in_folder
