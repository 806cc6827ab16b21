"""Balls written as decimals."""

from __future__ import annotations

from capsule_sym._enclosures.interface import Ball, Unproved, arb

_LEAST, _MOST = 30, 56  # decimals that are written


def decimal(value: Ball) -> str:
    """A decimal within 0.2 units of its last digit of every number in a narrow ball."""
    for places in range(_LEAST, _MOST):
        scaled = value * arb(10) ** places
        whole = (scaled + arb("0.5")).floor().unique_fmpz()
        if whole is not None and abs(scaled - whole) < arb("0.2"):
            digits = str(abs(int(whole))).rjust(places + 1, "0")
            return f"{'-' if int(whole) < 0 else ''}{digits[:-places]}.{digits[-places:]}"
    raise Unproved("certificate", "the enclosure is too wide to be written")
