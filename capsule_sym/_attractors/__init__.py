"""Coexisting attractors: basins, robustness of a motion, and switching between two motions."""
