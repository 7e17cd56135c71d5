from .controller import Controller as Controller
from .linearise import LinearPlant as LinearPlant
from .mesh import shaft_rotor as shaft_rotor
from .plant import Plant as Plant, compile_kernels as compile_kernels
from .simulation import Equilibrium as Equilibrium, Simulation as Simulation
from .validity import Exceeded as Exceeded, range_of_validity as range_of_validity
