"""The bounds of Appendix A, the parts of L1-L4 of Appendix B, and the bifurcations on them.

On each of L1-L4 the inner product of the normal that points out of stick with the field of stick
is +-(k v_r) - 2 zeta f_b +- 2 zeta alpha cos(omega tau), with k = 1 on L1, L2 and 1 + beta on
L3, L4. Bounds are compared after multiplication by 2 zeta or 4 zeta^2, so that every claim is
linear; statements that need damping state it.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from capsule_sym._symbolic.theory import (
    PIECES,
    Relation,
    alpha,
    beta,
    consistent,
    delta,
    f_b,
    force,
    leaves_of,
    v_r,
    zeta,
)
from paper.derived.inner_products import FIELDS, outward

EDGES = ("L1", "L2", "L3", "L4")
_STIFFNESS = {"L1": sp.S.One, "L2": sp.S.One, "L3": 1 + beta, "L4": 1 + beta}

_FOUR = 4 * zeta**2


@dataclass(frozen=True)
class StickBound:
    """Condition under which stick always ends (side 1) or begins (side -1) on a line.

    `reach` is 2 zeta k |v_r| where the range of v_r ends.
    """

    line: str
    side: int
    reach: sp.Expr

    @property
    def condition(self) -> tuple[sp.Expr, sp.Expr]:
        """Smaller (or equal) and larger side, free of fractions."""
        if self.side > 0:
            return _FOUR * (alpha + f_b), self.reach
        return self.reach, _FOUR * (f_b - alpha)

    @property
    def alpha_bound(self) -> sp.Expr:
        """The same solved for alpha."""
        return self.side * (self.reach / _FOUR - f_b)


BOUNDS = (
    StickBound("L1", +1, f_b - delta),
    StickBound("L4", +1, (1 + beta) * (f_b + delta)),
    StickBound("L2", -1, f_b + delta),
    StickBound("L3", -1, (1 + beta) * (f_b - delta)),
)
"""Appendix A for L1 and L4, and the corresponding bounds on L2 and L3."""


@dataclass(frozen=True)
class Part:
    """L_i^(j): the part of a line within bounds on k v_r, and the behaviour of stick there.

    `side` is +1 where stick always ends, -1 where it always begins, None where that depends on
    time. `ends` are the ends of the range of v_r of the middle part.
    """

    line: str
    number: int
    within: tuple[Relation, ...]
    side: int | None
    ends: tuple[sp.Expr, ...] = ()

    @property
    def name(self) -> str:
        """Name in the paper, such as `L2^(1)`."""
        return f"{self.line}^({self.number})"

    @property
    def relations(self) -> tuple[Relation, ...]:
        """Relations of the part."""
        return (*PIECES[self.line].relations, *self.within)

    @property
    def interval(self) -> str:
        """Range of v_r in LaTeX."""
        low, high = map(sp.latex, self.ends)
        return ("", rf"v_r<{low}", rf"{low}\le v_r\le {high}", rf"v_r>{high}")[self.number]


def _parts(line: str) -> tuple[Part, ...]:
    """Three parts, in order of v_r, from the extremes of the force over a period."""
    centre = outward(line).subs(alpha, 0)
    slope = sp.diff(centre, v_r)  # +k on L1, L3; -k on L2, L4
    sense = 1 if slope.is_positive else -1
    speed = _STIFFNESS[line] * v_r
    turn = sense * sp.expand(sense * speed - centre)  # where the product vanishes without force
    low, high = turn - 2 * zeta * alpha, turn + 2 * zeta * alpha
    below, above = (sp.factor(edge) / _STIFFNESS[line] for edge in (low, high))
    return (
        Part(line, 1, (sp.Lt(speed, low),), -sense, (below, above)),
        Part(line, 2, (speed >= low, speed <= high), None, (below, above)),
        Part(line, 3, (sp.Gt(speed, high),), sense, (below, above)),
    )


PARTS: tuple[Part, ...] = tuple(part for line in EDGES for part in _parts(line))
"""L1^(1) to L4^(3) as derived (Appendix B)."""


def part(name: str) -> Part:
    """Part by its name, such as L2^(1)."""
    return next(one for one in PARTS if one.name == name)


BIFURCATIONS = ("adding", "crossing", "grazing", "switching")


def bifurcations(part: Part) -> frozenset[str]:
    """Sliding bifurcations possible on a part, from the signs of the product and its rate.

    Crossing and switching: the trajectory arrives transversally from the drift opposite, and
    stick ends or begins there. Grazing: it touches P1 = 0 from the drift beside. Adding: it
    touches the line from within stick. The force is taken short of its extremes: there its rate
    can have either sign, and any size by the choice of omega.
    """
    moving = (sp.Lt(force, alpha), sp.Gt(force, -alpha))
    line = part.line
    beside, stick, opposite = FIELDS[line]
    kinds = {
        "crossing": (opposite, beside),
        "switching": (opposite, stick),
        "grazing": (beside, beside),
        "adding": (stick, stick),
    }
    return frozenset(
        kind
        for kind, (source, target) in kinds.items()
        for leaf in leaves_of(line)
        if source in leaf.arrives
        and target in leaf.departs
        and consistent([*part.relations, *leaf.condition, *moving])
    )
