"""Parts of orbits and branches, for proofs and experiments."""

# ruff: noqa: F401 - imported to be exported
# fmt: off

from capsule_sym._orbits.continuation.bifurcations import refined
from capsule_sym._orbits.continuation.conditions import ExtendedSystem
from capsule_sym._orbits.continuation.kinds import CROSSING
from capsule_sym._orbits.continuation.records import bifurcation_record, curve_record, curve_rows
from capsule_sym._orbits.metrics.many import METRICS
from capsule_sym._orbits.shooting.admissibility import middle, rerun
from capsule_sym._orbits.shooting.changes import around, swap_segment
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.itinerary import contact, drift, guard_between
from capsule_sym._orbits.shooting.stability import field
