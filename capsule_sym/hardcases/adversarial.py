"""The randomised adversarial run: single segments in double precision beside 50 digits."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field
from multiprocessing import get_context
from pathlib import Path
from random import Random
from time import perf_counter
from typing import Any

from capsule_sym.errors import Outcome
from capsule_sym.generated.py import DIGEST
from capsule_sym.hardcases.judge import CONTRACT, Start, error, names
from capsule_sym.hardcases.starts import random_start
from capsule_sym.map.backend import NumpyBackend, backend
from capsule_sym.map.location import Departure
from capsule_sym.map.simulate import _Run
from capsule_sym.map.transitions import State

CHUNK = 200
"""Starts in one line of the log."""

_PROCESSES = 2


@dataclass
class Tally:
    """Counts over some starts: by kind and outcome, and every disagreement with its start.

    `settled` are starts that double precision left open and 50 digits decided, `undecided` those
    that stay open (a tangency or corner to 50 digits). `worst` is the largest error of a
    switching time in units of u (t* + M/|g'(t*)|).
    """

    starts: int = 0
    settled: int = 0
    undecided: int = 0
    worst: float = 0.0
    seconds: float = 0.0
    kinds: dict[str, int] = field(default_factory=dict)
    outcomes: dict[str, int] = field(default_factory=dict)
    disagreements: list[dict[str, Any]] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Add the counts of another tally."""
        self.starts += other.starts
        self.settled += other.settled
        self.undecided += other.undecided
        self.seconds += other.seconds
        self.worst = max(self.worst, other.worst)
        self.kinds = dict(Counter(self.kinds) + Counter(other.kinds))
        self.outcomes = dict(Counter(self.outcomes) + Counter(other.outcomes))
        self.disagreements += other.disagreements


def run(count: int, seed: int, log: Path) -> Iterator[Tally]:
    """Tallies of chunks, `count` starts in all (rounded up to whole chunks), as they are done.

    Chunks already in the log come first and are not run again; the log belongs to one seed and
    one set of generated kernels, another's lines are left alone and not counted.
    """
    wanted = range(-(-count // CHUNK))
    done = _logged(log, seed)
    yield from (done[number] for number in wanted if number in done)
    log.parent.mkdir(parents=True, exist_ok=True)
    with (
        ProcessPoolExecutor(_PROCESSES, get_context("spawn")) as pool,
        log.open("a", encoding="utf-8") as file,
    ):
        missing = [number for number in wanted if number not in done]
        running = {pool.submit(chunk, seed, number): number for number in missing}
        try:
            for future in as_completed(running):
                tally = future.result()
                line = {"seed": seed, "digest": DIGEST, "chunk": running[future], **asdict(tally)}
                # One write of one line: a run that is killed leaves at most a torn last line.
                file.write(json.dumps(line) + "\n")
                file.flush()
                os.fsync(file.fileno())
                yield tally
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _logged(log: Path, seed: int) -> dict[int, Tally]:
    """Tallies in a log by chunk; a torn last line is cut off."""
    if not log.exists():
        return {}
    whole, end, _ = log.read_text(encoding="utf-8").rpartition("\n")
    with log.open("r+", encoding="utf-8") as file:
        file.truncate(len((whole + end).encode()))
    tallies = {}
    for line in whole.splitlines():
        record = json.loads(line)
        number, key = record.pop("chunk"), (record.pop("seed"), record.pop("digest"))
        if key == (seed, DIGEST):
            tallies[number] = Tally(**record)
    return tallies


def chunk(seed: int, number: int) -> Tally:
    """The tally of one chunk; seed and number determine its starts."""
    random = Random(f"{seed} {number}")
    tally, began = Tally(), perf_counter()
    for _ in range(CHUNK):
        kind, start = random_start(random)
        tally.add(compare(kind, start))
    tally.seconds = perf_counter() - began
    return tally


def compare(kind: str, start: Start) -> Tally:
    """One start: the field that takes over and its first switch, in double and in 50 digits."""
    parameters, length = start.parameters, start.periods * start.parameters.period
    x_r, v_r, v_c = start.state
    state = State(x_r, x_r - parameters.delta, v_r, v_c, start.phase * parameters.omega)
    run = _Run(NumpyBackend(), parameters, start.phase, settle=True)
    departure = run._depart(state)
    tally = Tally(starts=1, kinds={kind: 1})
    with backend("mpmath") as numbers:
        exact = _Run(numbers, parameters, start.phase, settle=False)
        given = run._exactly(numbers, state)
        truth = exact._depart(given)
        problem, outcome = "", Outcome.UNDECIDED
        if departure is None or truth is None:
            tally.undecided = 1
            if departure or truth:
                problem = f"{_field(departure)} takes over, not {_field(truth)}"
        elif departure.field != truth.field:
            problem = f"{_field(departure)} takes over, not {_field(truth)}"
        else:
            _, switch = run._locate(state, departure, length)
            _, true = exact._locate(given, truth, numbers.number(length))
            outcome = switch.outcome
            tally.undecided = int(outcome is Outcome.UNDECIDED or not true.certain)
            if set(switch.guards) != set(true.guards):
                problem = f"{_field(truth)}: {names(switch)}, not {names(true)}"
            elif true.guards:
                tally.worst = error(numbers, parameters, departure, switch, true)
                if tally.worst > CONTRACT:
                    problem = f"{_field(truth)}: {names(true)} off by {tally.worst:.1f}"
    tally.settled = int(run.settled > 0)
    tally.outcomes = {str(outcome): 1}
    if problem:
        tally.disagreements = [
            {"kind": kind, "problem": problem, "parameters": parameters.to_dict()}
            | {"state": list(start.state), "phase": start.phase}
        ]
    return tally


def _field(departure: Departure | None) -> str:
    return f"F{departure.field}" if departure else "no field"
