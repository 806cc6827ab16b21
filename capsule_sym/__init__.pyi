"""The public names, for type checkers and editors; `__init__.py` imports them on first use."""

from capsule_sym import figures as figures
from capsule_sym import inputs as inputs
from capsule_sym import orbits as orbits
from capsule_sym import results as results
from capsule_sym import scenes as scenes
from capsule_sym._attractors.attractors import attractors as attractors
from capsule_sym._attractors.continuing import continue_attractors as continue_attractors
from capsule_sym._attractors.pulses import switch_by_pulse as switch_by_pulse
from capsule_sym._attractors.shock import minimal_shock as minimal_shock
from capsule_sym._check.check import check_switches as check_switches
from capsule_sym._design.fit import fit as fit
from capsule_sym._design.optimise import optimise as optimise
from capsule_sym._design.pareto import pareto as pareto
from capsule_sym._design.tolerances import tolerances as tolerances
from capsule_sym._enclosures.certificates.certify import certify_bifurcation as certify_bifurcation
from capsule_sym._enclosures.certificates.certify import certify_orbit as certify_orbit
from capsule_sym._enclosures.certificates.certify import certify_run as certify_run
from capsule_sym._enclosures.certificates.checker import check_certificate as check_certificate
from capsule_sym._errors import CapsuleError as CapsuleError
from capsule_sym._errors import InvalidInput as InvalidInput
from capsule_sym._errors import NotInstalled as NotInstalled
from capsule_sym._figures.plots import plot as plot
from capsule_sym._map.many import simulate_many as simulate_many
from capsule_sym._map.sensitivities import sensitivities as sensitivities
from capsule_sym._map.simulate import simulate as simulate
from capsule_sym._orbits.continuation.continue_orbits import (
    continue_bifurcation as continue_bifurcation,
)
from capsule_sym._orbits.continuation.continue_orbits import (
    continue_both_ways as continue_both_ways,
)
from capsule_sym._orbits.continuation.continue_orbits import continue_from as continue_from
from capsule_sym._orbits.continuation.continue_orbits import continue_orbit as continue_orbit
from capsule_sym._orbits.metrics.many import performance_many as performance_many
from capsule_sym._orbits.metrics.performance import performance as performance
from capsule_sym._orbits.shooting.search import search_orbits as search_orbits
from capsule_sym._orbits.shooting.search import solve_orbit as solve_orbit
from capsule_sym._parameters import Parameters as Parameters
from capsule_sym._parameters import PhysicalParameters as PhysicalParameters
from capsule_sym._parameters import load_parameters as load_parameters
from capsule_sym._sweeps.basin import run_basin as run_basin
from capsule_sym._sweeps.execution import run_sweep as run_sweep

__version__: str
