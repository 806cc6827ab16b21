"""Every proof of the theory in one list, and its report in LaTeX and Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Any

from capsule_sym.symbolic import (
    appendices,
    basis_proofs,
    errata,
    findings,
    flow_proofs,
    geometry_proofs,
    inner_products,
    table_proofs,
)
from capsule_sym.symbolic.basis_proofs import Proof
from capsule_sym.symbolic.items import Item, Result, settle


def _leaves_nothing(proof: Proof, claim: Any) -> bool:
    return all(residual == 0 for residual in proof.check(claim))


def _flow_items() -> tuple[Item, ...]:
    """The proofs of the closed-form flow, which leave residuals."""
    return tuple(
        Item(
            id=proof.name,
            equation=proof.equation,
            statement=proof.statement,
            claim=proof.claim,
            check=partial(_leaves_nothing, proof),
            mutant=proof.claim + 1,
        )
        for proof in (*basis_proofs.proofs(), *flow_proofs.proofs())
    )


SECTIONS: dict[str, Callable[[], tuple[Item, ...]]] = {
    "Errata": errata.items,
    "Errata on tables and planes, conditions, and confirmed statements": findings.items,
    "State space, Eqs. (13)-(15)": geometry_proofs.items,
    "Inner products, Eqs. (16)-(23)": inner_products.items,
    "Tables 1, 2 and 3": table_proofs.items,
    "Appendices A and B": appendices.items,
    "Closed-form flow, Eqs. (7)-(12)": _flow_items,
}
"""What is verified, in the order of the report: a title and the items under it."""


Report = Mapping[str, tuple[Result, ...]]
"""Results by section title."""


def items() -> dict[str, tuple[Item, ...]]:
    """Every statement of the theory with its proof, by section title."""
    return {title: section() for title, section in SECTIONS.items()}


def run(
    chosen: Mapping[str, Iterable[Item]], advance: Callable[[Result], None] = lambda result: None
) -> Report:
    """Settle items one by one; `advance` is told each result."""

    def settled(item: Item) -> Result:
        result = settle(item)
        advance(result)
        return result

    return {title: tuple(map(settled, section)) for title, section in chosen.items()}


def record(result: Result) -> dict[str, Any]:
    """A result as plain data: id, equation, statement, status, seconds, and what errata add."""
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
        plain |= {"consequence": item.consequence}
    if result.witness or item.printed:
        plain |= {"witness": dict(result.witness)}
    return plain


def line(result: Result) -> str:
    """A result as one line: status, seconds, equation, statement."""
    item = result.item
    return f"{result.status:<11} {result.seconds:7.2f} s  {item.equation}: {item.statement}"


def _block(result: Result) -> Iterator[str]:
    item = result.item
    head = f"**{item.equation}** (`{item.id}`): {result.status}"
    if not item.formula:
        yield f"- {head}. {item.statement}"
        return
    yield ""
    if item.printed and item.derived != "as printed":
        yield f"{head}.\n"
        yield f"- printed: {item.printed}"
        yield f"- derived: {item.derived}"
        yield f"- consequence: {item.consequence}"
    else:
        yield f"{head}. {item.statement}"
    if result.witness:
        point = ", ".join(f"{name} = {value}" for name, value in result.witness.items())
        yield f"\n- witness: {point}"
    yield f"\n$${item.formula}$$"


def markdown(report: Report) -> str:
    """The report: every item in the order of `SECTIONS`, formulas in LaTeX."""
    found = [result for results in report.values() for result in results]
    statuses = Counter(result.status for result in found)
    counts = ", ".join(f"{count} {status}" for status, count in sorted(statuses.items()))
    lines = [
        "# What is proved",
        "",
        "Written by `capsule-sym verify --write`. Equation, table and section numbers are those "
        "of B. Guo and Y. Liu, Physica D (2019), doi 10.1016/j.physd.2019.04.008.",
        "",
        f"{len(found)} statements: {counts}. A refuted statement is one of the paper's, with a "
        "point at which it fails; a conditional one holds under the condition it names. "
        "L10, O1, O2 and O3 are defined in `capsule_sym/symbolic/geometry.py`.",
    ]
    for title, results in report.items():
        lines += ["", f"## {title}", ""]
        lines += [text for result in results for text in _block(result)]
    return "\n".join(lines) + "\n"
