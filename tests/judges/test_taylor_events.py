"""The event judge's own parts: roots of polynomials with known roots, and degenerate starts."""

from collections.abc import Iterator, Sequence
from typing import Any

import pytest
from mpmath import mp, mpf

from capsule_sym import Parameters
from tests.judges import taylor_events
from tests.judges.taylor_events import Undecided, _deflate, _first_root, _next_field

CASE = Parameters(alpha=0.7, gamma=3.0, zeta=0.25, delta=0.5)


@pytest.fixture(autouse=True)
def _fifty_digits() -> Iterator[None]:
    with mp.workdps(65):
        yield


def product(*factors: Sequence[Any]) -> list[Any]:
    """Coefficients, lowest power first, of a product of polynomials given in the same way."""
    result = [mpf(1)]
    for factor in factors:
        wide = [mpf(0)] * (len(result) + len(factor) - 1)
        for i, a in enumerate(result):
            for j, b in enumerate(factor):
                wide[i + j] += a * mpf(b)
        result = wide
    return result


def falling(root: Any) -> list[Any]:
    return [root, -1]


@pytest.mark.parametrize("distance", ["1e-3", "1e-9", "1e-15"])
def test_a_pair_of_roots_is_found_however_close(distance: str) -> None:
    root, twin = mpf("0.3"), mpf("0.3") + mpf(distance)
    polynomial = product(falling(root), falling(twin), [3, 1, 2], falling(mpf("0.77")), [2, -1])
    assert abs(_first_root(polynomial) - root) < mpf("1e-45")


@pytest.mark.parametrize("height", ["1e-6", "1e-18", "1e-30"])
def test_a_minimum_above_zero_is_no_root(height: str) -> None:
    root = mpf("0.3")
    bowl = [root**2 + mpf(height), -2 * root, 1]
    assert _first_root(product(bowl, [3, 1, 2])) is None
    through = [root**2 - mpf(height), -2 * root, 1]
    assert abs(_first_root(product(through, [3, 1, 2])) - root + mp.sqrt(mpf(height))) < 1e-30


def test_a_root_outside_the_step_is_none() -> None:
    assert _first_root(product(falling(mpf("1.0001")), [1, mpf("0.01")])) is None


def test_an_exact_double_root_is_undecided() -> None:
    root = mpf("0.3")
    with pytest.raises(Undecided, match="subdivi"):
        _first_root(product(falling(root), falling(root)))


@pytest.mark.parametrize("multiplicity", [1, 2, 3])
def test_the_root_at_the_start_is_divided_out(multiplicity: int) -> None:
    root = mpf("1e-8")
    rest = product(falling(root), [1, 1])
    deflated = _deflate([mpf("1e-60")] * multiplicity + rest, mpf("1e-50"))
    assert deflated == rest
    assert abs(_first_root(deflated) - root) < mpf("1e-50")


# On P1 = 0, from the regions of Eqs. (7)-(12) and, on their borders, from the sign of the first
# derivative that does not vanish. With zeta = 1/4: P3 = x_r + v_r / 2, and in stick
# P3' = v_r + (alpha cos(omega tau) - P3) / 2, at tau = 0 v_r - 0.15 on P3 = 1, v_r + 0.85 on -1.
@pytest.mark.parametrize(
    ("state", "field"),
    [
        ((0.0, 0.0, 0.0), 2),  # S2
        ((-0.5, 4.0, 0.0), 1),  # S1
        ((-0.5, -4.0, 0.0), 3),  # S3
        ((0.75, 2.0, 0.0), 4),  # S4
        ((0.6, 0.0, 0.0), 5),  # S5
        ((0.75, -9.0, 0.0), 6),  # S6
        ((0.5, 4.0, 0.1), 4),  # S7
        ((0.5, -4.0, 0.1), 1),  # S8
        ((0.5, 4.0, -0.1), 6),  # S9
        ((0.5, -4.0, -0.1), 3),  # S10
        ((0.0, 2.0, 0.0), 1),  # L1, P3 grows
        ((-1.5, 1.0, 0.0), 2),  # L2, P3 grows: back into stick
        ((0.0, -2.0, 0.0), 3),  # L2, P3 falls
        ((0.5, 4.0, 0.0), 4),  # L5
        ((0.5, 0.5, 0.0), 5),  # L6
        ((0.5, -0.5, 0.0), 2),  # L7
        ((0.5, -4.0, 0.0), 3),  # L8
        ((0.5, 0.0, 0.2), 4),  # L9 in forward drift: x_r'' = alpha - 4/3 P3 + 1/3 > 0
        ((0.5, 0.0, -0.2), 3),  # L9 in backward drift: x_r'' = alpha - 4/3 P3 - 1/3 < 0
        ((0.5, 1.0, 0.0), 4),  # O1, P3 grows
        ((0.5, -3.0, 0.0), 3),  # O2, P3 falls
    ],
)
def test_the_field_after_a_degenerate_start(state: tuple[float, ...], field: int) -> None:
    assert _next_field(CASE, (*map(mpf, state), mpf(0)), mpf(0), mpf("1e-50")) == field


def test_rest_without_forcing_never_ends() -> None:
    run = taylor_events.run(Parameters(alpha=0.0, delta=0.0), periods=2)
    assert run.fields == "5"
    assert run.final == (0, 0, 0, 0)
