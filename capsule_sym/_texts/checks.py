"""The text of a comparison with an integrator."""

from __future__ import annotations

import math
from collections.abc import Iterator

import capsule_sym
from capsule_sym._texts import tables

_SHOWN = 10  # differences


def show_check(found: capsule_sym.results.SwitchCheck) -> None:
    """Print the verdict, the facts, and the first differences."""
    console = tables.make_console()
    console.print(found.message)
    console.print()
    tables.grid(_facts(found))
    if not found.differences:
        return
    rows = [
        (f"{event.time:.9g}", event.event, kind, str(one.cause))
        for one in found.differences
        for kind, events in (("missed", one.missed), ("invented", one.invented))
        for event in events
    ]
    console.print()
    tables.table(("time", "event", "switch", "cause"), rows[:_SHOWN], right=("time",))
    if len(rows) > _SHOWN:
        console.print(f"and {len(rows) - _SHOWN} more (--json shows all)")


def _facts(found: capsule_sym.results.SwitchCheck) -> Iterator[tuple[str, str]]:
    """Names of results and their texts."""
    own, late = found.segment_error, found.latest
    if late is not None:
        error, event, growth = late
        way = "late" if error > 0 else "early"
        yield "largest error", f"{event.event} at {event.time:.9g} is {abs(error):.2g} {way}"
        yield "growth there", f"an error of each segment's state shifts it by {growth:.3g} of that"
    if own is not None:
        yield "error of a segment", f"{own:.2g} at least" if own else "below what is printed"
    if found.horizon < math.inf:
        yield "judged", f"up to {found.horizon:.6g}"
    if found.own_horizon < found.horizon:
        yield "your errors", f"have grown to the size of the motion at {found.own_horizon:.6g}"
    if not found.differences:
        return
    first = found.differences[0]
    if first.agrees_again is not None:
        yield "agrees again", f"from {first.agrees_again:.9g} on"
    if first.gap is not None:
        yield "switches are", f"{first.gap:.2g} apart: the event search has to see both"
    if found.needed is not None:
        yield "needed", f"an error of a segment below {found.needed:.2g}"
    if found.tolerance is not None:
        yield "tolerance", f"{found.tolerance:.1g} would do, in place of {found.used:.1g}"
