"""Parts of a declaration: parameters, a device, drive, regions and modes; texts of relations."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import sympy as sp

Slider = tuple[float, float, float]
"""Ends and step of the explorer's slider."""


class BadDeclaration(Exception):
    """Raised for a declaration from which no model can be derived; its text begins FILE:LINE."""


@dataclass(frozen=True)
class Fact:
    """Range and texts of a parameter or a quantity, and its slider in the explorer."""

    low: float
    high: float
    label: str
    """Short label, as on an axis."""
    about: str
    """Explanatory sentence for a first-time reader."""
    letter: str
    slider: Slider

    @property
    def positive(self) -> bool:
        """True if all allowed values are above 0."""
        return self.low > 0

    @property
    def signed(self) -> bool:
        """True if negative values are allowed."""
        return self.low < 0


@dataclass(frozen=True)
class Parameter(Fact):
    """A dimensionless parameter, with all its texts and bounds."""

    symbol: sp.Symbol
    default: float
    definition: str
    """Its scaling, as in the documentation of `Parameters`."""
    tex: str
    si: str
    """Relation to a device's quantities and units and earlier parameters; empty without one."""

    @property
    def name(self) -> str:
        """Name in code."""
        return str(self.symbol)


@dataclass(frozen=True)
class Quantity(Fact):
    """A quantity of a device in SI units.

    An optional one may be omitted: its `value` is the default. Else `value` is an example.
    """

    name: str
    unit: str
    value: float
    optional: bool


@dataclass(frozen=True)
class DeclaredUnit:
    """A unit of results, by its relation to the quantities and earlier units of a device."""

    name: str
    """Name in `PhysicalParameters`, such as friction_force."""
    letter: str
    relation: str
    about: str


@dataclass(frozen=True)
class SpringRange:
    """The states between the stops, or beyond one, and the stiffness of a spring there."""

    name: str
    where: tuple[sp.Basic, ...]
    stiffness: sp.Expr
    line: int


@dataclass(frozen=True)
class Mode:
    """Drift in a direction (1, -1) against friction, or rest (0), held by friction.

    `friction` is its force on the capsule in drift, with its sign; 0 stands there for rest.
    """

    name: str
    way: int
    where: tuple[sp.Basic, ...]
    friction: sp.Expr
    line: int


@dataclass(frozen=True)
class Drive:
    """Force that drives the mass: an amplitude times a cosine, or pulses between two levels.

    Pulses are `amplitude` for a `share` of each period, from its start on, and `low` for the rest.
    """

    amplitude: sp.Symbol
    frequency: sp.Symbol
    low: sp.Symbol | None = None
    share: sp.Symbol | None = None

    @property
    def pulsed(self) -> bool:
        """True if the drive is constant between edges."""
        return self.share is not None


def excess(relation: sp.Basic) -> sp.Expr:
    """Function that is positive where a strict inequality holds."""
    return relation.gts - relation.lts


# A relation of a device is text, since SymPy would reorder its factors. Every language computes it
# in the written order and gets the same bits.
_NAME = re.compile(r"\b[A-Za-z_]\w*")


def read(relation: str, known: Mapping[str, sp.Expr]) -> sp.Expr:
    """Relation as an expression, by those of its names; raises ValueError if it is not one."""
    if unknown := [one for one in _NAME.findall(relation) if one not in {*known, "sqrt"}]:
        raise ValueError(f"unknown symbol {unknown[0]}")
    if not re.fullmatch(r"[\w.\s()+*/-]+", relation) or "**" in relation or "//" in relation:
        raise ValueError("is not made of names, numbers, + - * /, sqrt and brackets")
    try:
        return sp.sympify(relation, locals=dict(known))
    except (sp.SympifyError, TypeError, SyntaxError):
        raise ValueError("is no arithmetic") from None


def spelled(relation: str, name: Callable[[str], str], root: str) -> str:
    """Relation in a language, given its spelling of names and of the square root."""
    return _NAME.sub(lambda one: root if one[0] == "sqrt" else name(one[0]), relation)


def substituted(relation: str, texts: Mapping[str, str]) -> str:
    """Relation with texts substituted for names."""
    return _NAME.sub(lambda one: texts.get(one[0], one[0]), relation)


def shown(relation: str) -> str:
    """Relation as readers see it, with spaces for products."""
    return relation.replace(" * ", " ")


_KG, _M, _S = sp.symbols("kg m s", positive=True)
_BASE = {"kg": _KG, "m": _M, "s": _S, "rad": sp.Integer(1), "N": _KG * _M / _S**2}


def unit_of(text: str) -> sp.Expr:
    """A unit such as "N s/m" in kg, m and s; raises ValueError for others."""
    if unknown := [one for one in _NAME.findall(text) if one not in _BASE]:
        raise ValueError(f"{unknown[0]} is none of {', '.join(_BASE)}")
    return sp.sympify(text.replace(" ", "*").replace("^", "**") or "1", locals=_BASE)
