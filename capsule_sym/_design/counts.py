"""Allowed ranges of counts in optima, fronts and fits, for functions and commands."""

MAX_SECONDS = 60.0
"""Default limit of time of an optimum or a front: several times what a usual one takes."""
SAMPLES = 1, 1_000_000
"""Places of a survey."""
FOLLOW = 1, 1_000
"""Guesses of a fit from which a search starts."""
POINTS = 2, 10_000
"""Points of a front."""
STARTS = 0, 100_000
"""Further guesses of a fit."""
STEPS = 1, 100_000
"""Largest number of evaluations of the residuals in a least-squares solution."""
SEED = 0, 10**12
"""Random seed of places or guesses."""
