from .export.figure_files import save_figures as save_figures
from .figures.comparison_plots import compare_results as compare_results
from .figures.figures import (
    against_time as against_time,
    bode as bode,
    deceleration_curve as deceleration_curve,
    excitation as excitation,
    film_pressure as film_pressure,
    filtered_orbits as filtered_orbits,
    frequency_response as frequency_response,
    full_spectrum as full_spectrum,
    hysteresis_loops as hysteresis_loops,
    orbits as orbits,
    probe_orbits as probe_orbits,
    probe_readings as probe_readings,
    ring_down as ring_down,
    runout_profile as runout_profile,
    sensor_noise as sensor_noise,
    spectra as spectra,
    static_gain as static_gain,
    waterfall as waterfall,
)
from .figures.image import save_png as save_png
from .figures.shaft_plots import (
    critical_speed_map as critical_speed_map,
    response_figure as response_figure,
    sag as sag,
    shaft_campbell as shaft_campbell,
    unbalance_response as unbalance_response,
)
from .figures.sweep_plots import sweep_figure as sweep_figure
from .pages.balance import write_balance as write_balance
from .pages.design import write_design as write_design
from .pages.experiment import write_report as write_report
from .pages.operating_map import save_map_page as save_map_page
from .pages.response import write_campbell as write_campbell, write_response as write_response
from .pages.result_comparison import result_rows as result_rows, write_result_comparison as write_result_comparison
from .pages.run_comparison import overlay as overlay, write_run_comparison as write_run_comparison
from .pages.study import Block as Block, save_study_page as save_study_page
from .pages.sweep import write_sweep as write_sweep
from .pages.write import write as write
from .scenes.film_pressure import film_on_journal as film_on_journal
from .scenes.shaft import (
    draw_modes as draw_modes,
    mode_turntable as mode_turntable,
    show_modes as show_modes,
    whirl_orbits as whirl_orbits,
)
