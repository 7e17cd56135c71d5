"""Closed-form solutions for gas films, slots and nozzles that verify the film solver; absolute pressures, SI.

Cites: ausman_1961, dubois_1953, hamrock_2004, shapiro_1953, sommerfeld_1904.
"""

import cmath
import math


def small_eccentricity_stiffness(
    radius: float,
    length: float,
    clearance: float,
    speed: float,
    whirl_ratio: float = 0.0,
    viscosity: float = 1.85e-5,
    ambient_pressure: float = 101325.0,
) -> complex:
    r"""Stiffness Z [N/m] of a plain gas bearing about the centre, F = -Z x, x = X + i Y a forward whirl at nu
    Omega.

    .. math:: Z = \frac{\pi p_a R L}{c}\,\frac{k}{l^2}\left(1 - \frac{\tanh l b}{l b}\right), \qquad
              l^2 = 1 + k, \quad k = i\Lambda(2\nu - 1), \quad b = \frac{L}{2R}

    With p = pa (1 + psi), h = c (1 + eta) and both proportional to exp(i(theta - nu Omega t)), first order in
    eta leaves R^2 psi'' - (1 + k) psi = k eta in z, psi = 0 at the edges: Ausman (1961), J. Basic Eng. 83,
    188, for nu = 0; a circular whirl only turns Lambda into Lambda (1 - 2 nu). At nu = 1/2 there is no force
    at all. From 2 x 2 coefficients Z = Z_xx - i Z_xy.
    """
    number = 6 * viscosity * speed * radius**2 / (ambient_pressure * clearance**2)
    k = 1j * number * (2 * whirl_ratio - 1)
    root = cmath.sqrt(1 + k)
    b = length / (2 * radius)
    scale = math.pi * ambient_pressure * radius * length / clearance
    return scale * k / (1 + k) * (1 - cmath.tanh(root * b) / (root * b))


def ocvirk_force(
    radius: float, length: float, clearance: float, eccentricity: float, speed: float, viscosity: float
) -> float:
    r"""Tangential force [N] of a short incompressible full film, L / D -> 0.

    .. math:: F_t = \frac{\pi \mu \Omega R L^3}{2 c^2}\,\frac{\varepsilon}{(1 - \varepsilon^2)^{3/2}}

    Source: Dubois & Ocvirk (1953), NACA Report 1157, without cavitation.
    """
    shape = eccentricity / (1 - eccentricity**2) ** 1.5
    return math.pi * viscosity * speed * radius * length**3 / (2 * clearance**2) * shape


def sommerfeld_force(
    radius: float, length: float, clearance: float, eccentricity: float, speed: float, viscosity: float
) -> float:
    r"""Tangential force [N] of a long incompressible full film, L / D -> infinity.

    .. math:: F_t = 12\pi\mu\Omega R L \left(\frac{R}{c}\right)^2
              \frac{\varepsilon}{(2 + \varepsilon^2)\sqrt{1 - \varepsilon^2}}

    Source: Sommerfeld (1904); Hamrock (2004), ch. 10.
    """
    shape = eccentricity / ((2 + eccentricity**2) * math.sqrt(1 - eccentricity**2))
    return 12 * math.pi * viscosity * speed * radius * length * (radius / clearance) ** 2 * shape


def slot_pressure(z: float, length: float, pressure: float, ambient_pressure: float) -> float:
    """Pressure [Pa] at a distance z [m] into a slot of length `length`: p^2 falls linearly."""
    return math.sqrt(pressure**2 + (ambient_pressure**2 - pressure**2) * z / length)


def slot_flow(
    width: float,
    height: float,
    length: float,
    pressure: float,
    ambient_pressure: float,
    viscosity: float,
    gas_constant: float,
    temperature: float,
) -> float:
    r"""Isothermal laminar mass flow [kg/s] through a slot, w h^3 (p_0^2 - p_a^2) / (24 mu R_g T l).

    A concentric film of diameter D is a slot of width pi D. Source: Hamrock (2004), ch. 16, with no sliding.
    """
    return (
        width * height**3 * (pressure**2 - ambient_pressure**2) / (24 * viscosity * gas_constant * temperature * length)
    )


def hagen_poiseuille_flow(
    radius: float,
    length: float,
    pressure: float,
    back_pressure: float,
    viscosity: float = 1.85e-5,
    gas_constant: float = 287.05,
    temperature: float = 293.15,
) -> float:
    r"""Isothermal laminar mass flow [kg/s] of a gas through a round pipe, pi r^4 (P_1^2 - P_2^2) / (16 mu l
    R_g T).

    Source: Poiseuille's law with the density of an ideal gas, integrated along the pipe.
    """
    return (
        math.pi * radius**4 * (pressure**2 - back_pressure**2) / (16 * viscosity * length * gas_constant * temperature)
    )


def choked_flux(
    pressure: float, temperature: float, heat_capacity_ratio: float = 1.4, gas_constant: float = 287.05
) -> float:
    r"""Mass flux [kg/(s m^2)] through a choked nozzle; 0.0404 P / sqrt(T) for air.

    .. math:: G = P\sqrt{\frac{\kappa}{R_g T}}\left(\frac{2}{\kappa + 1}\right)^{(\kappa + 1)/(2(\kappa - 1))}

    Source: Shapiro (1953), The dynamics and thermodynamics of compressible fluid flow, ch. 4.
    """
    kappa = heat_capacity_ratio
    power = (kappa + 1) / (2 * (kappa - 1))
    return pressure * math.sqrt(kappa / (gas_constant * temperature)) * (2 / (kappa + 1)) ** power
