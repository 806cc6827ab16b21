"""Boundedness for every stiffness, and one global attractor without the second spring.

Two motions under the same forcing are compared by the energy of their difference. Dry friction is
monotone and the one spring linear, so without the second spring this energy never grows. With it
the difference of the spring forces is no multiple of the difference of the states, and nothing
similar is claimed.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import sympy as sp

from capsule_sym._symbolic.theory import (
    SEGMENTS,
    STATE,
    Linear,
    Statement,
    alpha,
    beta,
    delta,
    f_b,
    gamma,
    omega,
    tau,
    v_c,
    v_r,
    vanishes,
    x_r,
    zeta,
)

_OTHER = {symbol: sp.Symbol(f"{symbol}_2", real=True) for symbol in STATE}
_PUSH = sp.Symbol("w", real=True)  # |w| <= alpha + f_b/gamma
_SPRING = sp.Function("g")(x_r)  # the force of both springs
_INERTIA = 1 + 1 / gamma

ENERGY = (x_r**2 + (v_r + v_c) ** 2 + gamma * v_c**2) / 2
"""Energy of a difference (x_r, v_r, v_c) of two motions; v_r + v_c is the inner mass's."""
BOUND = v_r**2 / 2 + (v_r + 2 * _INERTIA * zeta * x_r) ** 2 / 2
"""With twice the springs' energy, a bound of the inner mass's motion relative to the capsule."""

RESTING = (v_r + v_c) ** 2 / 2 + gamma * v_c**2 / 2 + zeta * x_r * (v_r + v_c) + (zeta * x_r) ** 2
"""With the springs' energy, a function that decreases to rest if the force is small."""


def _at_rest(one: Linear, other: Linear) -> dict[sp.Symbol, int]:
    """Symbols that are 0 if the two motions are in these segments."""
    speeds = ((one, v_c), (other, _OTHER[v_c]))
    return {speed: 0 for segment, speed in speeds if segment.stick}


def _braking(one: Linear, other: Linear) -> sp.Expr:
    """Difference of both drifts times the difference of the friction forces on them."""
    return (v_c - _OTHER[v_c]) * (other.friction.subs(_OTHER) - one.friction)


def _brakes(one: Linear, other: Linear) -> bool:
    """True if that is a sum of products of a speed and a friction margin of the other motion.

    No speed |v_c| = drift v_c is negative, and no margin f_b + drift friction.
    """
    products = one.drift * v_c * (f_b + one.drift * other.friction.subs(_OTHER))
    products += other.drift * _OTHER[v_c] * (f_b + other.drift * one.friction)
    return vanishes((_braking(one, other) - products).subs(_at_rest(one, other)))


def _loses_energy(energy: sp.Expr) -> bool:
    """Check that, for beta = 0, only damper and friction change the energy of a difference."""
    apart = {symbol: symbol - twin for symbol, twin in _OTHER.items()}
    slopes = [energy.diff(symbol).subs(apart, simultaneous=True) for symbol in STATE]

    def lost(one: Linear, other: Linear) -> bool:
        rates = [a - b.subs(_OTHER) for a, b in zip(one.field, other.field, strict=True)]
        gained = sum((s * rate for s, rate in zip(slopes, rates, strict=True)), sp.S.Zero)
        told = 2 * zeta * (v_r - _OTHER[v_r]) ** 2 + _braking(one, other)
        return vanishes((gained + told).subs(beta, 0).subs(_at_rest(one, other)))

    pairs = list(product(SEGMENTS, repeat=2))
    return all(lost(*pair) and _brakes(*pair) for pair in pairs)


def _rigid() -> bool:
    """Check that, for beta = 0, motions of the same v_r differ in v_r + v_c at the rate -x_r."""

    def rate(segment: Linear) -> sp.Expr:
        return (segment.field[1] + segment.field[2]).subs(beta, 0)

    same = {_OTHER[v_r]: v_r}
    return all(
        vanishes((rate(one) - rate(other).subs(_OTHER)).subs(same) + x_r - _OTHER[x_r])
        for one, other in product(SEGMENTS, repeat=2)
    )


def _momentum() -> bool:
    """Check that v_r + (1 + gamma) v_c changes by alpha cos(omega tau) and friction."""
    return all(
        vanishes(
            segment.field[1]
            + (1 + gamma) * segment.field[2]
            - alpha * sp.cos(omega * tau)
            - segment.friction
        )
        for segment in SEGMENTS
    )


def falls_far_out(bound: sp.Expr) -> bool:
    """Check that the bound decreases for large |x_r| or |v_r|, and the momentum is as stated.

    With g the springs' force, of energy G, and |w| <= alpha + f_b/gamma,
    bound + 2 (1 + 1/gamma) G changes at the rate
    -2 m zeta v_r^2 - 2 m^2 zeta x_r g + 2 w (v_r + m zeta x_r), m = 1 + 1/gamma; and x_r g is at
    least x_r^2.
    """
    m = _INERTIA
    by_friction = all(
        vanishes(s.field[1] + m * s.interaction - alpha * sp.cos(omega * tau) + s.friction / gamma)
        for s in SEGMENTS
    )
    forces = all(
        vanishes(s.interaction - 2 * zeta * v_r - x_r - beta * (x_r - delta) * int(s.contact))
        for s in SEGMENTS
    )
    rate = -m * (_SPRING + 2 * zeta * v_r) + _PUSH
    gained = bound.diff(x_r) * v_r + bound.diff(v_r) * rate + 2 * m * _SPRING * v_r
    told = -2 * m * zeta * v_r**2 - 2 * m**2 * zeta * x_r * _SPRING
    told += 2 * _PUSH * (v_r + m * zeta * x_r)
    return by_friction and forces and vanishes(gained - told) and _momentum()


def comes_to_rest(bound: sp.Expr) -> bool:
    """Check that the bound and the springs' energy change as the proof states, in every field."""

    def told(one: Linear) -> bool:
        spring = one.interaction - 2 * zeta * v_r
        rates = zip(STATE, one.field, strict=True)
        gained = sum((bound.diff(x) * rate for x, rate in rates), spring * v_r)
        change = alpha * sp.cos(omega * tau) * (v_r + v_c + zeta * x_r) - zeta * v_r**2
        change += zeta * v_r * v_c - zeta * x_r * spring + one.friction * v_c
        return vanishes((gained - change).subs({v_c: 0} if one.stick else {}))

    return all(map(told, SEGMENTS))


def tends_to_one_orbit(energy: sp.Expr) -> bool:
    """Check that, for beta = 0, an energy of differences and other steps are as in the proof."""
    return _loses_energy(energy) and _rigid() and falls_far_out(BOUND)


def attraction() -> Iterator[Statement]:
    """Boundedness, rest under a small force, and one orbit for beta = 0."""
    yield Statement(
        "attraction.bounded",
        "beyond the paper",
        "for zeta > 0 every motion enters one bounded set of (x_r, v_r, v_c) and stays there",
        falls_far_out,
        {"bound": BOUND},
        {"bound": BOUND - x_r * v_r * zeta},
        formula=rf"{sp.latex(BOUND)}+2\left(1+\tfrac{{1}}{{\gamma}}\right)G(x_r)",
        proof="with m = 1 + 1/gamma the bound changes at the rate -2 m zeta v_r^2 - 2 m^2 zeta x_r "
        "g(x_r) + 2 w (v_r + m zeta x_r), |w| <= alpha + f_b/gamma, x_r g >= x_r^2: negative "
        "outside an ellipse. So x_r, v_r and the forces are bounded in the end. A drift that is "
        "fast enough keeps its direction for a period, in which v_r + (1 + gamma) v_c loses f_b 2 "
        "pi/omega",
    )
    yield Statement(
        "attraction.rest",
        "beyond the paper",
        "for zeta > 0 and a force so small that its bound on the springs is below f_b, the capsule "
        "of every motion comes to rest for good",
        comes_to_rest,
        {"bound": RESTING},
        {"bound": RESTING - (zeta * x_r) ** 2},
        formula=rf"W={sp.latex(RESTING)}+G(x_r)",
        proof="with G the energy of both springs, of force g, W changes at the rate alpha "
        "cos(omega tau) (v_r + v_c + zeta x_r) - zeta v_r^2 + zeta v_r v_c - zeta x_r g - "
        "f_b |v_c|, at most alpha |v_r| + zeta alpha |x_r| - zeta v_r^2 - zeta x_r^2 - "
        "(f_b - alpha - zeta |v_r|) |v_c|. In the end |v_r| is bounded "
        "(attraction.bounded); if there zeta |v_r| < f_b - alpha, W falls to its largest "
        "value where that rate is not negative. If for all such W the force |g + 2 zeta "
        "v_r| < f_b, a capsule that moves loses its speed at a rate, and one at rest "
        "stays so",
    )
    yield Statement(
        "attraction.beta0",
        "beyond the paper",
        "for beta = 0 and zeta > 0 there is one orbit of period 2 pi/omega in (x_r, v_r, v_c), and "
        "every motion tends to it",
        tends_to_one_orbit,
        {"energy": ENERGY},
        {"energy": ENERGY.subs(gamma, 1)},
        formula=r"\dot E=-2\zeta\,\Delta v_r^2-\Delta v_c\,\Delta f\le 0,\quad E="
        + sp.latex(ENERGY),
        proof="the energy E of the difference of two motions never grows: the damper loses 2 zeta "
        "(difference of v_r)^2, friction f a sum of products of a speed and a margin. So the map "
        "over a period does not expand; its motions are bounded, so that it has a fixed point "
        "(Browder). On the limit set of any other motion E is constant against that orbit: v_r is "
        "the same, so x_r differs by a constant d and v_r + v_c changes its difference at the rate "
        "-d; E constant makes d = 0, v_c differ by a constant c, and f equal. If c > 0, no instant "
        "has |f| < f_b, where both stick; f = f_b needs the faster v_c >= c, f = -f_b needs it <= "
        "0; v_c is continuous, so that f is one of them for ever, and the momentum v_r + (1 + "
        "gamma) v_c is not bounded. So c = 0",
    )
