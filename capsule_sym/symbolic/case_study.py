"""Section 4 with proof: the motion from rest at the printed parameters, and where it changes.

At an amplitude, `attractors` proves to which periodic motion the one from (0, 0, 0) tends; its
global map is set beside the printed one. Two amplitudes with different motions enclose a change:
a bracket for each printed bifurcation value. This is done at the printed mass ratio 3.3, and at
3.0, where the printed order of the changes comes out.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial

import sympy as sp

from capsule_sym.symbolic import printed
from capsule_sym.symbolic.attractors import Attractor, attractor
from capsule_sym.symbolic.items import Item
from capsule_sym.symbolic.model import SEGMENTS
from capsule_sym.symbolic.orbits import IMPACT_PLANES
from capsule_sym.symbolic.switching import LocalMap
from capsule_sym.symbolic.symbols import alpha, beta, delta, f_b, gamma, omega, zeta

_FIXED = {
    **{omega: Fraction("0.8"), delta: Fraction("0.02"), zeta: Fraction("0.05")},
    **{beta: Fraction("1.5"), f_b: Fraction(1)},
}
_PRINTED, _OTHER = "3.3", "3.0"  # mass ratios

Word = tuple[int, ...]
"""The fields of one period in order of time."""
Maps = tuple[LocalMap, ...]


@dataclass(frozen=True)
class Point:
    """A mass ratio and an amplitude of the case study, as decimal numbers."""

    gamma: str
    alpha: str

    def __str__(self) -> str:
        return f"γ = {self.gamma}, α = {self.alpha}"

    @property
    def values(self) -> dict[sp.Symbol, sp.Rational]:
        """All parameters, exactly."""
        numbers = {**_FIXED, gamma: Fraction(self.gamma), alpha: Fraction(self.alpha)}
        return {symbol: sp.Rational(number) for symbol, number in numbers.items()}


@cache
def found(point: Point) -> Attractor:
    """The motion to which the one from rest is proved to tend."""
    return attractor(point.values)


def maps(word: Word) -> Maps:
    """The local maps of a periodic sequence of fields; none for a single field."""

    def plane(before: int, after: int) -> str:
        old, new = SEGMENTS[before - 1], SEGMENTS[after - 1]
        impact = old.drift == new.drift != 0
        return IMPACT_PLANES[after] if impact else f"Σ{after}"

    if len(word) == 1:
        return ()
    begins = [plane(word[i - 1], word[i]) for i in range(len(word))]
    return tuple(map(LocalMap, [*begins[1:], begins[0]], word, begins))


def global_map(local_maps: Maps) -> str:
    """A global map in the paper's notation, composed from right to left."""
    return " ∘ ".join(map(str, reversed(local_maps))) or "Id_{Σ2,F2,Σ2}"


def _cycle(local_maps: Maps) -> Maps:
    """The same cycle begun at its least map."""
    start = local_maps.index(min(local_maps)) if local_maps else 0
    return (*local_maps[start:], *local_maps[:start])


Claim = tuple[tuple[Point, Maps], ...]


def _tends_to(claim: Claim) -> bool:
    """Whether at each point the motion from rest tends to one with the given global map."""
    return all(_cycle(found(point).maps) == _cycle(expected) for point, expected in claim)


def _proved_at(point: Point) -> dict[str, str]:
    """The numbers of the proof at a point."""
    motion = found(point)
    state = ", ".join(f"{float(x):.9f}" for x in motion.state)
    return {
        **{str(symbol): str(float(number)) for symbol, number in point.values.items()},
        "start": "(0, 0, 0) at tau = 0",
        "contracted box": f"about (x_r, v_r, v_c) = ({state}) at omega tau = 0 mod 2 pi, "
        f"half sides {float(motion.radius):.0e} along its axes, entered after "
        f"{motion.periods} periods, shrinks by {float(motion.factor):.2f} in each",
    }


_PROOF = "the motion from rest is enclosed until it enters a box that one period contracts"
_ON_BOTH_SIDES = _PROOF + ", on each side"

_PANELS: dict[tuple[str, str], Word] = {
    ("f", "0.7"): (5, 4, 1, 2),
    ("h", "1.2"): (5, 4, 1, 2, 3, 2),
    ("j", "1.5"): (5, 4, 1, 2, 3, 6),
    ("l", "1.64"): (4, 1, 3, 6),
    ("n", "1.69"): (4, 1, 3, 6),
    ("p", "1.9"): (4, 1, 3, 6),
}
"""Panels of Fig. 7 away from the bifurcation values: the motions at the printed mass ratio."""
_OTHER_PANELS: dict[tuple[str, str], Word] = {
    ("l", "1.64"): (4, 1, 2, 3, 6),
    ("n", "1.69"): (4, 1, 3, 2, 3, 6),
}
"""Those of them that differ at the other mass ratio."""


def _panel(name: str, point: Point, word: Word) -> Item:
    row, exact = printed.regime(Fraction(point.alpha)), maps(word)
    other = printed.SECTION_4[0].maps
    text = f"at {point} (Fig. 7({name})) the motion from rest tends to one with the global map "
    if _cycle(exact) == _cycle(row.maps):
        return Item(
            id=f"confirmed.section.4.{point.gamma}.{name}",
            equation=f"Section 4, Fig. 7({name})",
            statement=text + global_map(exact),
            claim=((point, exact),),
            check=_tends_to,
            mutant=((point, other),),
            verdict="proved" if point.gamma == _PRINTED else "conditional",
            printed=f"P = {global_map(row.maps)} at α = {point.alpha}",
            derived="as printed" if point.gamma == _PRINTED else f"so it is at γ = {point.gamma}",
            proof=_PROOF,
            witness=partial(_proved_at, point),
        )
    return Item(
        id=f"erratum.section.4.{name}",
        equation=f"Section 4, Fig. 7({name})",
        statement=text + global_map(exact),
        claim=((point, exact),),
        check=_tends_to,
        mutant=((point, row.maps),),
        verdict="refuted",
        printed=f"γ = {point.gamma}, α = {point.alpha}: P = {global_map(row.maps)}",
        derived=f"γ = {point.gamma}, α = {point.alpha}: P = {global_map(exact)}",
        proof=_PROOF,
        consequence="At the printed γ the stick in F2 is gone already: F1 leads to F3 directly. "
        f"At γ = {_OTHER} the printed map is right (confirmed.section.4.{_OTHER}.{name}).",
        witness=partial(_proved_at, point),
    )


@dataclass(frozen=True)
class Change:
    """Two amplitudes between which the motion from rest changes, as a printed event says."""

    gamma: str
    printed_at: str
    below: tuple[str, Word]
    above: tuple[str, Word]

    @property
    def claim(self) -> Claim:
        """The global maps on both sides."""
        return tuple((Point(self.gamma, at), maps(word)) for at, word in (self.below, self.above))

    @property
    def holds_printed(self) -> bool:
        """Whether the printed value is between the two amplitudes."""
        low, value, high = map(Fraction, (self.below[0], self.printed_at, self.above[0]))
        return low <= value <= high

    @property
    def event(self) -> str:
        """What the paper says happens at the printed value."""
        return printed.regime(Fraction(self.printed_at)).event


CHANGES: tuple[Change, ...] = (
    Change(_PRINTED, "0.0074", ("0.0073", (2,)), ("0.0075", (2, 5))),
    Change(_PRINTED, "0.5245", ("0.524", (5, 4, 5, 2)), ("0.525", (5, 4, 1, 2))),
    Change(_PRINTED, "0.939", ("0.94", (5, 4, 1, 2)), ("0.945", (5, 4, 1, 2, 3, 2))),
    Change(_PRINTED, "1.443", ("1.426", (5, 4, 1, 2, 3, 2)), ("1.428", (5, 4, 1, 2, 3, 6))),
    Change(_PRINTED, "1.661", ("1.521", (5, 4, 1, 2, 3, 6)), ("1.523", (5, 4, 1, 3, 2, 3, 6))),
    Change(_PRINTED, "1.7126", ("1.55", (5, 4, 1, 3, 2, 3, 6)), ("1.552", (5, 4, 1, 3, 6))),
    Change(_PRINTED, "1.6148", ("1.588", (5, 4, 1, 3, 6)), ("1.589", (4, 1, 3, 6))),
    Change(_OTHER, "0.939", ("0.938", (5, 4, 1, 2)), ("0.942", (5, 4, 1, 2, 3, 2))),
    Change(_OTHER, "1.443", ("1.44", (5, 4, 1, 2, 3, 2)), ("1.443", (5, 4, 1, 2, 3, 6))),
    Change(_OTHER, "1.6148", ("1.614", (5, 4, 1, 2, 3, 6)), ("1.616", (4, 1, 2, 3, 6))),
    Change(_OTHER, "1.661", ("1.66", (4, 1, 2, 3, 6)), ("1.664", (4, 1, 3, 2, 3, 6))),
    Change(_OTHER, "1.7126", ("1.7", (4, 1, 3, 2, 3, 6)), ("1.704", (4, 1, 3, 6))),
)
"""The bifurcation values of Section 4 by brackets, in order of alpha at each mass ratio."""


def _change(change: Change) -> Item:
    (below, first), (above, second) = change.claim
    between = f"between α = {below.alpha} and {above.alpha}"
    text = f"at γ = {change.gamma}, {between}: {change.event}"
    maps_beside = f"{global_map(first)} below, {global_map(second)} above"
    mutant = ((below, second), (above, first))
    same = change.holds_printed and change.gamma == _PRINTED
    if change.gamma == _PRINTED and not same:
        return Item(
            id=f"erratum.section.4.value.{change.printed_at}",
            equation="Section 4",
            statement=f"{text} (printed: {change.printed_at})",
            claim=change.claim,
            check=_tends_to,
            mutant=mutant,
            verdict="refuted",
            printed=f"γ = {change.gamma}: {change.event} at α = {change.printed_at}",
            derived=f"γ = {change.gamma}: {between}; {maps_beside}",
            proof=_ON_BOTH_SIDES,
            consequence="The printed value is not that of the printed γ; for "
            f"γ = {_OTHER} see section.4.{_OTHER}.value.{change.printed_at}.",
            witness=partial(_proved_at, below if _contradicts(below, first) else above),
        )
    return Item(
        id=f"section.4.{change.gamma}.value.{change.printed_at}",
        equation="Section 4",
        statement=f"{text} (printed: {change.printed_at}); {maps_beside}",
        claim=change.claim,
        check=_tends_to,
        mutant=mutant,
        verdict="proved" if same else "conditional",
        printed=f"{change.event} at α = {change.printed_at}",
        derived="as printed" if same else f"at γ = {change.gamma} {between}",
        proof=_ON_BOTH_SIDES,
        witness=partial(_proved_at, above),
    )


def _contradicts(point: Point, exact: Maps) -> bool:
    """Whether the motion at a point is not the printed one."""
    return _cycle(printed.regime(Fraction(point.alpha)).maps) != _cycle(exact)


_LAST = ("1.6148", "1.661", "1.7126")


def _order(mass_ratio: str) -> Item:
    last = [c for c in CHANGES if c.gamma == mass_ratio and c.printed_at in _LAST]
    in_order = "; ".join(f"{c.event} (α from {c.below[0]} to {c.above[0]})" for c in last)
    told = "; ".join(f"{printed.regime(Fraction(at)).event} (α = {at})" for at in _LAST)
    claim = tuple(side for change in last for side in change.claim)
    middle = last[1].claim[1][0]
    right = mass_ratio == _OTHER
    return Item(
        id=f"section.4.{mass_ratio}.order" if right else "erratum.section.4.order",
        equation="Section 4",
        statement=f"at γ = {mass_ratio}, with growing α: {in_order}",
        claim=claim,
        check=_tends_to,
        mutant=tuple((p, m) for (p, _), (_, m) in zip(claim, claim[::-1], strict=True)),
        verdict="conditional" if right else "refuted",
        printed=f"the last three events, with growing α: {told}",
        derived=f"at γ = {mass_ratio}: {in_order}",
        proof=_PROOF + ", on both sides of each change",
        consequence=f"At γ = {mass_ratio} the three come in the printed order, within 1 %."
        if right
        else f"At {middle} the stick in F2 is gone, that in F5 is not, as in no printed row. "
        f"The printed order is that of γ = {_OTHER} (section.4.{_OTHER}.order).",
        witness=partial(_proved_at, middle),
    )


def items() -> tuple[Item, ...]:
    """The motions of Fig. 7, the bifurcation values, and their order, at both mass ratios."""
    return (
        *(_panel(n, Point(_PRINTED, a), word) for (n, a), word in _PANELS.items()),
        *map(_change, CHANGES),
        _order(_PRINTED),
        *(_panel(n, Point(_OTHER, a), word) for (n, a), word in _OTHER_PANELS.items()),
        _order(_OTHER),
    )
