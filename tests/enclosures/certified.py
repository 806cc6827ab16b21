"""Certificates of every kind, and the checker to which they are put."""

import json
import random
from collections.abc import Iterator
from functools import cache
from types import ModuleType
from typing import Any

import capsule_sym as cs
from capsule_sym._enclosures.certificates import checker
from tests.enclosures.case import bifurcations as found


@cache
def orbit(alpha: float) -> dict[str, Any]:
    """Certificate of the orbit at an amplitude."""
    return cs.certify_orbit(cs.solve_orbit(cs.Parameters(alpha=alpha)))


@cache
def unstable() -> dict[str, Any]:
    """Certificate of an orbit between two period doublings."""
    found = cs.solve_orbit(cs.Parameters(alpha=0.0428, zeta=0.005))
    values = [0.045, *found.values[1:]]
    return cs.certify_orbit(cs.orbits.solve_itinerary(values, found.itinerary, list(found.z)))


@cache
def bifurcations() -> list[dict[str, Any]]:
    """Certificates of the bifurcations of Section 4, in their order."""
    return [cs.certify_bifurcation(one)[0] for one in found()]


@cache
def run() -> dict[str, Any]:
    """Certificate of a run of seven segments."""
    return cs.certify_run(cs.simulate(cs.Parameters(alpha=1.2), (0.01, 0.0, 1e-5), 0.3, periods=1))


@cache
def produced() -> dict[str, dict[str, Any]]:
    """Certificates of every kind."""
    orbits = {f"orbit {alpha}": orbit(alpha) for alpha in (0.003, 0.7, 1.2)}
    events = {f"bifurcation {k}": one for k, one in enumerate(bifurcations())}
    return {**orbits, "unstable orbit": unstable(), **events, "run": run()}


def refused(certificate: Any, module: ModuleType) -> bool:
    """True if one checker rejects a certificate."""
    try:
        module.check_certificate(certificate)
    except module.Rejected:
        return True
    return False


def rejected(certificate: Any) -> bool:
    """True if the checker rejects a certificate."""
    return refused(certificate, checker)


def digits_changed(certificate: dict, count: int) -> Iterator[dict]:
    text = json.dumps(certificate)
    rng = random.Random(11)
    for place in rng.sample([i for i, c in enumerate(text) if c.isdigit()], count):
        digit = rng.choice([d for d in "0123456789" if d != text[place]])
        yield json.loads(text[:place] + digit + text[place + 1 :])
