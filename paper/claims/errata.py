"""Printed relations that fail at an exact witness, and checks of printed formulas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
    evaluate,
    example,
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
    """A printed relation that fails somewhere in its scope, and the relation that holds instead.

    `printed` is asserted wherever all of `scope` holds; `expected` is proved wherever all of
    `inside` holds. The witness is searched at `values` of the parameters.
    """

    scope: tuple[Relation, ...]
    printed: Relation
    inside: tuple[Relation, ...]
    expected: Relation
    values: Mapping[sp.Symbol, Fraction]

    @classmethod
    def of(
        cls,
        here: Texts,
        printed: str,
        expected: str | Relation,
        inside: Texts | None = None,
        at: Mapping[str, str] | None = None,
    ) -> Erratum:
        """Erratum of a row; `inside` defaults to `here`."""
        place = {next(s for s in CASE_STUDY if s.name == k): v for k, v in (at or {}).items()}
        return cls(
            scope(here),
            derived(printed),
            scope(here if inside is None else inside),
            derived(expected) if isinstance(expected, str) else expected,
            CASE_STUDY | {symbol: Fraction(value) for symbol, value in place.items()},
        )

    def point(self) -> dict[sp.Symbol, Fraction]:
        """Point of the scope, at tau = 0, where the printed relation is false."""
        for wrong in negations(self.printed):
            if consistent([*self.scope, CREST, wrong]):
                return example([*self.scope, CREST, wrong], self.values)
        raise ValueError(f"the printed relation holds everywhere: {self.printed}")

    def witness(self) -> dict[str, str]:
        """Point in exact numbers, with both sides of the printed relation there."""
        point, relation = self.point(), self.printed
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
            implies(self.inside, self.expected)
            and all(_holds(relation, point) for relation in self.scope)
            and not _holds(self.printed, point)
        )

    @property
    def latex(self) -> str:
        """Derived relation and its range, in a shorter form of the same sign if there is one."""
        relation = self.expected
        if not isinstance(relation, sp.Eq):
            shorter = reduced(relation.lhs - relation.rhs, self.inside)
            if not shorter.is_number:
                relation = type(relation)(shorter, 0, evaluate=False)
        return rf"{latex(self.inside)}\quad\Rightarrow\quad {sp.latex(relation)}"


def fails(
    here: Texts,
    printed: str,
    expected: str | Relation,
    inside: Texts | None = None,
    at: Mapping[str, str] | None = None,
) -> bool:
    """Check that a printed relation fails somewhere, and that the expected one is proved."""
    return Erratum.of(here, printed, expected, inside, at).settled()


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
    entry: Entry,
    name: str,
    here: Texts,
    relation: str,
    expected: str | Relation,
    *,
    inside: Texts | None = None,
    at: Mapping[str, str] | None = None,
    **texts: Any,
) -> Statement:
    """Erratum of a relation that is printed for a set of states, and fails at a point of it."""
    claim: dict[str, Any] = {"here": here, "printed": relation, "expected": expected}
    claim |= {"inside": inside} if inside else {}
    claim |= {"at": at} if at else {}
    found = Erratum.of(**claim)
    return beside(
        entry,
        name,
        fails,
        claim,
        {"expected": negations(found.expected)[0]},
        verdict="refuted",
        formula=lambda: found.latex,
        witness=found.witness,
        **texts,
    )
