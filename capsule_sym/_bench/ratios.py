"""How many times this map in C is faster than each other tool."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from capsule_sym._bench.scaling import Growth
from capsule_sym._bench.study import Row
from capsule_sym._bench.tools import LANES, ONE_ROW, OURS

LIMITS = (1e-6, 1e-12)
"""Errors up to which the fastest setting of each tool is compared."""

_NAMED = (
    ("trajectory", "heyoka.py", "1e-15, careful", 10.0),
    ("trajectory", "DOP853 in C", "1e-13, inside steps", 10.0),
    ("trajectory", "SciPy DOP853", "1e-12, careful", 1000.0),
    ("sweep", f"heyoka.py, {LANES} lanes", "1e-12, careful", 10.0),
)
_TWO_THREADS = 1.8


class Ratio(NamedTuple):
    """The other's time by ours."""

    part: str
    """"trajectory", "sweep" or "threads" (one thread against two)."""
    tool: str
    setting: str
    max_error: float | None
    """The limit that the setting is the fastest to keep; None of a setting that was named."""
    ratio: float
    wanted: float | None
    """What the ratio ought to be at least."""


def ratios(
    trajectory: Sequence[Row], sweep: Sequence[Row], growth: Sequence[Growth]
) -> list[Ratio]:
    """The named ratios, then every tool at its fastest setting within each error."""
    parts = {"trajectory": trajectory, "sweep": sweep}
    return [*_named(parts), *_threads(growth), *_fastest(parts)]


def _ours(rows: Sequence[Row]) -> float | None:
    return next((row.us_per_period for row in rows if row.tool == OURS), None)


def _named(parts: dict[str, Sequence[Row]]) -> Iterator[Ratio]:
    for part, tool, setting, wanted in _NAMED:
        ours = _ours(parts[part])
        for row in parts[part]:
            if ours and (row.tool, row.setting) == (tool, setting):
                yield Ratio(part, tool, setting, None, row.us_per_period / ours, wanted)


def _threads(growth: Sequence[Growth]) -> Iterator[Ratio]:
    us = {g.value: g.us_per_period for g in growth if g.against == "threads"}
    if us:
        yield Ratio("threads", OURS, "2 threads", None, us[1] / us[2], _TWO_THREADS)


def _fastest(parts: dict[str, Sequence[Row]]) -> Iterator[Ratio]:
    for part, rows in parts.items():
        ours = _ours(rows)
        for tool in dict.fromkeys(
            row.tool for row in rows if ours and row.tool not in (OURS, ONE_ROW)
        ):
            for limit in LIMITS:
                kept = [
                    row
                    for row in rows
                    if row.tool == tool and row.max_error is not None and row.max_error <= limit
                ]
                if ours and kept:
                    best = min(kept, key=lambda row: row.us_per_period)
                    us = best.us_per_period
                    yield Ratio(part, tool, best.setting, limit, us / ours, None)
