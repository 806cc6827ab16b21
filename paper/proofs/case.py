"""The case that is proved: the parameters of Section 4 as decimals, and the ranges of two."""

from decimal import Decimal

from capsule_sym import Parameters

EXACT = {
    name: format(Decimal(repr(value)).normalize(), "f")
    for name, value in Parameters().to_dict().items()
    if name not in ("alpha", "gamma")
}
GAMMAS = ("3.3", "3.0")
ALPHA, GAMMA = (0.001, 2.0), (1.5, 5.0)
DRIVES = (1.9, 2.0), (0.75, 0.79)
"""Ranges of alpha and omega in which the best average velocity is proved."""
