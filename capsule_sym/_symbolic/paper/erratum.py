"""A printed relation that fails somewhere: what holds instead, its proof, and an exact witness.

An erratum says that the paper asserts a relation at points where another one holds. The proof
derives the second from the scope; the witness is an exact rational point of the scope at which the
printed relation is false.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

import sympy as sp

from capsule_sym._paper import Entry, read
from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.proof import consistent, evaluate, example, implies, negations
from capsule_sym._symbolic.model.switching import reduced
from capsule_sym._symbolic.model.symbols import STATE, alpha, beta, delta, f_b, force, gamma, zeta
from capsule_sym._symbolic.paper.compare import as_read, comparison
from capsule_sym._symbolic.proofs.items import Item


def _case_study() -> dict[sp.Symbol, Fraction]:
    printed = read()
    entry, amplitude = printed["section.4.parameters"], printed["figure.7"]["f"]
    named = {s: Fraction(entry[str(s)]) for s in (zeta, beta, gamma, f_b, delta)}
    return named | {alpha: Fraction(amplitude)}


CASE_STUDY = _case_study()
"""The parameters of Section 4, with alpha of Fig. 7(f), at which witnesses are sought."""

CREST = sp.Eq(force, alpha)  # omega tau = 0


@dataclass(frozen=True)
class Erratum:
    """A printed relation that fails somewhere in its scope, and what holds instead.

    `printed_relation` is asserted wherever all of `scope` holds; `derived_relation` is proved
    wherever all of `derived_scope` holds. The witness is sought at `values` of the parameters.
    """

    id: str
    scope: tuple[Relation, ...]
    printed_relation: Relation
    derived_scope: tuple[Relation, ...]
    derived_relation: Relation
    values: Mapping[sp.Symbol, Fraction]

    def point(self) -> dict[sp.Symbol, Fraction]:
        """A point of the scope, at tau = 0, where the printed relation is false."""
        for wrong in negations(self.printed_relation):
            if consistent([*self.scope, CREST, wrong]):
                return example([*self.scope, CREST, wrong], self.values)
        raise ValueError(f"{self.id}: the printed relation holds everywhere")

    def witness(self) -> dict[str, str]:
        """The point in exact numbers, and what the printed relation becomes there."""
        point, relation = self.point(), self.printed_relation
        left, right = evaluate(relation.lhs, point), evaluate(relation.rhs, point)
        sign = "=" if isinstance(relation, sp.Eq) else relation.rel_op
        return {**described(point), "printed relation there": f"{left} {sign} {right}, false"}

    def settled(self) -> bool:
        """Whether the derived relation is proved and the printed one fails at the witness."""
        try:
            point = self.point()
        except ValueError:
            return False
        return (
            implies(self.derived_scope, self.derived_relation)
            and all(_holds(relation, point) for relation in self.scope)
            and not _holds(self.printed_relation, point)
        )


def _holds(relation: Relation, point: Mapping[sp.Symbol, Fraction]) -> bool:
    """Exact truth of a relation at a rational point."""
    if relation in (sp.true, sp.false):
        return bool(relation)
    value = evaluate(relation.lhs - relation.rhs, point)
    return bool(type(relation)(sp.Rational(value), 0))


def described(point: Mapping[sp.Symbol, Fraction]) -> dict[str, str]:
    """A point at tau = 0 in exact numbers, as text."""
    names = (*STATE, zeta, beta, gamma, f_b, delta, alpha)
    return {str(s): str(point[s]) for s in names} | {"tau": "0"}


def at_crest(relations: Iterable[Relation]) -> dict[str, str]:
    """A point of the case study at tau = 0 that satisfies relations, as text."""
    return described(example([*relations, CREST], CASE_STUDY))


def _formula(erratum: Erratum) -> str:
    """The scope, and what is derived there (in a shorter form of the same sign, if it is one)."""
    relation = erratum.derived_relation
    if not isinstance(relation, sp.Eq):
        shorter = reduced(relation.lhs - relation.rhs, erratum.derived_scope)
        if not shorter.is_number:
            relation = type(relation)(shorter, 0, evaluate=False)
    scope = r",\ ".join(map(sp.latex, erratum.derived_scope))
    return rf"{scope}\quad\Rightarrow\quad {sp.latex(relation)}"


def erratum_item(
    entry: Entry,
    name: str,
    printed: str,
    *,
    scope: tuple[Relation, ...],
    printed_relation: Relation,
    derived_relation: Relation,
    derived_scope: tuple[Relation, ...] | None = None,
    values: Mapping[sp.Symbol, Fraction] = CASE_STUDY,
    place: str = "",
    derived: str,
    proof: str,
    consequence: str,
) -> Item:
    """The item named `erratum.`name: that a printed relation fails, and what holds instead.

    What is derived holds in the same scope where no other is given, and the printed statement
    stands in the entry's own place.
    """
    inside = scope if derived_scope is None else derived_scope
    claim = Erratum(name, scope, printed_relation, inside, derived_relation, values)
    return comparison(
        replace(entry, place=place or entry.place),
        name,
        f"printed: {as_read(entry, printed)}. Derived: {derived}",
        printed,
        claim,
        Erratum.settled,
        replace(claim, derived_relation=negations(derived_relation)[0]),
        derived=derived,
        verdict="refuted",
        proof=proof,
        consequence=consequence,
        formula=_formula(claim),
        witness=claim.witness,
    )
