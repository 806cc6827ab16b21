"""C99: the kernels, the certified step's formulas over its number types, and the interface."""

from __future__ import annotations

from typing import ClassVar

import sympy as sp

from capsule_sym._symbolic.model.formulas import edge_planes, impact_planes
from capsule_sym._symbolic.model.model import LEVELS, SEGMENTS
from capsule_sym._symbolic.model.symbols import MODEL, PARAMETERS, PULSED, omega
from capsule_sym.codegen._backend import Language
from capsule_sym.codegen._blocks import segment_constants
from capsule_sym.codegen._derived import CONSTANTS
from capsule_sym.codegen._lower import Kernel
from capsule_sym.codegen.backends.c import interface
from capsule_sym.codegen.backends.c.printers import Bounds, DoubleCode, Numbers


class C(Language):
    """Functions of pointers to constants, in double precision."""

    printer = DoubleCode()
    comment = "//"
    kind = "double"
    unpack = "const double {0} = c->{0};"
    assign = "const double {} = {};"
    files: ClassVar = {
        f"c/capsule_{name}": f"{name}.in"
        for name in ("kernels.h", "kernels.c", "formulas.h", "interface.h")
    }

    def function(self, kernel: Kernel) -> str:
        """Kernel as a function that returns a struct of its own."""
        returned = f"{kernel.name}_results"
        doubles = "".join(f", double {name}" for name in kernel.arguments)
        results = ", ".join(map(self.expression, kernel.results))
        return (
            f"/* {kernel.doc} {kernel.cost}. */\n"
            f"typedef struct {{\n    double {', '.join(kernel.returns)};\n}} {returned};\n"
            f"static {returned} {kernel.name}(const capsule_constants *restrict c{doubles})\n"
            f"{{\n{self.voided(kernel)}{self.body(kernel)}"
            f"    return ({returned}){{{results}}};\n}}\n"
        )

    def voided(self, kernel: Kernel) -> str:
        """Line that uses unused arguments, of which compilers warn."""
        names = [*(() if kernel.constants else ("c",)), *self.unused(kernel)]
        return f"    {', '.join(f'(void){name}' for name in names)};\n" if names else ""

    def texts(self) -> dict[str, str]:
        """Constants, functions over each number type, and the interface."""
        derived = self.derived
        real, bound = Real(derived), Bound(derived)
        own = {symbol: sp.Symbol(f"c->{symbol}") for symbol in PARAMETERS}
        kernels = (*derived.shared, *(k for k in derived.kernels if not k.name.startswith("jet")))
        bounds = " + ".join(f"(c)->{name}" for name in derived.bounds)
        return {
            **super().texts(),
            "c_fields": "\n    ".join(
                f"double {name};" for name in CONSTANTS if name != "resonant"
            ),
            "used_parameters": _used_parameters(),
            "segment_constants": self.cases("{}", {}),
            "field_constants": real.cases("num({}.0)", own),
            "kernels": "\n\n".join(map(self.function, kernels)),
            "one_over": ", ".join(f"1.0 / {n}" for n in range(1, derived.series_terms + 4)),
            "real_formulas": "\n".join(map(real.function, derived.formulas)),
            "bound_formulas": "\n".join(map(bound.function, derived.sizes)),
            "units": ", ".join(f"{name} = {number}" for name, number in derived.units.items()),
            "friction_bounds": f"({bounds})",
            "classification": _classification(),
            **interface.texts(derived.interface),
        }

    def cases(self, number: str, own: dict[sp.Symbol, sp.Symbol]) -> str:
        """Cases of a switch by a field's number, which assign its mode and its constants.

        `number` is the format of the mode's integers; `own` has symbols to be put for parameters.
        """
        text = ""
        for one in SEGMENTS:
            modes = {"contact": one.contact, "drift": one.drift}
            modes |= {"high": 1 - one.level} if PULSED else {}
            values = {name: number.format(mode) for name, mode in modes.items()}
            for name, value in segment_constants(one.index):
                values[str(name)] = self.expression(value.xreplace(own))
            lines = "".join(f"        c->{name} = {value};\n" for name, value in values.items())
            text += f"    case {one.index}: /* {one.mode} */\n{lines}        break;\n"
        return text


class Real(C):
    """Functions over any number type."""

    printer = Numbers()
    kind, constants = "real", "segment"
    unpack = "const real {0} = c->{0};"
    assign = "const real {} = {};"

    def function(self, kernel: Kernel) -> str:
        """Kernel as a function that returns its single result, or writes to array or pointers."""
        given = [f"const {self.constants} *c", *(f"{self.kind} {a}" for a in kernel.arguments)]
        results = [self.expression(result) for result in kernel.results]
        returned = "void"
        if kernel.array:
            given.append(f"{self.kind} by[{len(results)}]")
            lines = [f"by[{i}] = {value};" for i, value in enumerate(results)]
        elif kernel.single:
            returned, lines = self.kind, [f"return {results[0]};"]
        else:
            given += [f"{self.kind} *{name}" for name in kernel.returns]
            lines = [
                f"*{name} = {value};" for name, value in zip(kernel.returns, results, strict=True)
            ]
        body = self.voided(kernel) + self.body(kernel) + "".join(f"    {line}\n" for line in lines)
        return (
            f"/* {kernel.doc} {kernel.cost}. */\n"
            f"static inline {returned} {kernel.name}({', '.join(given)})\n{{\n{body}}}\n"
        )


class Bound(Real):
    """Functions of bounds, which are doubles or vectors of them."""

    printer = Bounds()
    kind, constants = "bound", "segment_sizes"
    unpack = "const bound {0} = c->{0};"
    assign = "const bound {} = {};"


def _used_parameters() -> str:
    """Parameters in the constants of segments, and omega of a cosine, as variables."""
    values = [value for segment in SEGMENTS for _, value in segment_constants(segment.index)]
    used = (set() if PULSED else {omega}).union(*(value.free_symbols for value in values))
    names = (p.name for p in PARAMETERS if p in used)
    return "\n".join(f"    const double {name} = p->{name};" for name in names)


def _classification() -> str:
    """Fields by contact and drift, their properties by number, and planes of impact."""
    by_mode = {(g.level, g.contact, g.drift): g.index for g in SEGMENTS}
    contacts, stops = range(len(MODEL.regions)), range(1, len(MODEL.regions))
    planes, ways = impact_planes(), (-1, 1)
    tables = {
        "FIELD_OF[CAPSULE_LEVEL_COUNT][CAPSULE_STOP_COUNT + 1][3]": [
            [[by_mode[level, near, drift] for drift in (-1, 0, 1)] for near in contacts]
            for level in range(len(LEVELS))
        ],
        "LEVEL_OF[CAPSULE_FIELD_COUNT]": [g.level for g in SEGMENTS],
        "CONTACT_OF[CAPSULE_FIELD_COUNT]": [g.contact for g in SEGMENTS],
        "DRIFT_OF[CAPSULE_FIELD_COUNT]": [g.drift for g in SEGMENTS],
        "FLOW_OF[CAPSULE_FIELD_COUNT]": [2 * g.contact + abs(g.drift) for g in SEGMENTS],
        "ONE_OF_FLOW[CAPSULE_FLOW_COUNT]": [by_mode[0, k, d] for k in contacts for d in (0, 1)],
        "IMPACT_PLANE[CAPSULE_STOP_COUNT][2][2]": [
            [[planes[k, v_c, v_r] for v_r in ways] for v_c in ways] for k in stops
        ],
        "EDGE_PLANE[CAPSULE_LEVEL_COUNT]": [*(edge_planes() or (0,))],
    }
    spelt = {name: str(table).replace("[", "{").replace("]", "}") for name, table in tables.items()}
    return "".join(f"static const signed char {name} = {table};\n" for name, table in spelt.items())
