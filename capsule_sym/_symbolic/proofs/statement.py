"""Statements that `capsule-sym verify` proves: a claim as arguments of a check.

The claim is data, so that the same check can be applied to a wrong claim: one with a sign or a row
changed, which has to fail.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from time import perf_counter
from typing import Any, Literal

import sympy as sp

from capsule_sym._errors import InvalidInput, close_names
from capsule_sym._symbolic.model.elimination import Relation, Undecided

Verdict = Literal["proved", "refuted", "conditional"]
Status = Literal["proved", "refuted", "conditional", "failed", "undecided"]
Arguments = Mapping[str, Any]
Relations = Sequence[Relation]


def merged(claim: Arguments, other: Arguments) -> dict[str, Any]:
    """Arguments with other values; a table is changed key by key."""
    changed = dict(claim)
    for key, value in other.items():
        old = changed.get(key)
        changed[key] = {**old, **value} if isinstance(old, Mapping) else value
    return changed


@dataclass(frozen=True, eq=False)
class Statement:
    """A statement of the theory, and its proof.

    Attributes:
        name: Identifier, such as "cells.F1.guards".
        equation: Place in the paper, or of a scene's statement its field or surface.
        `says`: Text of the statement.
        check: Decides a claim: the statement is proved if `check(**claim)` is True.
        claim: Arguments of the check.
        wrong: Arguments that differ in a wrong claim, which the check has to refuse; beside a
            correction, those of a wrong correction.
        correction: Arguments that differ in what holds instead of a refuted claim: the check
            holds with them, and fails for the claim.
        formula: LaTeX, or a function that gives it.
        verdict: Status if the check succeeds: the statement is proved, or the printed statement is
            refuted, or it holds under a condition that is itself proved.
        printed: Printed text, of a comparison with the paper.
        derived: Derived text beside it.
        proof: Description of the check.
        consequence: Consequence of a refuted statement.
        witness: Function that gives an exact point or motion that shows the statement.
    """

    name: str
    equation: str
    says: str
    check: Callable[..., bool]
    claim: Arguments
    wrong: Arguments
    correction: Arguments | None = None
    formula: str | Callable[[], str] = ""
    verdict: Verdict = "proved"
    printed: str = ""
    derived: str = ""
    proof: str = ""
    consequence: str = ""
    witness: Callable[[], Mapping[str, str]] | None = field(default=None)

    @cached_property
    def latex(self) -> str:
        """Formula as LaTeX; empty if there is none."""
        return self.formula if isinstance(self.formula, str) else self.formula()

    def holds(self) -> bool:
        """True if the claim holds; with a correction, if that holds and the claim fails.

        Raises Undecided if the check does.
        """
        if self.correction is None:
            return self.check(**self.claim)
        return self.check(**merged(self.claim, self.correction)) and not self.check(**self.claim)

    @property
    def mutant(self) -> Statement:
        """The statement with its wrong claim, or wrong correction, which has to fail."""
        if self.correction is None:
            return replace(self, claim=merged(self.claim, self.wrong))
        return replace(self, correction=self.wrong)


@dataclass(frozen=True)
class Finding:
    """Outcome of a statement: its status, its witness if it has one, and the seconds it took."""

    statement: Statement
    status: Status
    witness: Mapping[str, str]
    seconds: float

    @property
    def settled(self) -> bool:
        """True if the statement has its expected status."""
        return self.status == self.statement.verdict


def settle(statement: Statement) -> Finding:
    """Finding of a statement, whose claim is checked; Undecided becomes the status "undecided"."""
    start = perf_counter()
    witness: Mapping[str, str] = {}
    try:
        status: Status = statement.verdict if statement.holds() else "failed"
        if statement.witness and status != "failed":
            witness = statement.witness()
    except Undecided:
        status = "undecided"
    return Finding(statement, status, witness, perf_counter() - start)


Sections = Mapping[str, Callable[[], Iterable[Statement]]]
"""Statements by the title of their section, derived on request."""
Report = Mapping[str, Sequence[Finding]]
"""Results by section title."""


def run(
    chosen: Mapping[str, Iterable[Statement]],
    advance: Callable[[Finding], None] = lambda result: None,
) -> Report:
    """Findings of statements, checked one by one; `advance` is called with each."""

    def settled(statement: Statement) -> Finding:
        result = settle(statement)
        advance(result)
        return result

    return {title: tuple(map(settled, section)) for title, section in chosen.items()}


def named(
    name: str, sections: Sections, families: Mapping[str, str]
) -> dict[str, tuple[Statement, ...]]:
    """Statements of a section, of a name or of names that continue it by a point, by section.

    Only sections of its family are derived: `families` has the first words of their names. Raises
    InvalidInput if there are none.
    """
    if name in sections:
        return {name: tuple(sections[name]())}
    family, names, found = name.partition(".")[0], list(sections), {}
    for title, section in sections.items():
        if family in families[title].split():
            derived = {one.name: one for one in section()}
            names += derived
            if chosen := [k for k in derived if k == name or k.startswith(f"{name}.")]:
                found[title] = tuple(derived[k] for k in chosen)
    if found:
        return found
    close = close_names(name, names, 5, 0.3) or list(sections)
    raise InvalidInput(
        "--only", name, f"a group, or the name of statements, such as {', '.join(close)}"
    )


def record(result: Finding) -> dict[str, Any]:
    """Result as plain data: id, equation, statement, status, seconds; then texts and a witness.

    A statement about a printed text has all texts and a witness, which may be empty.
    """
    statement = result.statement
    plain: dict[str, Any] = {
        "id": statement.name,
        "equation": statement.equation,
        "statement": statement.says,
        "status": result.status,
        "seconds": round(result.seconds, 4),
    }
    if statement.printed:
        plain |= {"printed": statement.printed, "derived": statement.derived}
        plain |= {"proof": statement.proof, "consequence": statement.consequence}
    if result.witness or statement.printed:
        plain |= {"witness": dict(result.witness)}
    return plain


def line(result: Finding) -> str:
    """Result as one line: status, seconds, equation, statement."""
    statement = result.statement
    return f"{result.status:<11} {result.seconds:7.2f} s  {statement.equation}: {statement.says}"


Residuals = tuple[sp.Expr, ...]


def proof(
    name: str, equation: str, says: str, claim: sp.Expr, residuals: Callable[[sp.Expr], Residuals]
) -> Statement:
    """Statement about an expression that the derivation uses.

    `residuals` substitutes an expression into its definition: all residuals of a true one are zero,
    and not all of any other. The wrong claim is the expression plus 1.
    """
    check = partial(_leaves_nothing, residuals)
    return Statement(name, equation, says, check, {"claim": claim}, {"claim": claim + 1})


def _leaves_nothing(residuals: Callable[[sp.Expr], Residuals], claim: sp.Expr) -> bool:
    return all(residual == 0 for residual in residuals(claim))


def vanishes(claim: sp.Expr) -> bool:
    """Check that an expression is identically zero."""
    return bool(sp.expand(sp.together(claim)) == 0)
