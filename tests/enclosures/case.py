"""The case that is proved: the parameters as decimals, and its bifurcations."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from capsule_sym import Parameters, continue_orbit, results, solve_orbit
from capsule_sym._enclosures.numbers.balls import precision
from capsule_sym._enclosures.orbits.events import Proved, prove_event

EXACT = {"omega": "0.8", "delta": "0.02", "zeta": "0.05", "beta": "1.5", "f_b": "1"}


def precise(number: int) -> Callable[..., object]:
    """A fixture for the tests of a file: so many bits in ball arithmetic."""

    @pytest.fixture(autouse=True)
    def bits() -> Iterator[None]:
        with precision(number):
            yield

    return bits


def bifurcations(first: float = 0.001, last: float = 2.0) -> tuple[results.Bifurcation, ...]:
    """Bifurcations between two amplitudes, in double precision."""
    return continue_orbit(solve_orbit(Parameters(alpha=first)), "alpha", last).bifurcations


def threshold(found: results.Bifurcation, exact: dict[str, Any]) -> Proved:
    """Bifurcation with a segment of duration 0, proved."""
    assert found.segment is not None
    with precision(320):
        return prove_event(found.orbit, (found.segment,), (found.parameter,), exact)
