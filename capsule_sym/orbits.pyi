"""Orbits by their itineraries; their stability, symmetry, and period-doubling cascades."""

from capsule_sym._orbits.continuation.continue_orbits import (
    period_doubling_cascade as period_doubling_cascade,
)
from capsule_sym._orbits.shooting.admissibility import is_admissible as is_admissible
from capsule_sym._orbits.shooting.admissibility import tightest as tightest
from capsule_sym._orbits.shooting.orbit import solve_itinerary as solve_itinerary
from capsule_sym._orbits.shooting.search import orbit_at as orbit_at
from capsule_sym._orbits.shooting.stability import floquet_multipliers as floquet_multipliers
from capsule_sym._orbits.shooting.stability import jacobian as jacobian
from capsule_sym._orbits.shooting.stability import lyapunov_exponents as lyapunov_exponents
from capsule_sym._orbits.shooting.stability import monodromy_matrix as monodromy_matrix
from capsule_sym._orbits.shooting.stability import saltation_matrix as saltation_matrix
from capsule_sym._orbits.shooting.symmetry import half_orbit as half_orbit
from capsule_sym._orbits.shooting.symmetry import mirror_image as mirror_image
from capsule_sym._orbits.shooting.symmetry import whole_orbit as whole_orbit
