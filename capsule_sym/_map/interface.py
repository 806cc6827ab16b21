"""Parts of the map, for checks and experiments that take it apart."""

# ruff: noqa: F401, I001 - imported to be exported
# fmt: off

from capsule_sym._map.backend import backend, Backend, default_backend, Number, NumpyBackend
from capsule_sym._map.checks import checked_seconds
from capsule_sym._map.expansion import expand, Guard, Point, side_of
from capsule_sym._map.itinerary import cyclic_start
from capsule_sym._map.course import Course, SegmentStart, Begin
from capsule_sym._map.location import locate, End
from capsule_sym._map.native import core, NativeRun
from capsule_sym._map.precision import workspace
from capsule_sym._map.reference import Run
from capsule_sym._map.transitions import start_at, State
