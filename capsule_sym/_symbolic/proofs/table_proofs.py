"""Tables 2 and 3 as derived: the mechanism on L1-L4, L10, and every local map with its witness."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import sympy as sp

from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import PIECES, SCENARIOS
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.proof import consistent, implies
from capsule_sym._symbolic.model.switching import (
    Leaf,
    LocalMap,
    allowed_maps,
    end_planes,
    leaves_of,
    local_maps,
    momentum,
    never_rests,
)
from capsule_sym._symbolic.model.symbols import delta, f_b, zeta
from capsule_sym._symbolic.proofs.appendices import BOUNDS
from capsule_sym._symbolic.proofs.inner_products import FIELDS, outward
from capsule_sym._symbolic.proofs.items import Item
from capsule_sym._symbolic.proofs.reachability import Witness, described, proves, witnesses

Passage = tuple[frozenset[int], frozenset[int]]
"""Fields that arrive, and fields that depart."""


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
    """The mechanism common to L1-L4: what is claimed, in terms of the fields beside the line."""
    beside, stick, opposite = FIELDS[line]
    every, only = frozenset({beside, stick, opposite}), frozenset({opposite})
    return {
        "+": (every, frozenset({beside})),
        "-": (only, frozenset({stick})),
        "0-": (every, frozenset({stick})),
        "0+": (only, frozenset({beside})),
    }


def _has_mechanism(claim: tuple[str, dict[str, Passage]]) -> bool:
    line, passages = claim
    return mechanism(line) == passages


def _line_item(line: str) -> Item:
    beside, stick, opposite = FIELDS[line]
    expected = expected_mechanism(line)
    return Item(
        id=f"table2.{line}",
        equation="Table 2",
        statement=(
            f"on {line}, with n = {outward(line)}: n > 0 leads Ω{beside}, Ω{stick}, Ω{opposite} "
            f"to Ω{beside}; n < 0 leads Ω{opposite} to Ω{stick}; n = 0 > n' leads all three to "
            f"Ω{stick}; n = 0 < n' leads Ω{opposite} to Ω{beside}"
        ),
        claim=(line, expected),
        check=_has_mechanism,
        mutant=(line, {**expected, "-": expected["+"]}),
        formula=rf"n={sp.latex(outward(line))}",
        verdict="conditional",
    )


def _one_way_under(claim: tuple[str, Relation, int]) -> bool:
    """Whether under a condition every trajectory leaves a line into one subspace."""
    line, condition, target = claim
    return all(
        leaf.departs == {target}
        for leaf in leaves_of(line)
        if consistent([*PIECES[line].relations, *leaf.condition, zeta > 0, condition])
    )


def _rows_2() -> Iterator[Item]:
    yield from map(_line_item, FIELDS)
    for bound, target in zip(BOUNDS[:2], (1, 6), strict=True):
        condition = sp.Le(bound.smaller, bound.larger)
        yield Item(
            id=f"table2.{bound.line}.one_way",
            equation="Table 2, Appendix A",
            statement=f"while {condition} and zeta > 0, {bound.line} leads to Ω{target} only",
            claim=(bound.line, condition, target),
            check=_one_way_under,
            mutant=(bound.line, sp.Not(condition), target),
            formula=sp.latex(condition),
            verdict="conditional",
        )
    yield Item(
        id="table2.L10",
        equation="not in Table 2",
        statement="on L10 (corners apart): Ω6 → Ω1",
        claim=("L10", (6, 1)),
        check=_leads,
        mutant=("L10", (1, 6)),
        formula=PIECES["L10"].latex,
    )


def _leads(claim: tuple[str, tuple[int, int]]) -> bool:
    """Whether a line leads from one subspace into one other."""
    line, (source, target) = claim
    (leaf,) = leaves_of(line)
    return leaf.arrives == {source} and leaf.departs == {target}


def _occurs(claim: tuple[LocalMap, tuple[Witness, ...]]) -> bool:
    """Whether every witness proves the local map, and there is one."""
    local_map, found = claim
    return bool(found) and all(w.local_map == local_map and proves(w) for w in found)


def _map_item(local_map: LocalMap) -> Item:
    found = tuple(w for w in witnesses() if w.local_map == local_map)
    other = replace(local_map, target="Σ7" if local_map.target != "Σ7" else "Σ2")
    scenarios = sorted(
        {f"{s}{'' if damped else ', ζ = 0'}" for s, damped in (w.regime for w in found)}
    )
    return Item(
        id=f"table3.{local_map.target}.F{local_map.field}.{local_map.source}",
        equation="Table 3",
        statement=f"{local_map} occurs, for {'; '.join(scenarios)}",
        claim=(local_map, found),
        check=_occurs,
        mutant=(other, tuple(replace(w, local_map=other) for w in found)),
        formula=local_map.formula,
        witness=lambda: described(found[0]),
    )


def _regime_is(claim: tuple[str, bool, frozenset[LocalMap]]) -> bool:
    """Whether in a regime exactly these local maps are not excluded."""
    scenario, damped, maps = claim
    damping = sp.Gt(zeta, 0) if damped else sp.Eq(zeta, 0)
    return allowed_maps([SCENARIOS[scenario], damping]) == maps


def _regime_items() -> Iterator[Item]:
    for scenario in SCENARIOS:
        for damped in (True, False):
            regime = (scenario, damped)
            maps = frozenset(w.local_map for w in witnesses() if w.regime == regime)
            damping = "ζ > 0" if damped else "ζ = 0"
            yield Item(
                id=f"table3.regime.{scenario.replace(' ', '')}.{damping.replace(' ', '')}",
                equation="Table 3",
                statement=(
                    f"for {scenario}, {damping} exactly {len(maps)} local maps occur: those with "
                    "a witness; all others are excluded"
                ),
                claim=(*regime, maps),
                check=_regime_is,
                mutant=(*regime, maps - {min(maps)}),
                formula=rf"|\text{{Table 3}}|={len(maps)}",
            )


def _closed(claim: tuple[LocalMap, ...]) -> bool:
    """Whether these are the maps not excluded, at points of any degeneracy."""
    known = {(m.field, m.target) for m in claim}
    return set(claim) == set(local_maps()) and end_planes() <= known


_BAR = (4, sp.Ge(delta, f_b))


def _is_barred(claim: tuple[int, Relation]) -> bool:
    index, hypothesis = claim
    return never_rests(SEGMENTS[index - 1], [hypothesis])


def _rows_3() -> Iterator[Item]:
    maps = tuple(sorted({w.local_map for w in witnesses()}))
    yield Item(
        id="table3.complete",
        equation="Table 3",
        statement=f"no local map but the {len(maps)} derived ones occurs",
        claim=maps,
        check=_closed,
        mutant=tuple(m for m in maps if m.target != "Σ9"),
        formula=rf"|\text{{Table 3}}|={len(maps)}",
    )
    held = momentum(SEGMENTS[3])
    yield Item(
        id="table3.never_rests",
        equation="not in the paper",
        statement=(
            "for delta >= f_b a capsule that moves forward at the impact moves forward until "
            "contact ends: from Σ7 only Σ8 follows"
        ),
        claim=_BAR,
        check=_is_barred,
        mutant=(4, sp.Lt(delta, f_b)),
        formula=rf"\tfrac{{d}}{{d\tau}}\Bigl({sp.latex(held)}\Bigr)\ge0",
    )
    yield from _regime_items()
    yield from map(_map_item, maps)


def table_2() -> tuple[Item, ...]:
    """The mechanism on L1-L4, where it is one-way, and L10."""
    return tuple(_rows_2())


def table_3() -> tuple[Item, ...]:
    """Every local map of Table 3."""
    return tuple(_rows_3())
