"""Speed ratios: time of each other tool over the time of this map in C."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from benchmarks.speed.compare import Row
from benchmarks.speed.tools import LANES, OURS, OWN

LIMITS = (1e-6, 1e-12)
"""Error limits at which the fastest setting of each tool is compared."""

_NAMED = (
    ("trajectory", "DOP853 in C", "1e-13, inside steps", 10.0),
    ("trajectory", "heyoka.py", "1e-15, careful", 10.0),
    ("trajectory", "SciPy DOP853", "1e-12, careful", 1000.0),
    ("sweep", f"heyoka.py, {LANES} lanes", "1e-12, careful", 10.0),
)


class Ratio(NamedTuple):
    """Time of the other tool over ours."""

    part: str
    """"trajectory" or "sweep", or "threads" (one thread against two)."""
    tool: str
    setting: str
    max_error: float | None
    """Error limit at which this is the tool's fastest setting; None for a named setting."""
    ratio: float
    wanted: float | None
    """Least ratio to reach."""


def ratios(trajectory: Sequence[Row], sweep: Sequence[Row]) -> list[Ratio]:
    """The named ratios, then every tool at its fastest setting within each error."""
    parts = {"trajectory": trajectory, "sweep": sweep}
    named = [
        Ratio(part, tool, setting, None, row.us_per_period / ours, wanted)
        for part, tool, setting, wanted in _NAMED
        for row in parts[part]
        if (row.tool, row.setting) == (tool, setting) and (ours := _ours(parts[part]))
    ]
    return [*named, *_fastest(parts)]


def _ours(rows: Sequence[Row]) -> float | None:
    return next((row.us_per_period for row in rows if row.tool == OURS), None)


def _fastest(parts: Mapping[str, Sequence[Row]]) -> Iterator[Ratio]:
    for part, rows in parts.items():
        ours = _ours(rows)
        if ours is None:
            continue
        for tool in dict.fromkeys(row.tool for row in rows if row.tool not in OWN):
            exact = [row for row in rows if row.tool == tool and row.max_error is not None]
            for limit in LIMITS:
                kept = [row for row in exact if (row.max_error or 0.0) <= limit]
                if kept:
                    best = min(kept, key=lambda row: row.us_per_period)
                    yield Ratio(part, tool, best.setting, limit, best.us_per_period / ours, None)
