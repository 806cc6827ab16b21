"""From a block of expressions to the text of a straight-line function."""

from __future__ import annotations

import re
from dataclasses import dataclass

import sympy as sp

from capsule_sym.codegen._blocks import Assignments
from capsule_sym.codegen._printers import Language


@dataclass(frozen=True)
class Kernel:
    """A straight-line function ready to print: steps in order, results, and what they cost."""

    name: str
    doc: str
    arguments: tuple[str, ...]
    constants: tuple[str, ...]
    steps: tuple[tuple[str, sp.Expr], ...]
    returns: tuple[str, ...]
    results: tuple[sp.Expr, ...]
    operations: int
    typed: bool = False
    """Whether Python's function has annotations."""
    array: bool = False
    """Whether C writes the results into one array."""
    single: bool = False
    """Whether Python gets its one result alone, not in a tuple."""

    def text(self, language: Language) -> str:
        """The function in a target language."""
        lines = [language.unpack.format(name) for name in self.constants]
        lines += [
            language.assign.format(name, language.expression(step)) for name, step in self.steps
        ]
        results = [language.expression(result) for result in self.results]
        fields = returned = ""
        if language.comment == "#":
            signature = ", ".join(("c", *self.arguments))
            if self.typed:
                signature = ", ".join(f"{name}: Any" for name in ("c", *self.arguments))
                returned = " -> Any"
            joined = ", ".join(results) if self.single else f"({', '.join(results)},)"
        elif language.comment == "%":
            signature = ", ".join(("c", *self.arguments))
            joined = f"[{', '.join(self.returns)}] = "
            # All at once: a result may have an argument's name.
            lines.append(f"{joined}deal({', '.join(results)});")
        elif language.kind == "double":
            doubles = (f"double {name}" for name in self.arguments)
            signature = ", ".join(("const capsule_constants *restrict c", *doubles))
            joined = ", ".join(results)
            fields = f"    double {', '.join(self.returns)};\n"
        else:
            constants = "segment" if language.kind == "real" else "segment_sizes"
            arguments = tuple(f"{language.kind} {name}" for name in self.arguments)
            given = (f"const {constants} *c", *arguments)
            if not self.constants:
                lines.insert(0, "(void)c;")
            if self.array:
                returned = "void"
                given += (f"{language.kind} by[{len(self.returns)}]",)
                joined = "".join(f"    by[{i}] = {value};\n" for i, value in enumerate(results))
            elif self.single:
                returned, joined = language.kind, f"    return {results[0]};\n"
            else:
                returned = "void"
                given += tuple(f"{language.kind} *{name}" for name in self.returns)
                pairs = zip(self.returns, results, strict=True)
                joined = "".join(f"    *{name} = {value};\n" for name, value in pairs)
            signature = ", ".join(given)
        text = language.function.format(
            name=self.name,
            doc=self.doc,
            operations=f"{self.operations} operation{'s' * (self.operations != 1)}",
            signature=signature,
            body="".join(f"    {line}\n" for line in lines),
            results=joined,
            fields=fields,
            returned=returned,
        )
        return text


_WIDTH = 100


def wrapped(text: str, mark: str = "", comment: str = "") -> str:
    """The text with its long lines broken at spaces.

    Code goes on after a mark, a comment in a comment of its own, where the language has them.
    """
    lines: list[str] = []
    for line in text.splitlines():
        start = re.match(r"\s*", line)
        indent, end = (start[0] if start else "") + "    ", mark
        if comment and line.lstrip().startswith(comment):
            indent, end = f"{start[0] if start else ''}{comment} ", ""
        if not mark and len(line) > _WIDTH and (named := _ASSIGNED.fullmatch(line)):
            line = f"{named[1]}({named[2]})"  # Python breaks lines within brackets only
        while len(line) > _WIDTH:
            cut = line.rfind(" ", len(indent), _WIDTH + 1 - len(end))
            if cut < 0:
                break
            lines.append(line[:cut] + end)
            line = indent + line[cut + 1 :]
        lines.append(line)
    return "\n".join(lines) + "\n"


_ASSIGNED = re.compile(r"(\s*\w+ = )([^(].*[^;])")


def lower(
    name: str,
    doc: str,
    block: Assignments,
    arguments: tuple[str, ...],
    returns: tuple[str, ...],
    constants: frozenset[str],
    *,
    single: bool = False,
) -> Kernel:
    """The kernel of a block: only what the results need, common subexpressions shared.

    Raises ValueError for a symbol that is neither argument, constant nor assigned in the block.
    """
    given = set(arguments)
    expressions = _needed(block, returns, given)
    shared, reduced = sp.cse(
        list(expressions.values()), sp.numbered_symbols("t"), order="canonical"
    )
    values = dict(zip(expressions, reduced, strict=True))
    # A result with an argument's name (a doubled response, say) must not replace it midway.
    steps = {str(symbol): expression for symbol, expression in shared}
    steps |= {target: value for target, value in values.items() if target not in given}
    ordered = _in_order(steps)
    results = tuple(values[target] if target in given else sp.Symbol(target) for target in returns)
    free = {str(symbol) for value in (*steps.values(), *results) for symbol in value.free_symbols}
    unknown = free - given - constants - steps.keys()
    if unknown:
        raise ValueError(f"kernel {name}: unknown symbols {sorted(unknown)}")
    used = tuple(sorted(free & constants))
    operations = int(sp.count_ops([*steps.values(), *results]))
    return Kernel(
        name, doc, arguments, used, tuple(ordered), returns, results, operations, single=single
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
    """The steps so that each comes after those it uses, otherwise in their own order."""
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
