"""Checks of Tables 2 and 3 as derived: passages on lines, and every local map with its witness."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache, partial
from typing import Any

import sympy as sp

from capsule_sym._symbolic.theory import (
    PIECES,
    SEGMENTS,
    SURFACES,
    Leaf,
    Relations,
    Statement,
    consistent,
    delta,
    f_b,
    implies,
    leaves_of,
    surface_transitions,
    zeta,
)
from paper.derived.appendices import BY_LINE
from paper.derived.inner_products import FIELDS, outward
from paper.derived.local_maps import (
    SCENARIOS,
    LocalMap,
    allowed_maps,
    end_planes,
    local_maps,
    momentum,
    never_rests,
)
from paper.derived.parts import part
from paper.derived.reachability import Witness, proves, witness_text, witnesses

Maps = frozenset[LocalMap]
Pairs = frozenset[tuple[int, int]]
_DAMPED = (sp.Gt(zeta, 0),)
ASSUMED = {line: sp.Lt(*BY_LINE[line].condition) for line in ("L1", "L4")}
"""Appendix A's open intervals of alpha, for which Table 2 is printed."""


@cache
def passages_at(name: str, hypotheses: tuple[Any, ...], may: bool = False) -> Pairs:
    """Sources and targets that occur at a piece where the hypotheses can hold.

    With `may`, also those that derivatives of the considered order do not decide.
    """
    return frozenset(
        (source, target)
        for leaf in leaves_of(name)
        if consistent([*leaf.condition, *hypotheses])
        for source in (leaf.may_arrive if may else leaf.arrives)
        for target in (leaf.may_depart if may else leaf.departs)
    )


@cache
def on(place: str) -> Pairs:
    """Sources and targets that occur on a surface, on a line or on a part of one.

    On L1 and L4 alpha is within Appendix A's bounds; corners are excluded.
    """
    if place in SURFACES:
        found = surface_transitions()
        return frozenset((t.source, t.target) for t in found if t.surface == place)
    if "^" in place:
        return passages_at(place[:2], (*part(place).relations, *_DAMPED))
    bound = (*_DAMPED, ASSUMED[place]) if place in ASSUMED else ()
    return passages_at(place, (*PIECES[place].relations, *bound))


def passages(place: str, pairs: Sequence[tuple[int, int]]) -> bool:
    """Check that exactly these sources and targets occur on a line or a part of it."""
    return on(place) == set(pairs)


Passage = tuple[frozenset[int], frozenset[int]]
"""Fields that arrive, and fields that leave."""


def mechanism(line: str) -> dict[str, Passage]:
    """Sources and targets on L1-L4 by the signs of the inner product out of stick and its rate.

    The keys are `+`, `-` and, where it vanishes, `0+` and `0-` for the sign of its rate.
    """
    product = outward(line)
    found: dict[str, Passage] = {}
    for leaf in leaves_of(line):
        if leaf.may_arrive == leaf.arrives and leaf.may_depart == leaf.departs:
            found[_signature(leaf, product)] = (leaf.arrives, leaf.departs)
    return found


def _signature(leaf: Leaf, product: sp.Expr) -> str:
    here = [*leaf.piece.relations, *leaf.condition]
    for word, relation in (("+", sp.Gt(product, 0)), ("-", sp.Lt(product, 0))):
        if implies(here, relation):
            return word
    # The rate of the product has the sign of the last condition on L1, L3, the other on L2, L4.
    rising = isinstance(leaf.condition[-1], sp.StrictGreaterThan)
    return "0+" if rising == (leaf.piece.name in ("L1", "L3")) else "0-"


def expected_mechanism(line: str) -> dict[str, Passage]:
    """Claimed mechanism, common to L1-L4, in terms of the fields beside the line."""
    beside, stick, opposite = FIELDS[line]
    every, only = frozenset({beside, stick, opposite}), frozenset({opposite})
    return {
        "+": (every, frozenset({beside})),
        "-": (only, frozenset({stick})),
        "0-": (every, frozenset({stick})),
        "0+": (only, frozenset({beside})),
    }


def has_mechanism(line: str, passages: Mapping[str, Passage]) -> bool:
    """Check that sources and targets on a line are these, by the sign of n and of its rate."""
    return mechanism(line) == passages


def occurs_by(local_map: LocalMap, shown: Sequence[Witness]) -> bool:
    """Check that there is a witness, and every one proves that a local map occurs."""
    return bool(shown) and all(w.local_map == local_map and proves(w) for w in shown)


def allows(within: Relations, maps: Iterable[LocalMap]) -> bool:
    """Check that under conditions on the parameters exactly these local maps are not excluded."""
    return allowed_maps(within) == set(maps)


def complete(maps: Sequence[LocalMap]) -> bool:
    """Check that these are the maps not excluded, at points of any degeneracy."""
    known = {(m.field, m.target) for m in maps}
    return set(maps) == set(local_maps()) and end_planes() <= known


def never_ends_at_rest(field: int, within: Relations) -> bool:
    """Check that a drift that begins at an impact of a moving capsule cannot end at rest."""
    return never_rests(SEGMENTS[field - 1], within)


def table_2() -> Iterator[Statement]:
    """Mechanism on L1-L4 by the inner product out of stick and its rate."""
    for line, (beside, stick, opposite) in FIELDS.items():
        found = expected_mechanism(line)
        yield Statement(
            f"table2.{line}",
            "Table 2",
            f"on {line}, with n = {outward(line)}: n > 0 leads Ω{beside}, Ω{stick}, Ω{opposite} to "
            f"Ω{beside}; n < 0 leads Ω{opposite} to Ω{stick}; n = 0 > n' leads all three to "
            f"Ω{stick}; n = 0 < n' leads Ω{opposite} to Ω{beside}",
            has_mechanism,
            {"line": line, "passages": found},
            {"passages": {"-": found["+"]}},
            formula=f"n={sp.latex(outward(line))}",
            verdict="conditional",
        )


def table_3() -> Iterator[Statement]:
    """Local maps: that those derived are all, which occur in each case, and a witness of each."""
    shown: dict[LocalMap, list[Witness]] = {}
    for witness in witnesses():
        shown.setdefault(witness.local_map, []).append(witness)
    every = tuple(sorted(shown))
    yield Statement(
        "table3.complete",
        "Table 3",
        f"no local map but the {len(every)} derived ones occurs",
        complete,
        {"maps": every},
        {"maps": every[1:]},
        formula=rf"|\text{{Table 3}}|={len(every)}",
    )
    yield Statement(
        "table3.never_rests",
        "not in the paper",
        "for delta >= f_b a capsule that moves forward at the impact moves forward until contact "
        "ends: from Σ7 only Σ8 follows",
        never_ends_at_rest,
        {"field": 4, "within": (sp.Ge(delta, f_b),)},
        {"within": (sp.Lt(delta, f_b),)},
        formula=rf"\tfrac{{d}}{{d\tau}}\Bigl({sp.latex(momentum(SEGMENTS[3]))}\Bigr)\ge0",
    )
    for gap, relation in SCENARIOS.items():
        for damping, damped in (("ζ > 0", sp.Gt(zeta, 0)), ("ζ = 0", sp.Eq(zeta, 0))):
            regime = (gap, damping == "ζ > 0")
            maps = sorted({w.local_map for w in witnesses() if w.regime == regime})
            yield Statement(
                f"table3.regime.{gap}.{damping}".replace(" ", ""),
                "Table 3",
                f"for {gap}, {damping} exactly {len(maps)} local maps occur: those with a witness; "
                "all others are excluded",
                allows,
                {"within": (relation, damped), "maps": maps},
                {"maps": maps[1:]},
                formula=rf"|\text{{Table 3}}|={len(maps)}",
            )
    for one in every:
        regimes = {
            f"{gap}{'' if damped else ', ζ = 0'}" for gap, damped in (w.regime for w in shown[one])
        }
        yield Statement(
            f"table3.{one.target}.F{one.field}.{one.source}",
            "Table 3",
            f"{one} occurs, for {'; '.join(sorted(regimes))}",
            occurs_by,
            {"local_map": one, "shown": shown[one]},
            {"local_map": LocalMap("Σ2" if one.target == "Σ7" else "Σ7", one.field, one.source)},
            formula=one.formula,
            witness=partial(witness_text, shown[one][0]),
        )
