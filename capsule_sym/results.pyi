"""Classes of results, and functions that read results from files."""

from capsule_sym._attractors.attractor import Attractor as Attractor
from capsule_sym._attractors.attractor import Attractors as Attractors
from capsule_sym._attractors.branches import AttractorBranch as AttractorBranch
from capsule_sym._attractors.branches import ContinuedAttractors as ContinuedAttractors
from capsule_sym._attractors.pulse import Pulse as Pulse
from capsule_sym._attractors.shock import Shock as Shock
from capsule_sym._check.switch_check import SwitchCheck as SwitchCheck
from capsule_sym._design.fit import Fit as Fit
from capsule_sym._design.front_search import Front as Front
from capsule_sym._design.optimum import Optimum as Optimum
from capsule_sym._design.tolerances import Tolerances as Tolerances
from capsule_sym._enclosures.certificates.checker import Rejected as Rejected
from capsule_sym._errors import Outcome as Outcome
from capsule_sym._errors import Status as Status
from capsule_sym._map.many import Trajectories as Trajectories
from capsule_sym._map.segments import Segment as Segment
from capsule_sym._map.sensitivities import Sensitivities as Sensitivities
from capsule_sym._map.steady import SteadyMotion as SteadyMotion
from capsule_sym._map.trajectory import Trajectory as Trajectory
from capsule_sym._orbits.continuation.bifurcations import Bifurcation as Bifurcation
from capsule_sym._orbits.continuation.bifurcations import (
    CodimensionTwoPoint as CodimensionTwoPoint,
)
from capsule_sym._orbits.continuation.bifurcations import CurvePoint as CurvePoint
from capsule_sym._orbits.continuation.branch import Branch as Branch
from capsule_sym._orbits.continuation.branch import BranchPoint as BranchPoint
from capsule_sym._orbits.continuation.curve import Curve as Curve
from capsule_sym._orbits.continuation.kinds import NormalForm as NormalForm
from capsule_sym._orbits.continuation.records import orbit_from_record as orbit_from_record
from capsule_sym._orbits.continuation.records import read_branch as read_branch
from capsule_sym._orbits.metrics.many import Performances as Performances
from capsule_sym._orbits.metrics.performance import Metric as Metric
from capsule_sym._orbits.metrics.performance import Performance as Performance
from capsule_sym._orbits.shooting.admissibility import Inequality as Inequality
from capsule_sym._orbits.shooting.itinerary import Itinerary as Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit as Orbit
from capsule_sym._orbits.shooting.search import FoundOrbits as FoundOrbits
from capsule_sym._sweeps.results import open_results as open_results
