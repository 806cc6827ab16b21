"""The run-time map: closed-form segments chained exactly, switch by switch."""

from capsule_sym._map.segments import Instant, Segment
from capsule_sym._map.simulate import simulate
from capsule_sym._map.steady import SteadyMotion
from capsule_sym._map.trajectory import Trajectory

__all__ = ["Instant", "Segment", "SteadyMotion", "Trajectory", "simulate"]
