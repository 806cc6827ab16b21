"""Printed relations that fail at an exact witness, and checks of printed formulas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import sympy as sp

from capsule_sym._symbolic.theory import (
    PIECES,
    STATE,
    Relation,
    Statement,
    alpha,
    beta,
    consistent,
    delta,
    f_b,
    force,
    gamma,
    implies,
    negations,
    reduced,
    zeta,
)
from paper.claims.beside import beside
from paper.claims.formula import formula, same
from paper.claims.relations import Texts, derived, latex, scope
from paper.derived.points import evaluate, example
from paper.printed import Entry, read

CREST = sp.Eq(force, alpha)  # omega tau = 0


def equal(printed: Any, expected: Any) -> bool:
    """Check that printed data are as expected."""
    return bool(printed == expected)


def same_formula(printed: str, expected: str | sp.Expr) -> bool:
    """Check that a printed expression is identically the expected one."""
    return same(formula(printed), derived(expected) if isinstance(expected, str) else expected)


def positive(printed: str, expected: str) -> bool:
    """Check that a printed relation states that an expression, or it over 2 zeta, is positive."""
    relation, value = formula(printed), derived(expected)
    gap = relation.lhs - relation.rhs
    return isinstance(relation, sp.StrictGreaterThan) and (
        same(gap, value) or same(2 * zeta * gap, value)
    )


def same_union(whole: Texts, pieces: Sequence[str], within: Texts, end: str) -> bool:
    """Check that a set is the union of pieces, split by the sign of a function at its end."""
    whole, within, split = scope(whole), scope(within), derived(end)
    sets = [PIECES[name].relations for name in pieces]
    cases = [[*whole, *within, r(split, 0)] for r in (sp.Lt, sp.Eq, sp.Gt)]
    return all(implies([*one, *within], r) for one in sets for r in whole) and all(
        any(all(implies(case, r) for r in one) for one in sets)
        for case in cases
        if consistent(case)
    )


def _case_study() -> dict[sp.Symbol, Fraction]:
    printed = read()
    entry, amplitude = printed["section.4.parameters"], printed["figure.7"]["f"]
    named = {s: Fraction(entry[str(s)]) for s in (zeta, beta, gamma, f_b, delta)}
    return named | {alpha: Fraction(amplitude)}


CASE_STUDY = _case_study()
"""Parameters of Section 4, with alpha of Fig. 7(f), at which witnesses are searched."""


@dataclass(frozen=True)
class Erratum:
    """A printed relation that fails somewhere in a set of states, and what holds instead.

    Attributes:
        here: The set in which the relation is printed.
        printed: The printed relation.
        expected: The relation that is derived.
        inside: The set in which it holds, if that is another one.
        at: Values of parameters at the witness, other than those of the case study.
    """

    here: Texts
    printed: str
    expected: str | Relation
    inside: Texts | None = None
    at: Mapping[str, str] = field(default_factory=dict)

    @property
    def holding(self) -> tuple[Relation, ...]:
        """The set in which the derived relation holds."""
        return scope(self.here if self.inside is None else self.inside)

    @property
    def relation(self) -> Relation:
        """The derived relation."""
        return derived(self.expected) if isinstance(self.expected, str) else self.expected

    def point(self) -> dict[sp.Symbol, Fraction]:
        """Point of the set, at tau = 0, where the printed relation is false."""
        values = {s: Fraction(self.at.get(s.name, value)) for s, value in CASE_STUDY.items()}
        for wrong in negations(derived(self.printed)):
            if consistent(there := [*scope(self.here), CREST, wrong]):
                return example(there, values)
        raise ValueError(f"the printed relation holds everywhere: {self.printed}")

    def witness(self) -> dict[str, str]:
        """Point in exact numbers, with both sides of the printed relation there."""
        point, relation = self.point(), derived(self.printed)
        left, right = evaluate(relation.lhs, point), evaluate(relation.rhs, point)
        sign = "=" if isinstance(relation, sp.Eq) else relation.rel_op
        return {**point_text(point), "printed relation there": f"{left} {sign} {right}, false"}

    def settled(self) -> bool:
        """True if the derived relation is proved and the printed one fails at the witness."""
        try:
            point = self.point()
        except ValueError:
            return False
        return (
            implies(self.holding, self.relation)
            and all(_holds(relation, point) for relation in scope(self.here))
            and not _holds(derived(self.printed), point)
        )

    def latex(self) -> str:
        """Derived relation and its range, in a shorter form of the same sign if there is one."""
        relation = self.relation
        if not isinstance(relation, sp.Eq):
            shorter = reduced(relation.lhs - relation.rhs, self.holding)
            if not shorter.is_number:
                relation = type(relation)(shorter, 0, evaluate=False)
        return rf"{latex(self.holding)}\quad\Rightarrow\quad {sp.latex(relation)}"


def fails(
    here: Texts,
    printed: str,
    expected: str | Relation,
    inside: Texts | None = None,
    at: Mapping[str, str] | None = None,
) -> bool:
    """Check that a printed relation fails somewhere, and that the expected one is proved."""
    return Erratum(here, printed, expected, inside, at or {}).settled()


def _holds(relation: Relation, point: Mapping[sp.Symbol, Fraction]) -> bool:
    """Exact truth value of a relation at a rational point."""
    if relation in (sp.true, sp.false):
        return bool(relation)
    value = evaluate(relation.lhs - relation.rhs, point)
    return bool(type(relation)(sp.Rational(value), 0))


def point_text(point: Mapping[sp.Symbol, Fraction]) -> dict[str, str]:
    """Point at tau = 0 in exact numbers, as text."""
    return {str(s): str(point[s]) for s in (*STATE, *CASE_STUDY)} | {"tau": "0"}


def at_crest(texts: Texts) -> dict[str, str]:
    """Point of the case study at tau = 0 in a set of states, as text."""
    return point_text(example([*scope(texts), CREST], CASE_STUDY))


def misprint(
    entry: Entry, name: str, here: Texts, relation: str, expected: str, **texts: Any
) -> Statement:
    """Erratum of a relation that is printed for a set of states, and fails at a point of it.

    `texts` are those of the statement; `inside` and `at` are fields of the `Erratum`.
    """
    claim: dict[str, Any] = {"here": here, "printed": relation, "expected": expected}
    claim |= {key: texts.pop(key) for key in ("inside", "at") if key in texts}
    found = Erratum(**claim)
    return beside(
        entry,
        name,
        fails,
        claim,
        {"expected": negations(found.relation)[0]},
        verdict="refuted",
        formula=found.latex,
        witness=found.witness,
        **texts,
    )
