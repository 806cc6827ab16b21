"""Input of all backends, derived from the chosen model."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from capsule_sym._symbolic.model import declaration, jacobian
from capsule_sym._symbolic.model import formulas as model_formulas
from capsule_sym._symbolic.model.basis import FORCED
from capsule_sym._symbolic.model.extended import coefficients, extended_rates
from capsule_sym._symbolic.model.formulas import ARGUMENTS, Formula
from capsule_sym._symbolic.model.model import SEGMENTS, Linear
from capsule_sym._symbolic.model.symbols import PARAMETERS, PULSED
from capsule_sym.codegen import INPUTS
from capsule_sym.codegen._blocks import OWN, Assignments, blocks, segment_constants, shared_blocks
from capsule_sym.codegen._interface import Interface
from capsule_sym.codegen._lower import Kernel, lower
from capsule_sym.codegen._rounding import CIRCULAR_UNITS, units

PARAMETER_NAMES = tuple(map(str, PARAMETERS))
CONSTANTS = (
    *PARAMETER_NAMES,
    *(("high",) if PULSED else ()),
    *("contact", "drift"),
    *OWN,
    *("q", "nu", "slow", *(() if PULSED else ("Z2", "resonant")), "fast", "rate"),
)
"""Names of a segment's constants."""

_FORCED = frozenset(map(str, FORCED))

Matrix = Sequence[Sequence[sp.Expr]]


@dataclass(frozen=True)
class Derived:
    """Expressions that are printed in each language."""

    header: str
    """Header of generated files: the command and its inputs."""
    digest: str
    jet_order: int
    series_terms: int
    shared: tuple[Kernel, ...]
    """Kernels of any scene with its kind of drive."""
    kernels: tuple[Kernel, ...]
    """Kernels of this scene."""
    formulas: tuple[Kernel, ...]
    sizes: tuple[Kernel, ...]
    """Sizes of those formulas that have one."""
    units: dict[str, int]
    """Rounding error of each formula in units of its size."""
    interface: Interface

    @property
    def bounds(self) -> list[str]:
        """Names of the friction bounds, each once."""
        return sorted({str(bound) for bound in declaration.chosen().bounds.values()})


def derive(header: str, digest: str, *, whole: bool = True) -> Derived:
    """Input of the backends; if not `whole`, without the kernels and formulas of this scene."""
    config, interface = read("kernels"), Interface(read("interface"))
    order, found = config["jet_order"], formulas() if whole else ()
    return Derived(
        header,
        digest,
        order,
        config["series_terms"],
        tuple(_kernels(config, shared_blocks())),
        tuple(_kernels(config, blocks(order))) if whole else (),
        tuple(map(lowered, found)),
        tuple(lowered(formula.size) for formula in found if formula.sized),
        _units(found),
        interface,
    )


def read(name: str) -> dict[str, Any]:
    """Content of the table `name`.toml of the inputs, read again by each call."""
    return tomllib.loads((INPUTS / f"{name}.toml").read_text(encoding="utf-8"))


def formulas() -> tuple[Formula, ...]:
    """Formulas that the model has, in the order of `codegen/kernels.toml` with its arguments."""
    found, known = list[Formula](), model_formulas.formulas()
    for entry in read("kernels")["formula"]:
        if (result := known.get(entry["name"])) is None:
            continue
        results = result if isinstance(result, dict) else {"result": result}
        for key in ("arguments", "carried"):
            entry[key] = tuple(ARGUMENTS[name] for name in entry.get(key, ()))
        found.append(Formula(**entry, results=tuple(results.items())))
    return tuple(found)


def _kernels(config: dict[str, Any], derivations: Mapping[str, Assignments]) -> Iterable[Kernel]:
    """Kernels of those blocks that are given; with pulses without forced responses."""
    for entry in config["kernel"]:
        block = derivations.get(entry.get("block", entry["name"]))
        if block is None:
            continue
        arguments, returns = entry["arguments"], entry["returns"]
        if PULSED:
            arguments = [name for name in arguments if name not in _FORCED]
            returns = [name for name in returns if name not in _FORCED]
        if not returns:
            continue
        if returns[0].startswith("@"):
            hidden = ("drive",)
            returns = [str(target) for target, _ in block if not str(target).startswith(hidden)]
        columns = ", ".join(map(str, jacobian.COLUMNS))
        doc = entry["doc"].replace("@jacobian_columns", columns)
        names = frozenset(CONSTANTS)
        yield lower(entry["name"], doc, block, tuple(arguments), tuple(returns), names)


def lowered(formula: Formula) -> Kernel:
    """Kernel of a formula."""
    return lower(
        formula.name,
        formula.doc,
        [(sp.Symbol(name), value) for name, value in formula.results],
        tuple(map(str, formula.arguments)),
        tuple(name for name, _ in formula.results),
        frozenset(CONSTANTS),
        inline=True,
        single=len(formula.results) == 1,
        array=formula.array,
    )


def _units(found: Iterable[Formula]) -> dict[str, int]:
    """Rounding errors of all formulas with a size, by names such as FORCE_UNITS.

    A recurrence has one by each carried argument, such as FORCING_NEXT_BEFORE_UNITS.
    """
    given = dict.fromkeys(("cos_theta", "sin_theta"), CIRCULAR_UNITS)
    for segment in SEGMENTS:
        for name, value in segment_constants(segment.index):
            block = [(sp.Symbol("_value"), value)]
            kernel = lower(str(name), "", block, PARAMETER_NAMES, ("_value",), frozenset())
            given[str(name)] = max(given.get(str(name), 0), units(kernel, {}) - 1)
    numbers = {}
    for formula in found:
        if formula.sized:
            kernel = lowered(formula)
            for argument in formula.carried:
                numbers[f"{formula.name}_{argument}_units"] = units(kernel, given, str(argument))
            if not formula.carried:
                numbers[f"{formula.name}_units"] = units(kernel, given)
    return {name.upper(): number for name, number in numbers.items()}


def matrices(segment: Linear) -> dict[str, Matrix]:
    """Rates and guards of a field: rows of coefficients of `EXTENDED` and, last, of 1."""
    found = {"rates": extended_rates(segment), "guards": segment.guards}
    return {name: [coefficients(row) for row in rows] for name, rows in found.items()}


def entries(matrix: Matrix) -> list[tuple[int, int, sp.Expr]]:
    """Non-zero entries of a matrix, by row and column."""
    rows = enumerate(matrix)
    return [(i, j, sp.factor(a)) for i, row in rows for j, a in enumerate(row) if a != 0]
