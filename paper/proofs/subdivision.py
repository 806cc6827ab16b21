"""Proof by subdivision: the (alpha, gamma) plane, and the motions from rest over alpha or drives.

A part that is not proved is halved, and the largest parts come first, so that the proved share
grows fast. A file keeps the outcome of each part in one line, and a later run resumes from it: the
part's numbers, and an itinerary or the directions in which it was halved. The first line is the
digest of the code that proves: files of other code are not resumed.
"""

from __future__ import annotations

import gzip
import heapq
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from operator import index
from pathlib import Path
from time import perf_counter, process_time
from types import ModuleType
from typing import Any, NamedTuple, Protocol

from capsule_sym import InvalidInput
from capsule_sym._files import growing, write_whole
from capsule_sym._map.interface import checked_seconds
from paper.processes import end, spawning, undisturbed
from paper.proofs import attraction, optimum, patches
from paper.proofs.digest import (
    closure,
    digest,
    libraries,
    other_libraries,
)
from paper.proofs.parts import BOTH, AlphaPart, DrivePart, Outcome, Patch

_FIRST = (5, 4)  # levels of the patches to begin with: 32 times 16
_FIRST_DRIVES = (6, 7)  # levels of the parts of the drives to begin with
_FIRST_INTERVALS = 9  # halvings of the intervals to begin with
_LEAST = 2.0**-36  # share below which a part is not halved any more
_AHEAD = 6  # parts in progress


class Part(Protocol):
    """A part of the whole, defined by integers."""

    @property
    def area(self) -> float:
        """Share of the whole."""

    def halved(self, along: Sequence[int]) -> Sequence[Any]:
        """Smaller parts."""

    def __iter__(self) -> Iterator[int]: ...


class Task(NamedTuple):
    """A proof by subdivision: the type of its parts, the first ones, and what proves a part."""

    part: Callable[..., Part]
    first: Callable[[], list[Any]]
    module: ModuleType
    """Module whose `attempt` proves a part, or gives how to halve it."""
    option: str
    """Option of `python -m paper enclose` that writes such files."""

    def code(self) -> str:
        """Digest of the code on which a proof rests; all other code gives guesses."""
        return digest(closure(self.module))

    def begin(self) -> dict[str, Any]:
        """First line of a file."""
        return {"option": self.option, "code": self.code(), "libraries": libraries()}

    def check(self, header: Any) -> None:
        """Raises ValueError unless the first line is that of a file of this task, of any code."""
        if header["option"] != self.option or not isinstance(header["code"], str):
            raise ValueError(f"not of {self.option}")


@dataclass
class Plane:
    """Results so far: shares by itinerary, and the parts that are open."""

    shares: dict[str, float] = field(default_factory=dict)
    patches: int = 0
    seconds: float = 0.0
    work: float = 0.0
    open: list[tuple[float, list[int], Any, tuple[float, ...]]] = field(default_factory=list)

    @property
    def share(self) -> float:
        """Share of the whole that is proved."""
        return sum(self.shares.values())

    def take(self, part: Part, outcome: Outcome) -> Sequence[Part]:
        """Count a part that is proved; return the smaller parts of another one."""
        self.work += outcome.work
        if outcome.itinerary is None:
            return () if part.area < _LEAST else part.halved(outcome.along)
        self.shares[outcome.itinerary] = self.shares.get(outcome.itinerary, 0.0) + part.area
        self.patches += 1
        return ()

    def add(self, part: Part, state: tuple[float, ...]) -> None:
        """Record a part as open; of parts of equal size the first in order come first."""
        heapq.heappush(self.open, (-part.area, [*part][::-1], part, state))


def _patches() -> list[Patch]:
    a, g = _FIRST
    return [Patch(a, i, g, k) for i in range(2**a) for k in range(2**g)]


def _intervals() -> list[AlphaPart]:
    """Parts of alpha at both mass ratios."""
    return [AlphaPart(BOTH, _FIRST_INTERVALS, place) for place in range(2**_FIRST_INTERVALS)]


def _drives() -> list[DrivePart]:
    a, w = _FIRST_DRIVES
    return [DrivePart(a, i, w, k) for i in range(2**a) for k in range(2**w)]


PLANE = Task(Patch, _patches, patches, "--region")
"""One stable orbit with one itinerary on all of each patch of the (alpha, gamma) plane."""
FROM_REST = Task(AlphaPart, _intervals, attraction, "--from-rest")
"""Tendency of the motion from rest, over alpha at both mass ratios."""
DRIVES = Task(DrivePart, _drives, optimum, "--fastest")
"""No motion from rest faster than the best, over a box of alpha and omega."""


def begun(path: Path, task: Task = PLANE) -> Plane:
    """Results in a file, or empty ones without a file; raises InvalidInput."""
    plane = Plane()
    outcomes: dict[Part, Outcome] = {}
    if path.exists():
        try:
            begin, *lines = path.read_text(encoding="utf-8").splitlines(keepends=True) or [
                _begin(task)
            ]
            header = json.loads(begin)
            task.check(header)
            other = header["code"] != task.code()
            others = other_libraries(header.get("libraries", {})) or "other code"
            for line in lines:
                if not line.endswith("\n"):
                    break  # incomplete after a kill; its part is tried again
                record = json.loads(line)
                part, outcome = _told(record, task)
                outcomes[part] = outcome
                plane.seconds = max(plane.seconds, float(record["seconds"]))
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise InvalidInput(
                "file", str(path), f"one that `python -m paper enclose {task.option}` wrote"
            ) from error
        if other:
            raise InvalidInput("file", str(path), f"a new one: this was proved by {others}")
    waiting = task.first()
    while waiting:
        part = waiting.pop()
        if part in outcomes:
            waiting += plane.take(part, outcomes[part])
        else:
            plane.add(part, Outcome(None, ()).state)
    return plane


def _begin(task: Task, plan: Path | None = None) -> str:
    """First lines of a file: the code's digest, and the halvings of an earlier file.

    Halvings prove nothing, so that the earlier file may be one of other code.
    """
    begin = json.dumps(task.begin()) + "\n"
    if plan is None:
        return begin
    opened = gzip.open if plan.suffix == ".gz" else open
    try:
        with opened(plan, "rt", encoding="utf-8") as file:
            header, *records = [json.loads(line) for line in file if line.endswith("\n")]
        task.check(header)
        halved = [one for one in records if _told(one, task)[1].itinerary is None]
    except (OSError, EOFError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InvalidInput(
            "plan", str(plan), f"a file that `python -m paper enclose {task.option}` wrote"
        ) from error
    return begin + "".join(json.dumps(one | {"seconds": 0.0, "work": 0.0}) + "\n" for one in halved)


def _told(record: dict[str, Any], task: Task) -> tuple[Part, Outcome]:
    """A part and its outcome, from a line of a file."""
    itinerary, along = record.get("itinerary"), tuple(record.get("along", ()))
    if (itinerary is None) == (along == ()) or not {*along} <= {0, 1} or itinerary == "":
        raise ValueError(f"neither proved nor halved: {record}")
    part = task.part(*map(index, record["part"]))
    if along:
        part.halved(along)
    return part, Outcome(itinerary, along, work=float(record["work"]))


def prove(
    path: Path,
    seconds: float,
    workers: int = 2,
    report: Callable[[Plane], object] = lambda p: None,
    task: Task = PLANE,
    plan: Path | None = None,
) -> Plane:
    """Resume a file for so many seconds, and return the results.

    A new file begins with the halvings of an earlier one, `plan`, which may be one of other code
    and compressed (.gz). Raises InvalidInput for seconds that are not a number > 0, and for a file
    of other code.
    """
    checked_seconds(seconds, "seconds")
    if plan is not None and not path.exists():
        write_whole(path, _begin(task, plan), "file")
    plane = begun(path, task)
    start, before = perf_counter(), plane.seconds
    pending: dict[Future[Outcome], Part] = {}
    with undisturbed():
        pool = spawning(workers)
    try:
        with growing(path, "file", _begin(task)) as add:
            while True:
                late = perf_counter() - start > seconds
                while plane.open and not late and len(pending) < _AHEAD:
                    *_, part, state = heapq.heappop(plane.open)
                    with undisturbed():
                        pending[pool.submit(_timed, task.module.attempt, part, state)] = part
                if not pending:
                    return plane
                done, _ = wait(pending, return_when=FIRST_COMPLETED)
                plane.seconds = before + perf_counter() - start
                for one in done:
                    part, outcome = pending.pop(one), one.result()
                    for smaller in plane.take(part, outcome):
                        plane.add(smaller, outcome.state)
                    add(json.dumps(_record(part, outcome, plane.seconds)) + "\n")
                report(plane)
    finally:
        end(pool)


def _timed(
    attempt: Callable[[Any, tuple[float, ...]], Outcome], part: Part, state: tuple[float, ...]
) -> Outcome:
    """Outcome of an attempt, with the time that it took."""
    begin = process_time()
    outcome = attempt(part, state)
    return outcome._replace(work=process_time() - begin)


def _record(part: Part, outcome: Outcome, seconds: float) -> dict[str, Any]:
    told: dict[str, Any] = {
        "part": list(part),
        "seconds": round(seconds, 1),
        "work": round(outcome.work, 4),
    }
    return told | (
        {"along": outcome.along} if outcome.itinerary is None else {"itinerary": outcome.itinerary}
    )
