"""Digits of the map's numbers: 50 correct ones need a few more."""

GUARD_DIGITS = 10
MOST_DIGITS = 50 + GUARD_DIGITS
"""Digits in the computation of 50 correct ones."""
