"""Classes of results, and functions that read results from files."""

from capsule_sym import _attach

__getattr__, __dir__ = _attach(__name__, __loader__, __file__)
