"""The run-time map: closed-form segments chained exactly, switch by switch."""

from capsule_sym.map.segments import Instant, Segment
from capsule_sym.map.simulate import simulate
from capsule_sym.map.steady import SteadyMotion
from capsule_sym.map.trajectory import Trajectory

__all__ = ["Instant", "Segment", "SteadyMotion", "Trajectory", "simulate"]
