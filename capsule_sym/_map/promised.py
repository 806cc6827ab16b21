"""Digits of the map's numbers where 50 are promised."""

GUARD_DIGITS = 10
MOST_DIGITS = 50 + GUARD_DIGITS
"""What 50 digits are computed with."""
