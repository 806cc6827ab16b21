"""Arguments of functions: plans, sweeps, series, paths, and base classes of parameters."""

from capsule_sym import _attach

__getattr__, __dir__ = _attach(__name__, __loader__, __file__)
