"""What the paper prints: Eqs. (14), (15) and (24), Tables 1-3, the global maps of Section 4.

Data only, with equation numbers; the derived counterparts are in `geometry` and `switching`.
Bounds on v_r are multiplied by 2 zeta.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import product

import sympy as sp

from capsule_sym.symbolic.geometry import Piece
from capsule_sym.symbolic.switching import LocalMap
from capsule_sym.symbolic.symbols import delta, f_b, v_c, v_r, x_r, zeta

_REST = (sp.Eq(v_c, 0), sp.Eq(x_r, delta))
_RISE = 2 * zeta * v_r

EQUATION_14: dict[str, Piece] = {
    "L5": Piece("L5", (*_REST, sp.Gt(_RISE, f_b - delta))),
    "L6": Piece("L6", (*_REST, sp.Gt(v_r, 0), sp.Le(_RISE, f_b - delta))),
    "L7": Piece("L7", (*_REST, sp.Ge(_RISE, -f_b - delta), sp.Lt(v_r, 0))),
    "L8": Piece("L8", (*_REST, sp.Lt(_RISE, -f_b - delta))),
}
"""L5 to L8 by bounds on v_r, Eq. (14)."""

EQUATION_15: dict[str, int] = {
    **{"S1": 1, "S2": 2, "L1": 2, "L2": 2, "L7": 2, "S3": 3, "L8": 3},
    **{"S4": 4, "L5": 4, "S5": 5, "L3": 5, "L4": 5, "L6": 5, "S6": 6},
}
"""The subspace of each surface and line on P1 = 0, Eq. (15)."""

EQUATION_24: dict[str, str] = {
    **{name: f"Σ{subspace}" for name, subspace in EQUATION_15.items()},
    **{f"S{i}": f"Σ{i}" for i in range(7, 11)},
}
"""The switching plane of each surface and line, Eq. (24)."""

CORNERS: dict[str, frozenset[str]] = {
    "O1": frozenset({"L1", "L3", "L5", "L6"}),
    "O2": frozenset({"L2", "L4", "L7", "L8"}),
}
"""The lines that meet at the corners, Section 3.1."""


@dataclass(frozen=True)
class Row:
    """A row of Table 1 or 2: subspaces from which and into which trajectories pass a place."""

    source: int
    place: str
    target: int


def _rows(place: str, sources: tuple[int, ...], targets: tuple[int, ...]) -> tuple[Row, ...]:
    return tuple(Row(s, place, t) for t, s in product(targets, sources))


TABLE_1: tuple[Row, ...] = (
    *_rows("S1", (3,), (1,)),
    *_rows("S2", (1, 3), (2,)),
    *_rows("S3", (1,), (3,)),
    *_rows("S4", (6,), (4,)),
    *_rows("S5", (4, 6), (5,)),
    *_rows("S6", (4,), (6,)),
    *_rows("S7", (1,), (4,)),
    *_rows("S8", (4,), (1,)),
    *_rows("S9", (3,), (6,)),
    *_rows("S10", (6,), (3,)),
)

TABLE_2: tuple[Row, ...] = (
    *_rows("L1", (1, 2, 3), (1,)),
    *_rows("L2", (1, 2, 3), (2, 3)),
    *_rows("L3", (4, 5, 6), (4, 5)),
    *_rows("L4", (4, 5, 6), (4,)),
    *_rows("L5", (3,), (4,)),
    *_rows("L6", (1, 2, 3), (5,)),
    *_rows("L7", (4, 5, 6), (2,)),
    *_rows("L8", (4,), (3,)),
)

_TABLE_3 = {
    (1, (1, 8)): (2, 3, 5, 7),
    (2, (2,)): (1, 3, 5),
    (3, (3, 10)): (1, 2, 4, 5, 9),
    (4, (4, 7)): (2, 3, 5, 6, 8),
    (5, (5,)): (2, 4, 6),
    (6, (6, 9)): (2, 4, 5, 10),
}
TABLE_3: tuple[LocalMap, ...] = tuple(
    LocalMap(f"Σ{target}", field, f"Σ{source}")
    for (field, sources), targets in _TABLE_3.items()
    for source, target in product(sources, targets)
)


@dataclass(frozen=True)
class Regime:
    """A row of Section 4: the global map printed for alpha up to `high`, in order of time.

    It begins at the end of the row before. `event` is what is said to happen at `high`.
    """

    high: Fraction
    maps: tuple[LocalMap, ...]
    event: str


def _regime(high: str, event: str, *maps: tuple[int, int, int]) -> Regime:
    return Regime(Fraction(high), tuple(LocalMap(f"Σ{t}", f, f"Σ{s}") for t, f, s in maps), event)


SECTION_4: tuple[Regime, ...] = (
    _regime("0.0074", "grazing on L9: impacts begin"),
    _regime("0.3687", "adding-sliding on L3^(2): forward drift begins", (2, 5, 5), (5, 2, 2)),
    _regime(
        "0.5245",
        "crossing on L7: F4 ends on Σ8",
        *((4, 5, 5), (5, 4, 4), (2, 5, 5), (5, 2, 2)),
    ),
    _regime(
        "0.939",
        "adding-sliding on L2^(2): backward drift begins",
        *((4, 5, 5), (8, 4, 4), (2, 1, 8), (5, 2, 2)),
    ),
    _regime(
        "1.443",
        "crossing on L6: F3 ends on Σ9",
        *((4, 5, 5), (8, 4, 4), (2, 1, 8), (3, 2, 2), (2, 3, 3), (5, 2, 2)),
    ),
    _regime(
        "1.6148",
        "crossing-sliding: the stick in F5 vanishes",
        *((4, 5, 5), (8, 4, 4), (2, 1, 8), (3, 2, 2), (9, 3, 3), (5, 6, 9)),
    ),
    _regime(
        "1.661",
        "switching-sliding: F1 ends on Σ3",
        *((8, 4, 4), (2, 1, 8), (3, 2, 2), (9, 3, 3), (4, 6, 9)),
    ),
    _regime(
        "1.7126",
        "grazing-sliding: the stick in F2 vanishes",
        *((8, 4, 4), (3, 1, 8), (2, 3, 3), (3, 2, 2), (9, 3, 3), (4, 6, 9)),
    ),
    _regime("2", "", (8, 4, 4), (3, 1, 8), (9, 3, 3), (4, 6, 9)),
)
"""Global maps of the steady motion by ranges of alpha, Section 4 (those at one value apart)."""


def regime(amplitude: Fraction) -> Regime:
    """The printed row of an amplitude, in (0, 2]."""
    return next(row for row in SECTION_4 if amplitude <= row.high)
