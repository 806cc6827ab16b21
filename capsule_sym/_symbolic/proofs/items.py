"""Items of `capsule-sym verify`: a statement, its claim as data, and the check of a claim.

The claim is data, so that the same check can be applied to a changed claim: `mutant` is one with a
sign or a row changed, and it has to fail.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property, partial
from time import perf_counter
from typing import Any, Literal

import sympy as sp

from capsule_sym._errors import InvalidInput
from capsule_sym._symbolic.model.elimination import Undecided

Verdict = Literal["proved", "refuted", "conditional"]
Status = Literal["proved", "refuted", "conditional", "failed", "undecided"]


AS_PRINTED = "as printed"
"""Text of `derived` if the derivation gives the printed statement."""


@dataclass(frozen=True)
class Item:
    """A statement of the theory.

    `verdict` is the status if the check succeeds: the statement is proved, or (an erratum) the
    printed statement is refuted, or it holds under a condition that is itself proved. `formula`
    is LaTeX, or gives it. `printed`, `derived`, `consequence` and `witness` belong to errata;
    `proof` describes the check.
    """

    id: str
    equation: str
    statement: str
    claim: Any
    check: Callable[[Any], bool]
    mutant: Any
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


@dataclass(frozen=True)
class Result:
    """Outcome of an item: its status, the witness if it has one, and the seconds it took."""

    item: Item
    status: Status
    witness: Mapping[str, str]
    seconds: float

    @property
    def settled(self) -> bool:
        """True if the item has its expected status."""
        return self.status == self.item.verdict


def settle(item: Item) -> Result:
    """Check an item's claim."""
    start = perf_counter()
    witness: Mapping[str, str] = {}
    try:
        status: Status = item.verdict if item.check(item.claim) else "failed"
        if item.witness and status != "failed":
            witness = item.witness()
    except Undecided:
        status = "undecided"
    return Result(item, status, witness, perf_counter() - start)


Sections = Mapping[str, Callable[[], tuple[Item, ...]]]
"""Items by the title of their section, derived on request."""
Report = Mapping[str, tuple[Result, ...]]
"""Results by section title."""


def run(
    chosen: Mapping[str, Iterable[Item]], advance: Callable[[Result], None] = lambda result: None
) -> Report:
    """Check items one by one; `advance` is called with each result."""

    def settled(item: Item) -> Result:
        result = settle(item)
        advance(result)
        return result

    return {title: tuple(map(settled, section)) for title, section in chosen.items()}


def named(
    name: str, sections: Sections, families: Mapping[str, str], known: Iterable[str] = ()
) -> dict[str, tuple[Item, ...]]:
    """Statement of a name by section title; raises InvalidInput for none.

    Only sections of its family are derived: `families` has the first words of their names.
    """
    family, names = name.partition(".")[0], list(known)
    for title, section in sections.items():
        if family in families.get(title, family).split():
            derived = {item.id: item for item in section()}
            if name in derived:
                return {title: (derived[name],)}
            names += derived
    names = list(dict.fromkeys(names))
    if close := get_close_matches(name, names, n=5, cutoff=0.3) or names[:5]:
        raise InvalidInput("--only", name, f"the name of a statement, such as {', '.join(close)}")
    begins = ", ".join(" ".join(families.values()).split())
    raise InvalidInput("--only", name, f"the name of a statement, which begins with {begins}")


def record(result: Result) -> dict[str, Any]:
    """Result as plain data: id, equation, statement, status, seconds, and the texts of errata."""
    item = result.item
    plain: dict[str, Any] = {
        "id": item.id,
        "equation": item.equation,
        "statement": item.statement,
        "status": result.status,
        "seconds": round(result.seconds, 4),
    }
    if item.printed:
        plain |= {"printed": item.printed, "derived": item.derived}
        plain |= {"proof": item.proof, "consequence": item.consequence}
    if result.witness or item.printed:
        plain |= {"witness": dict(result.witness)}
    return plain


def line(result: Result) -> str:
    """Result as one line: status, seconds, equation, statement."""
    item = result.item
    return f"{result.status:<11} {result.seconds:7.2f} s  {item.equation}: {item.statement}"


Residuals = tuple[sp.Expr, ...]


def proof(
    name: str,
    equation: str,
    statement: str,
    claim: sp.Expr,
    residuals: Callable[[sp.Expr], Residuals],
) -> Item:
    """Item for an expression that the derivation uses.

    `residuals` substitutes an expression into its definition: all residuals of a true one are zero,
    and not all of any other.
    """
    return Item(name, equation, statement, claim, partial(_leaves_nothing, residuals), claim + 1)


def _leaves_nothing(residuals: Callable[[sp.Expr], Residuals], claim: sp.Expr) -> bool:
    return all(residual == 0 for residual in residuals(claim))


def vanishes(claim: sp.Expr) -> bool:
    """Check that an expression is identically zero."""
    return bool(sp.expand(sp.together(claim)) == 0)
