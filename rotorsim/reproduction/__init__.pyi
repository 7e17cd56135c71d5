from .claims.targets import targets as targets
from .claims.verdicts import verdicts as verdicts
from .control import ControlStudy as ControlStudy, control_study as control_study
from .experiments.run import run_experiments as run_experiments
from .experiments.table import chosen_experiments as chosen_experiments, figure_of as figure_of
from .identification_vs_physics import Study as Study, study as study
from .plans import Layout as Layout, run as run
from .sources import campaign_sources as campaign_sources, sources_of as sources_of
from .whole import Whole as Whole, whole_study as whole_study
