from .closed_loop import Criteria as Criteria, Verification as Verification, closed_loop as closed_loop
from .transients import SafeSpeed as SafeSpeed, safe_speed as safe_speed
