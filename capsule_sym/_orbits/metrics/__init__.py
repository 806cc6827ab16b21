"""Performance of a periodic motion, with gradients."""
