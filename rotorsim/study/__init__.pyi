from .identification_vs_physics import Study as Study, study as study
from .identify_records import campaign_sources as campaign_sources, sources_of as sources_of
from .plans import StudyGrid as StudyGrid, run as run
