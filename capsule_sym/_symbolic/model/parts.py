"""What a declaration is made of: parameters, a device's quantities and units, regions and modes."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import sympy as sp

Slider = tuple[float, float, float]
"""Ends and step of the explorer's slider."""


class BadDeclaration(Exception):
    """A declaration that says what cannot be derived from; its text begins with file and line."""


@dataclass(frozen=True)
class Parameter:
    """A dimensionless parameter, with all that is told of it anywhere."""

    symbol: sp.Symbol
    default: float
    low: float
    high: float
    label: str
    """A few words, as on an axis."""
    definition: str
    """Its scaling, as in the documentation of `Parameters`."""
    about: str
    """A sentence for who sees it for the first time."""
    letter: str
    tex: str
    slider: Slider
    si: str
    """Its relation to the quantities and units of a device; empty if no device is declared."""

    @property
    def name(self) -> str:
        """The name in code."""
        return str(self.symbol)

    @property
    def positive(self) -> bool:
        """Whether 0 is not allowed."""
        return self.low > 0

    @property
    def signed(self) -> bool:
        """Whether values below 0 are allowed."""
        return self.low < 0


@dataclass(frozen=True)
class Quantity:
    """A quantity of a device in SI units; a value that is its default need not be given."""

    name: str
    unit: str
    low: float
    high: float
    value: float
    label: str
    about: str
    letter: str
    slider: Slider
    optional: bool


@dataclass(frozen=True)
class Unit:
    """A unit of results that a device has, by its relation to the quantities."""

    name: str
    """That of `PhysicalParameters`, such as friction_force."""
    letter: str
    relation: str
    about: str


@dataclass(frozen=True)
class Region:
    """The states between the stops, or beyond one, and the stiffness of a spring there."""

    name: str
    where: tuple[sp.Basic, ...]
    stiffness: sp.Expr
    line: int


@dataclass(frozen=True)
class Mode:
    """Drift of a way (1, -1) against a friction, or rest (0), which takes what holds it."""

    name: str
    way: int
    where: tuple[sp.Basic, ...]
    friction: sp.Expr
    line: int


@dataclass(frozen=True)
class Drive:
    """Force that drives the mass: amplitude times a cosine, or pulses between two levels.

    Pulses are `amplitude` for a `share` of each period, from its begin on, and `low` for the rest.
    """

    amplitude: sp.Symbol
    frequency: sp.Symbol
    low: sp.Symbol | None = None
    share: sp.Symbol | None = None

    @property
    def pulsed(self) -> bool:
        """Whether it is constant between edges."""
        return self.share is not None


def excess(relation: sp.Basic) -> sp.Expr:
    """The function that is positive where a strict inequality holds."""
    return relation.gts - relation.lts


# A relation of a device is text, since SymPy would order its factors anew: every language computes
# it in the order in which it is written, and comes to the same bits.
_NAME = re.compile(r"\b[A-Za-z_]\w*")


def read(relation: str, known: Mapping[str, sp.Expr]) -> sp.Expr:
    """A relation in known names; raises ValueError unless it is one."""
    if unknown := [one for one in _NAME.findall(relation) if one not in {*known, "sqrt"}]:
        raise ValueError(f"unknown symbol {unknown[0]}")
    if not re.fullmatch(r"[\w.\s()+*/-]+", relation) or "**" in relation or "//" in relation:
        raise ValueError("is not made of names, numbers, + - * /, sqrt and brackets")
    try:
        return sp.sympify(relation, locals=dict(known))
    except (sp.SympifyError, TypeError, SyntaxError):
        raise ValueError("is no arithmetic") from None


def spelled(relation: str, name: Callable[[str], str], root: str) -> str:
    """A relation in a language that spells names and the square root so."""
    return _NAME.sub(lambda one: root if one[0] == "sqrt" else name(one[0]), relation)


def substituted(relation: str, texts: Mapping[str, str]) -> str:
    """A relation with texts in the place of names."""
    return _NAME.sub(lambda one: texts.get(one[0], one[0]), relation)


def shown(relation: str) -> str:
    """A relation for readers."""
    return relation.replace(" * ", " ")


_KG, _M, _S = sp.symbols("kg m s", positive=True)
_BASE = {"kg": _KG, "m": _M, "s": _S, "rad": sp.Integer(1), "N": _KG * _M / _S**2}


def unit_of(text: str) -> sp.Expr:
    """A unit such as "N s/m" in kg, m and s; raises ValueError for others."""
    if unknown := [one for one in _NAME.findall(text) if one not in _BASE]:
        raise ValueError(f"{unknown[0]} is none of {', '.join(_BASE)}")
    return sp.sympify(text.replace(" ", "*").replace("^", "**") or "1", locals=_BASE)
