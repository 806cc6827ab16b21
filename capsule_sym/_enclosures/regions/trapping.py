"""Where every motion is in the end under a small force: a set in which the capsule stays at rest.

With m = 1 + 1/gamma, q = alpha + f_b/gamma and G the energy of both springs, of force g,
B = v_r^2/2 + (v_r + 2 m zeta x_r)^2/2 + 2 m G changes at most at the rate
-2 m zeta v_r^2 - 2 m^2 zeta x_r^2 + 2 q (|v_r| + m zeta |x_r|), so that in the end |v_r| has a
bound (`verify --only attraction.bounded`). With u = v_r + v_c of the inner mass,
W = u^2/2 + gamma v_c^2/2 + G + zeta x_r u + zeta^2 x_r^2 changes at the rate
alpha cos(omega tau) (u + zeta x_r) - zeta v_r^2 + zeta v_r v_c - zeta x_r g - f_b |v_c|
(`verify --only attraction.rest`), at most at
alpha |v_r| + zeta alpha |x_r| - zeta v_r^2 - zeta x_r^2 - (f_b - alpha - zeta |v_r|) |v_c|.
In the end W is below its largest value where that is not negative. If there |g + 2 zeta v_r| < f_b,
a capsule that moves loses its speed, and one at rest stays so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from capsule_sym._enclosures.numbers.balls import Ball, Unproved, arb, upper

_ARCS = 256  # of a quarter of an ellipse
_MARGIN = 1 + 1e-6  # so that a bound is passed in a finite time


@dataclass(frozen=True)
class Trap:
    """Every motion ends at rest of the capsule, with W at most `level`.

    There x_r is between -`back` and `ahead`, |v_r| at most `speed`, and the force on the capsule at
    most `force` of f_b.
    """

    level: float
    back: float
    ahead: float
    speed: float
    force: float


def trap(values: Mapping[str, Ball]) -> Trap:
    """The set that every motion enters for good; raises Unproved. `values` are all parameters."""
    alpha, delta, zeta, beta, gamma, f_b = (
        values[name] for name in ("alpha", "delta", "zeta", "beta", "gamma", "f_b")
    )
    if not (zeta > 0 and delta >= 0 and beta >= 0):
        raise Unproved("trapping", "zeta is not positive")
    left = f_b - alpha - zeta * _fastest(values)
    if not left > 0:
        raise Unproved("trapping", "the motions are too fast for friction to be seen to win")
    radius = (alpha**2 / (4 * zeta**2) + alpha**2 / 4).sqrt()
    slip = zeta * radius**2 / left

    def height(v: Ball, x: Ball) -> Ball:
        inner, beyond = v + slip, _positive(x - delta)
        energy = (inner * inner + gamma * slip * slip + x * x + beta * beyond * beyond) / 2
        return energy + zeta * x * inner + zeta * zeta * x * x

    # The rate of W is not negative only in a disc of (|v_r|, |x_r|), and for |v_c| up to `slip`.
    return _within(_highest(height, (alpha / (2 * zeta), alpha / 2), (radius, radius)), values)


def _fastest(values: Mapping[str, Ball]) -> Ball:
    """What |v_r| is at most in the end, by B, of which the rate is negative outside an ellipse."""
    m, push = 1 + 1 / values["gamma"], values["alpha"] + values["f_b"] / values["gamma"]
    damping = m * values["zeta"]
    left = push**2 / (2 * damping) + push**2 * values["zeta"] / 2
    axes = (left / (2 * damping)).sqrt(), (left / (2 * m * damping)).sqrt()

    def bound(v: Ball, x: Ball) -> Ball:
        other, beyond = v + 2 * damping * x, _positive(x - values["delta"])
        return (v * v + other * other) / 2 + m * (x * x + values["beta"] * beyond * beyond)

    return (2 * _highest(bound, (push / (2 * damping), push / (2 * m)), axes)).sqrt()


def _highest(
    what: Callable[[Ball, Ball], Ball], middle: tuple[Ball, Ball], axes: tuple[Ball, Ball]
) -> Ball:
    """More than what grows with both of its arguments is in an ellipse, with `_MARGIN`."""

    def most(arc: int) -> float:
        begin, end = (arb(k) / (2 * _ARCS) for k in (arc, arc + 1))
        first, second = middle[0] + axes[0] * begin.cos_pi(), middle[1] + axes[1] * end.sin_pi()
        return upper(what(first, second))

    return arb(max(map(most, range(_ARCS)))) * arb(_MARGIN)


def _within(level: Ball, values: Mapping[str, Ball]) -> Trap:
    """The states at which W is at most a level; raises Unproved where they can set it in motion.

    W = (u + zeta x)^2/2 + (1 + zeta^2) x^2/2 + gamma v_c^2/2 + beta max(x - delta, 0)^2/2.
    """
    delta, zeta, beta, gamma, f_b = (
        values[name] for name in ("delta", "zeta", "beta", "gamma", "f_b")
    )
    stiff = 1 + zeta**2
    back = (2 * level / stiff).sqrt()
    root = (beta * delta) ** 2 + (stiff + beta) * (2 * level - beta * delta**2)
    beyond = (beta * delta + _positive(root).sqrt()) / (stiff + beta)
    ahead = back if back <= delta else beyond
    rest = (2 * level).sqrt() + zeta * _larger(ahead, back)
    spring = _larger(back, ahead + beta * _positive(ahead - delta))
    force = (spring + 2 * zeta * (rest + (2 * level / gamma).sqrt())) / f_b
    if not force < 1:
        raise Unproved("trapping", f"the force is not below {float(force):.3g} of the friction")
    return Trap(*map(upper, (level, back, ahead, rest, force)))


def _positive(value: Ball) -> Ball:
    """max(x, 0)."""
    return (value + abs(value)) / 2


def _larger(one: Ball, other: Ball) -> Ball:
    return (one + other + abs(one - other)) / 2
