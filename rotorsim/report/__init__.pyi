from .comparison import (
    compare_results as compare_results,
    overlay as overlay,
    result_rows as result_rows,
)
from .control import write_design as write_design
from .figure_files import save_figures as save_figures, save_png as save_png
from .film import film_pressure as film_pressure
from .linear import (
    critical_speed_map as critical_speed_map,
    response_figure as response_figure,
    sag as sag,
    shaft_campbell as shaft_campbell,
    unbalance_response as unbalance_response,
)
from .orbit import (
    centreline as centreline,
    filtered_orbits as filtered_orbits,
    orbits as orbits,
    polar as polar,
    probe_orbits as probe_orbits,
)
from .orders import (
    bode as bode,
    cascade as cascade,
    full_spectrum as full_spectrum,
    runout_profile as runout_profile,
    sensor_noise as sensor_noise,
    spectra as spectra,
    waterfall as waterfall,
)
from .page import Block as Block, save_study_page as save_study_page, write as write
from .record import write_report as write_report
from .responses import (
    frequency_response as frequency_response,
    hysteresis_loops as hysteresis_loops,
    ring_down as ring_down,
    static_gain as static_gain,
)
from .scenes import (
    draw_modes as draw_modes,
    film_on_journal as film_on_journal,
    mode_turntable as mode_turntable,
    show_modes as show_modes,
    whirl_orbits as whirl_orbits,
)
from .sweep import sweep_figure as sweep_figure
from .time_history import (
    against_time as against_time,
    deceleration_curve as deceleration_curve,
    excitation as excitation,
    friction_curve as friction_curve,
    probe_readings as probe_readings,
)
from .workbook import write_workbook as write_workbook
