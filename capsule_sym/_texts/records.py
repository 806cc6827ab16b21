"""Records as texts of a terminal: names with their values, and tables of what is listed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from capsule_sym._errors import counted
from capsule_sym._texts import tables

_ROWS = 20  # of a table: of a longer one every k-th is shown
_ENTRIES = 12  # of a longer table of names only the first are shown
_LINE = 90  # characters of entries that stand in one line
# Entries for programs, which JSON and files have, and those that the end of a text has.
_HIDDEN = {
    *("format", "success", "status", "message", "parameters", "device", "statistics", "units"),
    *("ties", "covariance", "singular_values", "residual", "iterations", "imbalance", "sweep"),
    *("parts", "final", "seconds", "store", "orbit", "backend", "switches"),
}
_IN_UNITS = "over", "metrics", "values", "standard_errors"  # whose entries are printed with units
_DIGITS = {"uncertainty": 1, "uncertainties": 1, "admissibility": 3}
_BLOCKS = ("orbits", "switched", "curves")
_COLUMNS: dict[str, Sequence[str]] = {
    "segments": (
        *("field", "mode", "local_map", "source", "target", "start.phase", "duration"),
        "start.state",
    ),
    "points": (
        *("value", "cost", "over", "progression", "multipliers.0", "admissibility"),
        "itinerary",
    ),
    "bifurcations": (
        *("label", "type", "line", "value", "uncertainty", "itinerary_before", "itinerary_after"),
        "normal_form.scenario",
    ),
    "attractors": (
        *("number", "attractor", "fraction", "interval", "period_number", "progression"),
        *("si.progression [m]", "multipliers.0", "birth", "death", "itinerary"),
    ),
    "codimension_two": ("types", "lines", "uncertainties"),
    "differences": ("missed", "invented", "cause", "gap"),
    "axes": ("name", "quantities", "count", "first", "last", "unit"),
    "metrics": ("metric", "nominal", "mean", "deviation", "quantiles"),
}
"""Columns of the table of a list, by its name; of another one they are its simple entries."""


def show(record: Mapping[str, Any]) -> None:
    """Print a record: names with their values, tables of what it lists, and its status."""
    units, named = record.get("units", {}), record.get("parameters")
    lines, console = [*_lines(record, units)], tables.make_console()
    tables.grid(lines)
    apart = bool(lines)
    for name, value in record.items():
        rows = value if isinstance(value, list) and name not in _HIDDEN else []
        if name in _BLOCKS:
            for one in rows:
                console.print(end="\n" * apart)
                show(one)
                apart = True
        elif rows and isinstance(rows[0], Mapping):
            console.print(f"\n{_name(name)}" if apart else _name(name))
            first = named if isinstance(named, list) else []
            if "birth" in rows[0]:  # attractors along a parameter
                first, rows = [record["parameter"]], [_ends(row) for row in rows]
            _table(name, rows, first)
            apart = True
    if "message" in record:
        said = f"{record.get('status', 'result')}: {record['message']}"
        console.print(said, soft_wrap=True)


def _lines(entries: Mapping[str, Any], units: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    for name, value in entries.items():
        if name in _HIDDEN or (isinstance(value, list) and value and isinstance(value[0], Mapping)):
            continue
        if name in _IN_UNITS and isinstance(value, Mapping):
            texts = ((key, text_of(one)) for key, one in value.items())
            value = {key: f"{text} {units.get(key, '')}".rstrip() for key, text in texts if text}
        text = f"{text_of(value, name)} {units.get(name, '')}".rstrip()
        within = value if isinstance(value, Mapping) and "value" not in value else {}
        if within and (len(text) > _LINE or any(" " in part for part in within)):
            yield _name(name), ""
            within = {key: one for key, one in within.items() if key not in _HIDDEN}
            shown = [*within.items()][:_ENTRIES]
            for part, one in shown:
                yield f"  {_name(part)}", text_of(one, part)
            if more := len(within) - len(shown):
                yield "", f"{more} more"
        elif text:
            yield _name(name), text


def _table(name: str, rows: Sequence[Mapping[str, Any]], first: Sequence[str]) -> None:
    """Print rows as a table, of many rows every k-th and the last.

    The columns `first` come before those of `_COLUMNS`; columns without an entry are left out.
    """
    simple = [key for key, one in rows[0].items() if not isinstance(one, Mapping | list)]
    digits = 12 if name in ("bifurcations", "codimension_two") else 6
    some = [*rows[: -1 : max(1, -(-len(rows) // _ROWS))], rows[-1]]
    cells = {
        column: [text_of(_at(row, column), column, _DIGITS.get(column, digits)) for row in some]
        for column in [*first, *_COLUMNS.get(name, simple)]
    }
    shown = {column: texts for column, texts in cells.items() if any(texts)}
    heads = [_name(next(p for p in one.split(".")[::-1] if not p.isdigit())) for one in shown]
    tables.table(heads, zip(*shown.values(), strict=True), gap=2)
    if len(some) < len(rows):
        tables.make_console().print(f"{len(some)} of {len(rows):,} rows")


def _ends(value: Any) -> Any:
    """Range of the numbers along a parameter; first of the itineraries, and how many others."""
    if isinstance(value, Mapping):
        return {key: _ends(one) for key, one in value.items()}
    if not isinstance(value, list) or not value:
        return value
    if isinstance(value[0], str):
        others = len({*value}) - 1
        return f"{value[0]} and {counted(others, 'other')}" if others else value[0]
    least, most = min(value), max(value)
    return least if least == most else f"{text_of(least, '', 4)} to {text_of(most, '', 4)}"


def _at(row: Any, path: str) -> Any:
    """Entry of a row by names and numbers with points between; None if there is none."""
    for part in path.split("."):
        if isinstance(row, Mapping):
            row = row.get(part)
        elif isinstance(row, list | tuple) and part.isdigit() and int(part) < len(row):
            row = row[int(part)]
        else:
            return None
    return row


def _name(name: str) -> str:
    """Name of an entry with blanks; that of a quantity, such as x_r, as it is."""
    return name if "[" in name or name[1:2] == "_" else name.replace("_", " ")


def text_of(value: Any, name: str = "", digits: int = 9) -> str:
    """A value of a record as text; empty for None and for what is empty."""
    if value is None or isinstance(value, str):
        return value or ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, Mapping):
        if "value" in value:
            ends = [value[end] for end in ("low", "high") if end in value]
            about = value.get("inequality") or value.get("type", "")
            shown = f"{text_of(value['value'], name, digits)} {about}"
            return shown.strip() + f" ({text_of(ends, name, 4)})" * bool(ends)
        each = ((_name(key), text_of(one, key, digits)) for key, one in value.items())
        return ", ".join(f"{key} {text}" for key, text in each if text)
    if isinstance(value, list | tuple):
        return _list(value, name, digits)
    return f"{float(value):.{digits}g}"  # also a number of mpmath


def _list(values: Sequence[Any], name: str, digits: int) -> str:
    pair = len(values) == 2 and all(isinstance(one, float) for one in values)
    if pair and "multiplier" in name:
        real, imaginary = values
        return f"{real:.{digits}g}{imaginary:+.{digits}g}i" if imaginary else f"{real:.{digits}g}"
    numbers = [one for one in values if isinstance(one, float | int)]
    if len(values) > _ENTRIES and len(numbers) == len(values):
        values = [min(numbers), max(numbers)]
        pair = True
    texts = [text_of(one, name, digits) for one in values]
    if texts and isinstance(values[0], Mapping):
        more = [f"and {len(texts) - _ENTRIES:,} more"] if len(texts) > _ENTRIES else []
        return "; ".join(texts[:_ENTRIES] + more)
    if pair and len({*texts}) == 1:
        return texts[0]
    return (" to " if pair else " ").join(texts)
