"""The (alpha, gamma) plane proved patch by patch: itinerary and stability, and what share of it.

A patch that is not proved is halved, and the largest ones come first, so that the share grows as
fast as it can. What became of each stands in a file, a line for each, from which a later run goes
on: `[level, place] in alpha and gamma`, and an itinerary, or the directions in which it was halved.
Its first line is the digest of the code that proves: what other code has proved is not gone on
from.
"""

from __future__ import annotations

import heapq
import json
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from operator import index
from pathlib import Path
from time import perf_counter
from typing import Any, TextIO

from capsule_sym._enclosures import cells, patches
from capsule_sym._enclosures.cells import Cell, Outcome, attempt
from capsule_sym._enclosures.digest import closure, digest
from capsule_sym._errors import InvalidInput
from capsule_sym._orbits.shooting.itinerary import (
    Itinerary,
    ItinerarySegment,
    contact,
    drift,
    guard_between,
)
from capsule_sym._processes import end, spawning, undisturbed
from capsule_sym.generated import fields as generated

_FIRST = (5, 4)  # levels of the patches to begin with: 32 times 16
_LAST = 30  # level beyond which nothing is halved any more
_AHEAD = 6  # patches under way


@dataclass
class Plane:
    """What is proved of the plane so far: shares by itinerary, and the patches that are open."""

    shares: dict[str, float] = field(default_factory=dict)
    patches: int = 0
    seconds: float = 0.0
    work: float = 0.0
    open: list[tuple[float, Cell, tuple[float, ...]]] = field(default_factory=list)

    @property
    def share(self) -> float:
        """The share of the plane that is proved."""
        return sum(self.shares.values())

    def take(self, cell: Cell, outcome: Outcome) -> Sequence[Cell]:
        """Count a patch that is proved; of another one, the parts that are to be tried."""
        self.work += outcome.work
        if outcome.itinerary is None:
            deepest = cell.alpha_level + cell.gamma_level >= _LAST
            return () if deepest else cell.halved(outcome.along)
        self.shares[outcome.itinerary] = self.shares.get(outcome.itinerary, 0.0) + cell.area
        self.patches += 1
        return ()

    def add(self, cell: Cell, state: tuple[float, ...]) -> None:
        """Put down a patch as open."""
        heapq.heappush(self.open, (-cell.area, cell, state))


def begun(path: Path) -> Plane:
    """The plane as a file leaves it, or at its begin where there is none; raises InvalidInput."""
    plane = Plane()
    rest = (0.0, 0.0, 0.0)
    outcomes: dict[Cell, Outcome] = {}
    if path.exists():
        try:
            begin, *lines = path.read_text(encoding="utf-8").splitlines(keepends=True) or [_begin()]
            other = json.loads(begin)["code"] != code()
            for line in lines:
                if not line.endswith("\n"):
                    break  # a kill cut it off; its patch is tried again
                record = json.loads(line)
                outcomes[Cell(*map(index, record["cell"]))] = _told(record)
                plane.seconds = max(plane.seconds, float(record["seconds"]))
        except (ValueError, KeyError, TypeError) as error:
            raise InvalidInput("file", str(path), "one that `enclose --region` wrote") from error
        if other:
            raise InvalidInput("file", str(path), "a new one: this was proved by other code")
    a, g = _FIRST
    cells = [Cell(a, i, g, k) for i in range(2**a) for k in range(2**g)]
    while cells:
        cell = cells.pop()
        if cell in outcomes:
            cells += plane.take(cell, outcomes[cell])
        else:
            plane.add(cell, rest)
    return plane


def code() -> str:
    """The digest of the code on which a proof rests; all other code gives guesses."""
    itineraries = (Itinerary.of, ItinerarySegment, contact, drift, guard_between)
    return digest((*closure(patches), cells, generated, *itineraries))


def _begin() -> str:
    return json.dumps({"code": code()}) + "\n"


def _told(record: dict[str, Any]) -> Outcome:
    """What became of a patch, of a line of a file."""
    itinerary, along = record.get("itinerary"), tuple(record.get("along", ()))
    if (itinerary is None) == (along == ()) or not {*along} <= {0, 1} or itinerary == "":
        raise ValueError(f"neither proved nor halved: {record}")
    return Outcome(itinerary, along, (0.0, 0.0, 0.0), float(record["work"]))


def prove(
    path: Path, seconds: float, workers: int = 2, report: Callable[[Plane], object] = lambda p: None
) -> Plane:
    """Go on with a file for so many seconds, and tell what is proved."""
    plane = begun(path)
    start, before = perf_counter(), plane.seconds
    pending: dict[Future[Outcome], Cell] = {}
    with undisturbed():
        pool = spawning(workers)
    try:
        with path.open("a+", encoding="utf-8") as file:
            _mend(file)
            while True:
                late = perf_counter() - start > seconds
                while plane.open and not late and len(pending) < _AHEAD:
                    _, cell, state = heapq.heappop(plane.open)
                    with undisturbed():
                        pending[pool.submit(attempt, cell, state)] = cell
                if not pending:
                    return plane
                done, _ = wait(pending, return_when=FIRST_COMPLETED)
                plane.seconds = before + perf_counter() - start
                for one in done:
                    cell, outcome = pending.pop(one), one.result()
                    for part in plane.take(cell, outcome):
                        plane.add(part, outcome.state)
                    file.write(json.dumps(_record(cell, outcome, plane.seconds)) + "\n")
                file.flush()
                report(plane)
    finally:
        end(pool)


def _mend(file: TextIO) -> None:
    """Begin a file that is empty, and cut off a line that is not whole."""
    file.seek(0)
    whole = "".join(line for line in file if line.endswith("\n"))
    file.seek(0)
    file.truncate()
    file.write(whole or _begin())


def _record(cell: Cell, outcome: Outcome, seconds: float) -> dict[str, Any]:
    told: dict[str, Any] = {
        "cell": list(cell),
        "seconds": round(seconds, 1),
        "work": round(outcome.work, 4),
    }
    return told | (
        {"along": outcome.along} if outcome.itinerary is None else {"itinerary": outcome.itinerary}
    )
