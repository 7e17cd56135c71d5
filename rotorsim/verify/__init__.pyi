from .closed_loop import Verification as Verification, closed_loop as closed_loop
from .criteria import Criteria as Criteria
from .safe_speed import SafeSpeed as SafeSpeed, safe_speed as safe_speed
