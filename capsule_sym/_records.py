"""Results as plain records of numbers, strings, lists and dicts, and their text in JSON."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from capsule_sym._files import write_whole
from capsule_sym._units import UNITS, mean_power

if TYPE_CHECKING:
    from capsule_sym._map import Instant, Segment, SteadyMotion, Trajectory
    from capsule_sym._parameters import SceneDevice

_DIGITS = 50
# No text in a record holds NUL, so that it can mark the numbers that json would write as strings.
_MARKED = re.compile(r'"\\u0000([^"]*)"')


def segment_record(segment: Segment) -> dict[str, Any]:
    """A segment: field, local map, switching planes, start and end, and how its switch was found.

    `source` is None for a start off every switching plane, `target` for the segment that the end
    of the run cuts; `local_map` is None if one of them is.
    """
    return {
        "field": segment.name,
        "mode": segment.mode,
        "local_map": segment.local_map if segment.source and segment.target else None,
        "source": segment.source or None,
        "target": segment.target or None,
        "start": _point(segment.start, segment.start_state),
        "end": _point(segment.end, segment.end_state),
        "outcome": segment.outcome.value,
    }


def motion_record(motion: SteadyMotion | None) -> dict[str, Any]:
    """Itinerary, global map, period number and progression; all None for no motion."""
    names = ("global_map", "period_number", "progression")
    itinerary = list(motion.itinerary) if motion else None
    return {"itinerary": itinerary, **{name: getattr(motion, name, None) for name in names}}


def run_record(trajectory: Trajectory, motion: SteadyMotion | None) -> dict[str, Any]:
    """Record of a run and of its steady motion, None if it has not settled.

    A scene other than the paper's is named.
    """
    return {
        **trajectory.parameters.scene.entry,
        "parameters": trajectory.parameters.to_dict(),
        "backend": trajectory.backend,
        "segments": [segment_record(segment) for segment in trajectory.segments],
        **motion_record(motion),
        "final": _point(*trajectory.final),
        "success": trajectory.success,
        "status": str(trajectory.status),
        "message": trajectory.message,
    }


def in_si(device: SceneDevice | None, row: Mapping[str, Any]) -> dict[str, float]:
    """Values of a row in SI units, such as "velocity [m/s]"; empty without a device.

    These are the floats and the records of metrics that have a unit, the mean power if there is
    work, and the quantities, such as P_d, whose proportional parameter is in the row.
    """
    if device is None:
        return {}
    found = {}
    for name, value in row.items():
        number = value["value"] if isinstance(value, dict) and "value" in value else value
        if name in UNITS and isinstance(number, float):
            found[f"{name} [{UNITS[name].name}]"] = number * device.scale(name)
    if "work [J]" in found:
        found["power [W]"] = mean_power(found["work [J]"], device.rate)
    for name, (tied, unit) in device.scene.facts.DRIVEN.items():
        if tied in row:
            found[f"{name} [{unit}]" if unit else name] = row[tied] / device.tie(name)[1]
    return found


def add_si(device: SceneDevice | None, records: Iterable[dict[str, Any]]) -> None:
    """Give each of these records an entry "si", by `in_si`, if there is a device."""
    if device is not None:
        for record in records:
            record["si"] = in_si(device, record)


def dumps(record: dict[str, Any]) -> str:
    """The record as JSON text, every number with all its digits.

    A double is written with the digits that give it back, an mpmath number with 50: a reader
    that wants them all parses numbers as decimals. Raises ValueError for a float that is nan or
    infinite.
    """
    text = json.dumps(record, allow_nan=False, default=_marked, ensure_ascii=False, indent=2)
    return _MARKED.sub(r"\1", text)


def table(rows: Sequence[Mapping[str, Any]], columns: Sequence[str] = ()) -> str:
    """Rows as CSV text, with the columns of all of them; without rows, the head of `columns`."""
    text = io.StringIO()
    names = dict.fromkeys(name for row in rows for name in row) or columns
    writer = csv.DictWriter(text, list(names), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def write(texts: Mapping[str, str], directory: Path) -> list[Path]:
    """Write files by name, each by `write_whole`. Returns their paths."""
    for name, text in texts.items():
        write_whole(directory / name, text)
    return [directory / name for name in texts]


def _point(instant: Instant, state: tuple[Any, ...]) -> dict[str, Any]:
    return {"period": instant.period, "phase": instant.phase, "state": list(state)}


def _marked(number: Any) -> str:
    import mpmath

    return f"\0{mpmath.nstr(number, _DIGITS)}"
