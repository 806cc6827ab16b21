"""The generated power series against the expansions of the Laplace images at infinity."""

from math import factorial
from types import SimpleNamespace
from typing import Any

import pytest
import sympy as sp
from mpmath import mp

from capsule_sym._parameters import CAPSULE
from capsule_sym._symbolic.model import basis
from capsule_sym._symbolic.model.symbols import h, omega

TERMS = 14
SERIES = ("G", "Gd", "H", "H1", "B", "Bd", "Bdd", "BI")
SENSITIVITIES = ("G2", "G2d", "H2", "B2", "B2d", "BW", "BWd")
FORCING = ("lag", "sine2", "versine2", "lag2")

RING, SIGMA, STIFFNESS, OMEGA, TIME = sp.ring([basis.sigma, basis.K, omega, h], sp.QQ)


def expansion(name: str) -> Any:
    """Terms below h^TERMS: an image's coefficient of 1/s^(n+1), times h^n/n!."""
    z = sp.Symbol("z")
    image = basis.IMAGES[sp.Symbol(name, real=True)]
    # In powers of z = 1/s by division of polynomials whose lowest term is 1.
    numerator, denominator = sp.fraction(sp.cancel(sp.together(image.subs(basis.s, 1 / z) / z)))
    lead = denominator.subs(z, 0)
    top = sp.Poly(sp.expand(numerator / lead), z).all_coeffs()[::-1]
    bottom = sp.Poly(sp.expand(denominator / lead), z).all_coeffs()[::-1]
    coefficients: list[Any] = []
    total = RING.zero
    for n in range(TERMS):
        value = RING.from_expr(top[n]) if n < len(top) else RING.zero
        for k in range(1, min(n, len(bottom) - 1) + 1):
            value -= RING.from_expr(bottom[k]) * coefficients[n - k]
        coefficients.append(value)
        total += value * TIME**n / factorial(n)
    return total


def truncated(series: Any) -> Any:
    return RING.from_dict({m: value for m, value in series.items() if m[-1] < TERMS})


@pytest.fixture(params=[(), (mp,)], ids=["doubles", "mpmath"])
def kernels(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Any:
    found = CAPSULE.kernels_by(*request.param)
    # Each term lost to an integration or a factor h is one that must be there beforehand.
    monkeypatch.setattr(type(found), "terms", TERMS + 1)
    return found


def evaluated(kernels: Any) -> dict[str, Any]:
    constants = SimpleNamespace(sigma=SIGMA, K=STIFFNESS, omega=OMEGA)
    values = dict(zip(SERIES, kernels.series(constants, TIME), strict=True))
    values |= zip(SENSITIVITIES, kernels.sensitivity_series(constants, TIME), strict=True)
    values |= zip(FORCING, kernels.forcing_series((OMEGA * TIME) ** 2, TIME), strict=True)
    return values


@pytest.mark.parametrize("name", [*SERIES, *SENSITIVITIES, *FORCING])
def test_series_is_the_expansion_of_the_image(kernels: Any, name: str) -> None:
    assert truncated(evaluated(kernels)[name]) == expansion(name)


def test_wrong_term_is_seen(kernels: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """One term of each recurrence, changed, shows in what is summed from it."""
    for name in ("free_terms", "forced_terms"):
        terms = getattr(kernels, name)
        monkeypatch.setattr(
            kernels,
            name,
            lambda *given, terms=terms: [a * (1 + (n == 5)) for n, a in enumerate(terms(*given))],
        )
    for name, series in evaluated(kernels).items():
        if name not in FORCING:
            assert truncated(series) != expansion(name), name
