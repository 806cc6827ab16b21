"""The randomised adversarial run: first switches in double precision beside 50 digits."""

from __future__ import annotations

import ast
import json
import math
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import as_completed
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field
from functools import cache
from hashlib import sha256
from pathlib import Path
from random import Random
from time import perf_counter
from typing import Any

import capsule_sym
from benchmarks.hardcases.lanes import LaneSwitch, first_switch
from benchmarks.hardcases.reference import CONTRACT, WIDE, Start, error, names
from benchmarks.hardcases.starts import RandomStart, random_start
from capsule_sym import InvalidInput
from capsule_sym._files import growing
from capsule_sym._map.interface import (
    Backend,
    End,
    Guard,
    Run,
    SegmentStart,
    State,
    backend,
    default_backend,
)
from capsule_sym._native import core
from capsule_sym._orbits.interface import contact, drift
from capsule_sym.generated.capsule import DIGEST
from capsule_sym.results import Outcome, Segment
from paper.processes import end, spawning, undisturbed

CHUNK = 200
"""Starts in one line of the log."""

_PROCESSES = 2
_REFERENCE = 8  # of so many starts one is checked by the reference map as well
_SMALL = 2.0  # errors below, in units of the contract, are not told apart


@dataclass
class Tally:
    """Counts over some starts: by kind, outcome and distance, and every disagreement.

    `disagreements` are starts where another field follows or another guard fires than in 50
    digits, `inaccurate` those whose switching time is outside the accuracy contract.

    `backends` counts the starts that each backend was checked on; the default backend takes all. Of
    those side by side in lanes, `alone` counts what the lanes left to the code for one run.
    `escalated` are starts that 50 digits decided instead of double precision, `undecided` those
    that stay open (a tangency or corner to 50 digits); `distances` gives starts, escalated and
    undecided by the decade of the start's distance from a degenerate one. `worst` is the largest
    error of a switching time in units of u (t* + M/|g'(t*)|), those below 2 not told apart.
    """

    starts: int = 0
    escalated: int = 0
    undecided: int = 0
    worst: float = 0.0
    seconds: float = 0.0
    backends: dict[str, int] = field(default_factory=dict)
    alone: dict[str, int] = field(default_factory=dict)
    kinds: dict[str, int] = field(default_factory=dict)
    outcomes: dict[str, int] = field(default_factory=dict)
    distances: dict[str, list[int]] = field(default_factory=dict)
    disagreements: list[dict[str, Any]] = field(default_factory=list)
    inaccurate: list[dict[str, Any]] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Add the counts of another tally."""
        self.starts += other.starts
        self.escalated += other.escalated
        self.undecided += other.undecided
        self.seconds += other.seconds
        self.worst = max(self.worst, other.worst)
        for name in ("backends", "alone", "kinds", "outcomes"):
            setattr(self, name, dict(Counter(getattr(self, name)) + Counter(getattr(other, name))))
        for decade, counts in other.distances.items():
            before = self.distances.get(decade, [0, 0, 0])
            self.distances[decade] = [a + b for a, b in zip(before, counts, strict=True)]
        self.disagreements += other.disagreements
        self.inaccurate += other.inaccurate


def run(count: int, seed: int, log: Path | None) -> Iterator[Tally]:
    """Tallies of chunks, `count` starts in all (rounded up to whole chunks), as they are done.

    Chunks already in the log come first and are not run again. A line belongs to one seed and one
    state of the code; another's lines are left alone and not counted.
    """
    wanted = range(-(-count // CHUNK))
    key = {"seed": seed, "code": code()}
    done = _logged(log, key) if log else {}
    yield from (done[number] for number in wanted if number in done)
    missing = [number for number in wanted if number not in done]
    with undisturbed():
        pool = spawning(_PROCESSES)
    try:
        with growing(log, "out") if log else nullcontext() as add:
            with undisturbed():
                running = {pool.submit(chunk, seed, number): number for number in missing}
            for future in as_completed(running):
                tally = future.result()
                line = {**key, "chunk": running[future], **asdict(tally)}
                if add is not None:
                    add(json.dumps(line) + "\n")
                yield tally
    finally:
        end(pool)


@cache
def code() -> str:
    """Digest of all that a verdict depends on: the kernels, the map, its C core, these checks."""
    from capsule_sym._native import core

    here, package = Path(__file__).parent, Path(capsule_sym.__file__).parent
    files = sorted(package.glob("_map/*.py"))
    files += [here / f"{name}.py" for name in ("adversarial", "lanes", "reference", "starts")]
    parts = [DIGEST.encode(), *map(_meaning, files)]
    if core is not None:
        parts.append(Path(core.library._name).read_bytes())
    return sha256(b"".join(parts)).hexdigest()[:16]


def _meaning(file: Path) -> bytes:
    """A module without its comments and docstrings."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [  # type: ignore[attr-defined]
                part
                for part in body
                if not (isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant))
            ]
    return ast.dump(tree).encode()


def _logged(log: Path, key: dict[str, Any]) -> dict[int, Tally]:
    """Tallies in a log by chunk, but for a torn last line; raises InvalidInput for no such log."""
    tallies = {}
    try:
        whole, _, _ = log.read_bytes().rpartition(b"\n")
        for line in whole.splitlines():
            record = json.loads(line)
            number = record.pop("chunk")
            if {name: record.pop(name, None) for name in key} == key:
                tallies[number] = Tally(**record)
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise InvalidInput("out", str(log), f"readable ({error.strerror})") from error
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise InvalidInput("out", str(log), "a log of `adversarial`, or not there") from error
    return tallies


def chunk(seed: int, number: int) -> Tally:
    """The tally of one chunk; seed and number determine its starts."""
    random = Random(f"{seed} {number}")
    tally, began = Tally(), perf_counter()
    for index in range(CHUNK):
        start = random_start(random)
        reference = ["numpy"] if index % _REFERENCE == 0 else []
        ways = [default_backend(), *([WIDE] if core is not None else []), *reference]
        tally.add(compare(start, ways, () if core is None else core.widths()))
    tally.seconds = perf_counter() - began
    return tally


def compare(random: RandomStart, backends: Iterable[str], widths: Iterable[int] = ()) -> Tally:
    """One start: the field that follows and its first switch, in double and in 50 digits.

    `widths` are numbers of lanes, in one of which the start goes as well.
    """
    start = random.start
    with backend("mpmath") as numbers:
        true = _first_switch(numbers, start)
        tally = Tally(starts=1, kinds={random.kind: 1})

        def check(name: str, found: LaneSwitch | None) -> None:
            tally.backends[name] = 1
            problem, off = _problem(numbers, start, found, *true)
            tally.worst = max(tally.worst, off)
            record = {
                "backend": name,
                "kind": random.kind,
                "problem": problem or f"F{found.field if found else 0} off by {off:.1f}",
                "parameters": start.parameters.to_dict(),
                "state": list(start.state),
                "phase": start.phase,
            }
            if problem:
                tally.disagreements.append(record)
            elif off > CONTRACT:
                tally.inaccurate.append(record)

        segment = None
        for name in dict.fromkeys(backends):
            found = start.run(name)
            tally.escalated = int(
                tally.escalated or (found.statistics.escalations > 0 and name != WIDE)
            )
            segment = found.segments[0] if found.segments else None
            check(name, _switch(segment) if segment else None)
        for width in widths:
            name, switch = f"c, {width} lanes", first_switch(numbers, start, width)
            tally.alone[name] = int(switch is None or switch.alone)
            if switch is not None:  # what stays open goes to 50 digits as it is
                check(name, switch)
        outcome = segment.outcome if segment else Outcome.UNDECIDED
        tally.undecided = int(true[1] is None or not true[1].certain)
        tally.outcomes = {str(outcome): 1}
        tally.distances = {_decade(random.distance): [1, tally.escalated, tally.undecided]}
    return tally


def _first_switch(numbers: Backend, start: Start) -> tuple[SegmentStart | None, End | None]:
    """Successor field at a start, and the first switch before the run's end."""
    number, parameters = numbers.number, start.parameters
    run = Run(numbers, parameters, escalate=False)
    x_r, v_r, v_c = (number(value) for value in start.state)
    angle = number(start.phase) * number(parameters.omega)
    state = State(x_r, x_r - number(parameters.delta), v_r, v_c, angle)
    begin = run.next_segment(state)
    if begin is None:
        return None, None
    limit = (start.periods * numbers.full_turn - angle) / number(parameters.omega)
    return begin, run.first_switch(state, begin, limit)[1]


def _problem(
    numbers: Backend,
    start: Start,
    switch: LaneSwitch | None,
    begin: SegmentStart | None,
    true: End | None,
) -> tuple[str, float]:
    """Fault of a first switch, empty if there is none, and the error of its duration."""
    found = f"F{switch.field}" if switch else "no field"
    expected = f"F{begin.field}" if begin else "no field"
    if switch is None or begin is None or true is None or switch.field not in (begin.field, 0):
        return ("" if found == expected else f"{found} follows, not {expected}"), 0.0
    fired = _fired(switch)
    if fired not in (true.guards or (None,)):
        return f"{found}: {fired.value if fired else 'none'}, not {names(true)}", 0.0
    if not true.guards:
        return "", 0.0
    # With M = 0 the error is larger than it is.
    off = float(abs(switch.duration / true.duration - 1)) * 2**53 if true.duration else math.inf
    if off > _SMALL:
        off = error(numbers, start.parameters, begin, switch.duration, true, _SMALL).amplitude
    return "", off


def _switch(segment: Segment) -> LaneSwitch:
    """Event that ended a segment."""
    plane = int(segment.target[1:]) if segment.target else 0
    return LaneSwitch(segment.field, plane, segment.duration, alone=True)


def _fired(switch: LaneSwitch) -> Guard | None:
    """The guard that ended a segment, by its planes; None if none did."""
    if not switch.plane:
        return None
    if drift(switch.field):
        return Guard.GAP if switch.plane > 6 else Guard.DRIFT
    if contact(switch.plane) != contact(switch.field):
        return Guard.GAP
    return Guard.UPPER if drift(switch.plane) > 0 else Guard.LOWER


def _decade(distance: float) -> str:
    """The decade of a distance, such as "1e-13" from that on to 1e-12; "0" below 1e-17."""
    if math.isinf(distance):
        return "anywhere"
    return "0" if distance < 1e-17 else f"1e{math.floor(math.log10(distance))}"
