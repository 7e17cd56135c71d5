from .identification_vs_physics import Study as Study, study as study
from .identify_records import (
    StudyGrid as StudyGrid,
    campaign_sources as campaign_sources,
    run as run,
    sources_of as sources_of,
)
