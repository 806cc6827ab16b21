"""Orbits by their itineraries; their stability, symmetry, and period-doubling cascades."""

from capsule_sym import _attach

__getattr__, __dir__ = _attach(__name__, __loader__, __file__)
