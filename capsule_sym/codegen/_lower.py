"""Straight-line functions from blocks of expressions."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from capsule_sym.codegen._blocks import Assignments


@dataclass(frozen=True)
class Kernel:
    """Straight-line function ready to print: steps in order, results, and number of operations."""

    name: str
    doc: str
    arguments: tuple[str, ...]
    constants: tuple[str, ...]
    steps: tuple[tuple[str, sp.Expr], ...]
    returns: tuple[str, ...]
    results: tuple[sp.Expr, ...]
    operations: int
    array: bool = False
    """True if the results are entries of one array."""
    single: bool = False
    """True if the single result is returned without a tuple."""

    @property
    def cost(self) -> str:
        """Number of operations, as text."""
        return f"{self.operations} operation{'s' * (self.operations != 1)}"


def lower(
    name: str,
    doc: str,
    block: Assignments,
    arguments: tuple[str, ...],
    returns: tuple[str, ...],
    constants: frozenset[str],
    *,
    inline: bool = False,
    single: bool = False,
    array: bool = False,
) -> Kernel:
    """Kernel of a block: only the steps that the results need, with shared common subexpressions.

    Results are steps of their names, or `inline` expressions. Raises ValueError for a symbol that
    is neither argument, constant nor assigned in the block, and for a result that is not assigned.
    """
    given = set(arguments)
    expressions = _needed(block, returns, given)
    shared, reduced = sp.cse(
        list(expressions.values()), sp.numbered_symbols("t"), order="canonical"
    )
    values = dict(zip(expressions, reduced, strict=True))
    # A result with an argument's name (a doubled response, say) must not replace it midway.
    named = {} if inline else {key: value for key, value in values.items() if key not in given}
    steps = {str(symbol): expression for symbol, expression in shared} | named
    ordered = tuple(_in_order(steps))
    results = tuple(sp.Symbol(key) if key in named else values[key] for key in returns)
    free = {str(symbol) for value in (*steps.values(), *results) for symbol in value.free_symbols}
    unknown = free - given - constants - steps.keys()
    if unknown:
        raise ValueError(f"kernel {name}: unknown symbols {sorted(unknown)}")
    used = tuple(sorted(free & constants))
    operations = int(sp.count_ops([*steps.values(), *results]))
    return Kernel(
        *(name, doc, arguments, used, ordered, returns, results, operations), array, single
    )


def _needed(block: Assignments, returns: tuple[str, ...], given: set[str]) -> dict[str, sp.Expr]:
    expressions = {str(target): sp.sympify(expression) for target, expression in block}
    wanted: set[str] = set()
    pending = list(returns)
    while pending:
        target = pending.pop()
        if target in wanted or target not in expressions:
            continue
        wanted.add(target)
        names = {str(symbol) for symbol in expressions[target].free_symbols}
        pending += sorted(names - given)
    missing = [target for target in returns if target not in expressions]
    if missing:
        raise ValueError(f"the block does not give {missing}")
    return {target: expressions[target] for target in expressions if target in wanted}


def _in_order(steps: dict[str, sp.Expr]) -> list[tuple[str, sp.Expr]]:
    """Steps with each after those it uses, otherwise in their own order."""
    ordered: dict[str, sp.Expr] = {}

    def place(name: str) -> None:
        if name in ordered or name not in steps:
            return
        for symbol in sorted(map(str, steps[name].free_symbols)):
            place(symbol)
        ordered[name] = steps[name]

    for name in steps:
        place(name)
    return list(ordered.items())
