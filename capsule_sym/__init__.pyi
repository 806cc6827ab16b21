"""The public names, for type checkers and editors; `__init__.py` imports them on first use."""

from capsule_sym import scenes as scenes
from capsule_sym._attractors.attractors import Attractor as Attractor
from capsule_sym._attractors.attractors import Attractors as Attractors
from capsule_sym._attractors.attractors import attractors as attractors
from capsule_sym._attractors.branches import AttractorBranch as AttractorBranch
from capsule_sym._attractors.branches import Change as Change
from capsule_sym._attractors.branches import ContinuedAttractors as ContinuedAttractors
from capsule_sym._attractors.continuing import continue_attractors as continue_attractors
from capsule_sym._attractors.destinations import Arrivals as Arrivals
from capsule_sym._attractors.destinations import Destinations as Destinations
from capsule_sym._attractors.pulse import Pulse as Pulse
from capsule_sym._attractors.pulse import PulseStatus as PulseStatus
from capsule_sym._attractors.pulse import PulseWindow as PulseWindow
from capsule_sym._attractors.pulses import switch_by_pulse as switch_by_pulse
from capsule_sym._attractors.shock import Shock as Shock
from capsule_sym._attractors.shock import minimal_shock as minimal_shock
from capsule_sym._attractors.smallest import ShockStatus as ShockStatus
from capsule_sym._check.check import SwitchCheck as SwitchCheck
from capsule_sym._check.check import check_switches as check_switches
from capsule_sym._check.switch_file import read_switches as read_switches
from capsule_sym._design.fit import fit as fit
from capsule_sym._design.fit_result import Fit as Fit
from capsule_sym._design.fit_result import FitStatus as FitStatus
from capsule_sym._design.fit_result import FittedRun as FittedRun
from capsule_sym._design.front import Front as Front
from capsule_sym._design.front import FrontPart as FrontPart
from capsule_sym._design.measurement_files import read_measured as read_measured
from capsule_sym._design.optimise import optimise as optimise
from capsule_sym._design.optimum import Constraint as Constraint
from capsule_sym._design.optimum import Optimum as Optimum
from capsule_sym._design.optimum import OptimumStatus as OptimumStatus
from capsule_sym._design.optimum import Tightest as Tightest
from capsule_sym._design.pareto import pareto as pareto
from capsule_sym._design.rig import Rig as Rig
from capsule_sym._design.rig import RigRun as RigRun
from capsule_sym._design.rig import fit_rig as fit_rig
from capsule_sym._design.rig import read_rig as read_rig
from capsule_sym._design.sensitivities import Sensitivities as Sensitivities
from capsule_sym._design.sensitivities import sensitivities as sensitivities
from capsule_sym._design.tolerances import Probability as Probability
from capsule_sym._design.tolerances import Tolerances as Tolerances
from capsule_sym._design.tolerances import tolerances as tolerances
from capsule_sym._design.variance import MetricSpread as MetricSpread
from capsule_sym._enclosures.certificates.certify import certify_bifurcation as certify_bifurcation
from capsule_sym._enclosures.certificates.certify import certify_orbit as certify_orbit
from capsule_sym._enclosures.certificates.certify import certify_run as certify_run
from capsule_sym._enclosures.certificates.checker import Rejected as Rejected
from capsule_sym._enclosures.certificates.checker import check_certificate as check_certificate
from capsule_sym._errors import CapsuleError as CapsuleError
from capsule_sym._errors import InvalidInput as InvalidInput
from capsule_sym._errors import NotInstalled as NotInstalled
from capsule_sym._errors import Outcome as Outcome
from capsule_sym._errors import Status as Status
from capsule_sym._figures.attractors import plot_attractors as plot_attractors
from capsule_sym._figures.branches import plot_bifurcations as plot_bifurcations
from capsule_sym._figures.branches import plot_energies as plot_energies
from capsule_sym._figures.charts import plot_chart as plot_chart
from capsule_sym._figures.design import plot_front as plot_front
from capsule_sym._figures.design import plot_residuals as plot_residuals
from capsule_sym._figures.diagrams import plot_diagram as plot_diagram
from capsule_sym._figures.evolution import plot_itineraries as plot_itineraries
from capsule_sym._figures.plots import plot as plot
from capsule_sym._figures.portraits import plot_displacements as plot_displacements
from capsule_sym._figures.portraits import plot_margins as plot_margins
from capsule_sym._figures.portraits import plot_motion as plot_motion
from capsule_sym._figures.portraits import plot_phase_portrait as plot_phase_portrait
from capsule_sym._figures.pulses import plot_pulse as plot_pulse
from capsule_sym._figures.shocks import plot_shock as plot_shock
from capsule_sym._figures.style import figure_style as figure_style
from capsule_sym._figures.style import save_figure as save_figure
from capsule_sym._figures.sweeps import plot_basin as plot_basin
from capsule_sym._figures.sweeps import plot_metric as plot_metric
from capsule_sym._figures.sweeps import plot_pareto as plot_pareto
from capsule_sym._figures.tolerances import plot_tolerances as plot_tolerances
from capsule_sym._map.many import Trajectories as Trajectories
from capsule_sym._map.many import simulate_many as simulate_many
from capsule_sym._map.segments import Instant as Instant
from capsule_sym._map.segments import Segment as Segment
from capsule_sym._map.simulate import simulate as simulate
from capsule_sym._map.steady import SteadyMotion as SteadyMotion
from capsule_sym._map.trajectory import Trajectory as Trajectory
from capsule_sym._orbits.continuation.branches.branch import Branch as Branch
from capsule_sym._orbits.continuation.branches.branch import BranchPoint as BranchPoint
from capsule_sym._orbits.continuation.branches.continuing import (
    continue_both_ways as continue_both_ways,
)
from capsule_sym._orbits.continuation.branches.continuing import continue_from as continue_from
from capsule_sym._orbits.continuation.branches.continuing import continue_orbit as continue_orbit
from capsule_sym._orbits.continuation.branches.continuing import (
    period_doubling_cascade as period_doubling_cascade,
)
from capsule_sym._orbits.continuation.branches.saved import labelled_point as labelled_point
from capsule_sym._orbits.continuation.branches.saved import orbit_from_record as orbit_from_record
from capsule_sym._orbits.continuation.branches.saved import read_branch as read_branch
from capsule_sym._orbits.continuation.curves.continuing import (
    continue_bifurcation as continue_bifurcation,
)
from capsule_sym._orbits.continuation.curves.continuing import curves_from as curves_from
from capsule_sym._orbits.continuation.curves.curve import Curve as Curve
from capsule_sym._orbits.continuation.families.family import Ending as Ending
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath as ParameterPath
from capsule_sym._orbits.continuation.parameter_paths import device_path as device_path
from capsule_sym._orbits.continuation.parameter_paths import parameter_path as parameter_path
from capsule_sym._orbits.continuation.points.bifurcation import Bifurcation as Bifurcation
from capsule_sym._orbits.continuation.points.bifurcation import (
    CodimensionTwoPoint as CodimensionTwoPoint,
)
from capsule_sym._orbits.continuation.points.bifurcation import CurvePoint as CurvePoint
from capsule_sym._orbits.continuation.points.normal_forms import NormalForm as NormalForm
from capsule_sym._orbits.continuation.settings import ContinuationSettings as ContinuationSettings
from capsule_sym._orbits.metrics.many import Performances as Performances
from capsule_sym._orbits.metrics.many import performance_many as performance_many
from capsule_sym._orbits.metrics.performance import Metric as Metric
from capsule_sym._orbits.metrics.performance import Performance as Performance
from capsule_sym._orbits.metrics.performance import performance as performance
from capsule_sym._orbits.shooting.admissibility import Inequality as Inequality
from capsule_sym._orbits.shooting.admissibility import is_admissible as is_admissible
from capsule_sym._orbits.shooting.admissibility import tightest as tightest
from capsule_sym._orbits.shooting.itinerary import Itinerary as Itinerary
from capsule_sym._orbits.shooting.itinerary import ItinerarySegment as ItinerarySegment
from capsule_sym._orbits.shooting.orbit import Orbit as Orbit
from capsule_sym._orbits.shooting.orbit import OrbitStatus as OrbitStatus
from capsule_sym._orbits.shooting.orbit import solve_itinerary as solve_itinerary
from capsule_sym._orbits.shooting.search import FoundOrbits as FoundOrbits
from capsule_sym._orbits.shooting.search import orbit_at as orbit_at
from capsule_sym._orbits.shooting.search import search_orbits as search_orbits
from capsule_sym._orbits.shooting.search import solve_admissible as solve_admissible
from capsule_sym._orbits.shooting.search import solve_orbit as solve_orbit
from capsule_sym._orbits.shooting.stability import LyapunovExponents as LyapunovExponents
from capsule_sym._orbits.shooting.stability import floquet_multipliers as floquet_multipliers
from capsule_sym._orbits.shooting.stability import jacobian as jacobian
from capsule_sym._orbits.shooting.stability import lyapunov_exponents as lyapunov_exponents
from capsule_sym._orbits.shooting.stability import monodromy_matrix as monodromy_matrix
from capsule_sym._orbits.shooting.stability import saltation_matrix as saltation_matrix
from capsule_sym._orbits.shooting.symmetry import half_orbit as half_orbit
from capsule_sym._orbits.shooting.symmetry import mirror_image as mirror_image
from capsule_sym._orbits.shooting.symmetry import whole_orbit as whole_orbit
from capsule_sym._parameters import Parameters as Parameters
from capsule_sym._parameters import PhysicalParameters as PhysicalParameters
from capsule_sym._parameters import SceneDevice as SceneDevice
from capsule_sym._parameters import SceneParameters as SceneParameters
from capsule_sym._parameters import load_parameters as load_parameters
from capsule_sym._sweeps.axes import Axis as Axis
from capsule_sym._sweeps.basin import run_basin as run_basin
from capsule_sym._sweeps.execution import SweepStatus as SweepStatus
from capsule_sym._sweeps.execution import run_sweep as run_sweep
from capsule_sym._sweeps.plan import load_sweep as load_sweep
from capsule_sym._sweeps.plan import read_plan as read_plan
from capsule_sym._sweeps.results import open_results as open_results
from capsule_sym._sweeps.sweep import Sweep as Sweep

__version__: str
