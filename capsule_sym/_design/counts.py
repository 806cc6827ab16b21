"""Ranges of the counts that optima, fronts and fits take, in functions as in commands."""

SAMPLES = 1, 1_000_000
"""Cells of a survey."""
FOLLOW = 1, 1_000
"""Places at which a search begins."""
POINTS = 2, 10_000
"""Points of a front."""
STARTS = 0, 100_000
"""Further guesses of a fit."""
STEPS = 1, 100_000
"""Runs with derivatives that one guess of a fit takes at most."""
SEED = 0, 10**12
"""Choice of cells, or of guesses."""
BOOTSTRAP = 0, 100_000
"""Fits to resampled residuals."""
