"""The response functions from which every closed-form segment is made, and their closed forms.

With Q(s) = s^2 + 2 sigma s + K and W(s) = s^2 + omega^2, the relative motion of a segment obeys
Q(d/dh) x_r = forcing. Its solution is a combination of a few functions of the duration h, named
here with their Laplace images:

    G  = 1/Q       response to a unit velocity       H  = 1/(s Q)     to a unit constant force
    B  = 1/(Q W)   omega B answers sin(omega h)      Bd = s/(Q W)     answers cos(omega h)
    H1, BI         integrals of H and B

and, for derivatives with respect to sigma, K and omega, their sensitivities

    G2 = 1/Q^2     H2 = 1/(s Q^2)     B2 = 1/(Q^2 W)     BW = 1/(Q W^2)

A trailing `d` is a derivative in h. The family is closed under differentiation in h
(`derivative`) and under addition of durations (`add`). Closed forms exist for each case of damping
and for forcing away from resonance; at the confluences (critical damping, resonance, short
durations) the power series with the addition theorem takes their place. `basis_proofs` proves
the closed forms and the addition theorem.
"""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp
from sympy.codegen.cfunctions import expm1

from capsule_sym._symbolic.model.symbols import h, omega

sigma = sp.Symbol("sigma", nonnegative=True)  # damping rate of a segment
K = sp.Symbol("K", positive=True)  # stiffness of a segment
s = sp.Symbol("s")  # Laplace variable

Q = s**2 + 2 * sigma * s + K
W = s**2 + omega**2

G, Gd, H, H1 = sp.symbols("G Gd H H1", real=True)
B, Bd, Bdd, BI = sp.symbols("B Bd Bdd BI", real=True)
G2, G2d, H2, B2, B2d, BW, BWd = sp.symbols("G2 G2d H2 B2 B2d BW BWd", real=True)
cosine, sine = sp.symbols("cosine sine", real=True)  # cos(omega h) and sin(omega h)/omega
versine, lag = sp.symbols("versine lag", real=True)  # integrals of sine
sine2, versine2, lag2 = sp.symbols("sine2 versine2 lag2", real=True)  # and their sensitivities

Family = dict[sp.Symbol, sp.Expr]

IMAGES: Family = {
    cosine: s / W,
    sine: 1 / W,
    versine: 1 / (s * W),
    lag: 1 / (s**2 * W),
    sine2: 1 / W**2,
    versine2: 1 / (s * W**2),
    lag2: 1 / (s**2 * W**2),
    G: 1 / Q,
    Gd: s / Q,
    H: 1 / (s * Q),
    H1: 1 / (s**2 * Q),
    B: 1 / (Q * W),
    Bd: s / (Q * W),
    Bdd: s**2 / (Q * W),
    BI: 1 / (s * Q * W),
    G2: 1 / Q**2,
    G2d: s / Q**2,
    H2: 1 / (s * Q**2),
    B2: 1 / (Q**2 * W),
    B2d: s / (Q**2 * W),
    BW: 1 / (Q * W**2),
    BWd: s / (Q * W**2),
}
"""Laplace image of each response function: its definition."""

FORCED = frozenset(name for name, image in IMAGES.items() if image.has(omega))
"""Responses to the forcing, which a drive that is constant in a segment does not have."""

INITIAL = {name: sp.Integer(1 if name in (Gd, cosine) else 0) for name in IMAGES}
"""Value of each response function at h = 0 (the limit of s times its image)."""

# Each row follows from the images, such as s^2/Q = 1 - (2 sigma s + K)/Q for Gd.
_IN_H = {
    cosine: -(omega**2) * sine,
    sine: cosine,
    versine: sine,
    lag: versine,
    sine2: h * sine / 2,
    versine2: sine2,
    lag2: versine2,
    G: Gd,
    Gd: -2 * sigma * Gd - K * G,
    H: G,
    H1: H,
    B: Bd,
    Bd: Bdd,
    Bdd: Gd - omega**2 * Bd,
    BI: B,
    G2: G2d,
    G2d: G - 2 * sigma * G2d - K * G2,
    H2: G2,
    B2: B2d,
    B2d: G2 - omega**2 * B2,
    BW: BWd,
    BWd: B - omega**2 * BW,
}
# By K the derivative of 1/Q is -1/Q^2, by sigma 2 s times that; by omega that of 1/W -2 omega/W^2.
_OVER_Q = {G: G2, Gd: G2d, H: H2, B: B2, Bd: B2d, Bdd: _IN_H[B2d]}
_OVER_W = {cosine: h * sine / 2, sine: sine2, versine: versine2, lag: lag2, B: BW, Bd: BWd}
_OVER_W[Bdd] = _IN_H[BWd]
_IN_K = dict.fromkeys((cosine, sine, versine, lag), sp.S.Zero)
_IN_K |= {name: -over for name, over in _OVER_Q.items()}
_IN_SIGMA = {
    name: 2 * sp.Add(*(sp.diff(rule, one) * _IN_H[one] for one in rule.free_symbols & _IN_H.keys()))
    for name, rule in _IN_K.items()
}
_IN_OMEGA = dict.fromkeys((G, Gd, H), sp.S.Zero)
_IN_OMEGA |= {name: -2 * omega * over for name, over in _OVER_W.items()}
RULES: dict[sp.Symbol, dict[sp.Symbol, sp.Expr]] = {
    h: _IN_H,
    K: _IN_K,
    sigma: _IN_SIGMA,
    omega: _IN_OMEGA,
}
"""Derivatives of response functions by h, K, sigma and omega, where they are in the family."""

RELATIONS = {
    # B'' + omega^2 B = G, and Q(d/dh) applied to the step response.
    Bdd: G - omega**2 * B,
    H: (1 - Gd - 2 * sigma * G) / K,
    H1: (h - G - 2 * sigma * H) / K,
    BI: (H - Bd) / omega**2,
    H2: (H - 2 * sigma * G2 - G2d) / K,
    versine: (1 - cosine) / omega**2,
    lag: (h - sine) / omega**2,
    sine2: (sine - h * cosine) / (2 * omega**2),
    versine2: (versine - h * sine / 2) / omega**2,
    lag2: (lag - sine2) / omega**2,
}
"""Response functions that combine others; evaluated separately where these cancel."""


def derivative(expression: sp.Expr, variable: sp.Symbol) -> sp.Expr:
    """Total derivative of an expression in the response functions, by `RULES`.

    `variable` is one of h, K, sigma, omega. Raises KeyError for a response function whose
    derivative leaves the family.
    """
    rules = RULES[variable]
    total = sp.diff(expression, variable)
    for name in sorted(expression.free_symbols & IMAGES.keys(), key=str):
        total += sp.diff(expression, name) * rules[name]
    return total


def reduce(expression: sp.Expr) -> sp.Expr:
    """Expression in the independent response functions G, Gd, B, Bd, G2, G2d, B2, B2d, ..."""
    for name in (Bdd, BI, H1, H2, H, lag2, versine2, versine, lag, sine2):
        expression = expression.subs(name, RELATIONS[name])
    return expression


def add(first: Mapping[sp.Symbol, sp.Expr], second: Mapping[sp.Symbol, sp.Expr]) -> Family:
    """G, Gd, H, B, Bd, cosine and sine of h1 + h2 from those of h1 (`first`) and h2 (`second`).

    The state reached after h1 moves on freely for h2, and the forcing that acts meanwhile is
    that of a later phase. `second` also has Bdd.
    """
    f, g = first, second
    position = 1 - K * g[H]  # free response to a unit displacement
    return {
        G: position * f[G] + g[G] * f[Gd],
        Gd: -K * g[G] * f[G] + g[Gd] * f[Gd],
        H: position * f[H] + g[G] * f[G] + g[H],
        B: position * f[B] + g[G] * f[Bd] + f[cosine] * g[B] + f[sine] * g[Bd],
        Bd: -K * g[G] * f[B] + g[Gd] * f[Bd] + f[cosine] * g[Bd] + f[sine] * g[Bdd],
        cosine: f[cosine] * g[cosine] - omega**2 * f[sine] * g[sine],
        sine: f[cosine] * g[sine] + f[sine] * g[cosine],
    }


nu = sp.Symbol("nu", positive=True)  # sqrt(|K - sigma^2|): frequency, or half the rates' distance
slow = sp.Symbol("slow", negative=True)  # slow eigenvalue -K/(sigma + nu) of an overdamped segment
Z2 = sp.Symbol("Z2", positive=True)  # |Q(i omega)|^2
q = sp.Symbol("q", real=True)  # K - sigma^2

OSCILLATING = {
    G: sp.exp(-sigma * h) * sp.sin(nu * h) / nu,
    Gd: sp.exp(-sigma * h) * sp.cos(nu * h) - sigma * G,
    H: (1 - Gd - 2 * sigma * G) / K,
}
"""Closed form for K > sigma^2, eigenvalues -sigma +- i nu; a line may use those above it."""

OVERDAMPED = {
    # Written so that neither exp overflows nor nearly equal rates cancel.
    G: -sp.exp(slow * h) * expm1(-2 * nu * h) / (2 * nu),
    Gd: sp.exp((slow - 2 * nu) * h) + slow * G,
    H: (slow * G - expm1(slow * h)) / K,
}
"""Closed form for K < sigma^2, eigenvalues slow and slow - 2 nu; a line may use those above it."""


def _split(image: sp.Expr) -> dict[sp.Symbol, sp.Expr]:
    """Coefficients, times Z2, of s/W, 1/W, s/Q and 1/Q in 1/(Q W), s/(Q W) or s^2/(Q W)."""
    unknowns = sp.symbols("a_cosine a_sine a_Gd a_G")
    names = (cosine, sine, Gd, G)
    ansatz = sum(a * IMAGES[name] for a, name in zip(unknowns, names, strict=True))
    numerator = sp.Poly(sp.numer(sp.together(ansatz - image)), s)
    solution = sp.solve(numerator.coeffs(), unknowns, dict=True)[0]
    norm = sp.expand((K - omega**2) ** 2 + 4 * sigma**2 * omega**2)
    coefficients = {}
    for name, a in zip(names, unknowns, strict=True):
        # The polynomial division is exact: the only pole is |Q(i omega)|^2.
        coefficients[name] = sp.expand(sp.cancel(solution[a] * norm))
    return coefficients


def detached() -> Family:
    """B, Bd and Bdd away from resonance, in G, Gd, H and the forcing, derived by partial fractions.

    B and Bd are written with K H = 1 - Gd - 2 sigma G and omega^2 versine = 1 - cosine, both small
    where strong damping or slow forcing would make their parts cancel.
    """
    settled = sp.Symbol("settled")  # K H
    begun = sp.Symbol("begun")  # omega^2 versine
    small = {Gd: 1 - settled - 2 * sigma * G, cosine: 1 - begun}
    closed = {}
    for name in (B, Bd, Bdd):
        parts = _split(IMAGES[name])
        combined = sum(coefficient * part for part, coefficient in parts.items())
        if name is not Bdd:
            combined = combined.subs(small)
        combined = sp.expand(combined)
        combined = sum(
            sp.factor(combined.coeff(part)) * part for part in (begun, settled, cosine, sine, G, Gd)
        )
        closed[name] = combined.subs({settled: K * H, begun: omega**2 * versine}) / Z2
    return closed


def sensitivities() -> dict[sp.Symbol, sp.Expr]:
    """G2, G2d, H2, B2, B2d, BW and BWd away from confluences; a line may use those above it."""
    parts = _split(IMAGES[B])
    apart = {name: coefficient / Z2 for name, coefficient in parts.items()}
    # 1/(Q W) = (a s + b)/W + (c s + d)/Q, divided once more by Q or by W.
    return {
        G2: (G - h * (Gd + sigma * G)) / (2 * q),
        G2d: h * G / 2 - sigma * G2,
        H2: RELATIONS[H2],
        B2: apart[cosine] * Bd + apart[sine] * B + apart[Gd] * G2d + apart[G] * G2,
        B2d: apart[cosine] * Bdd + apart[sine] * Bd + apart[Gd] * _IN_H[G2d] + apart[G] * G2d,
        BW: apart[cosine] * h * sine / 2 + apart[sine] * sine2 + apart[Gd] * Bd + apart[G] * B,
        BWd: apart[cosine] * (sine + h * cosine) / 2
        + apart[sine] * h * sine / 2
        + apart[Gd] * Bdd
        + apart[G] * Bd,
    }


def double() -> dict[sp.Symbol, sp.Expr]:
    """G, Gd, H, B, Bd, cosine and sine of 2 h in those of h, and Bdd, by the addition theorem."""
    same = {name: name for name in (G, Gd, H, B, Bd, Bdd, cosine, sine)}
    return add(same, same)


def double_sensitivities() -> dict[sp.Symbol, sp.Expr]:
    """Sensitivities of 2 h, sine2 among them, in the response functions and sensitivities of h.

    The addition theorem is differentiated with respect to K and omega, both durations at once.
    """
    whole = double()
    by_K = {G2: G, G2d: Gd, H2: H, B2: B, B2d: Bd}
    by_omega = {BW: B, BWd: Bd, sine2: sine}
    found = {of: -derivative(whole[name], K) for of, name in by_K.items()}
    found |= {of: -derivative(whole[name], omega) / (2 * omega) for of, name in by_omega.items()}
    return {name: sp.expand(form) for name, form in found.items()}
