"""The (alpha, gamma) plane proved patch by patch: itinerary and stability, and what share of it.

A patch that is not proved is halved, and the largest ones come first, so that the share grows as
fast as it can. What became of each stands in a file, a line for each, from which a later run goes
on: `[level, place] in alpha and gamma`, and a word, or how it was halved. Its first line is the
digest of the code that proves: what other code has proved is not gone on from.
"""

from __future__ import annotations

import heapq
import json
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from hashlib import sha256
from operator import index
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, NamedTuple, TextIO

from capsule_sym.enclosures.balls import ball, precision
from capsule_sym.enclosures.orbits import shooting_of
from capsule_sym.enclosures.patches import Patch
from capsule_sym.enclosures.settled import guess_of_run
from capsule_sym.errors import CapsuleError, InvalidInput
from capsule_sym.map import simulate
from capsule_sym.orbits.equations import PARAMETERS
from capsule_sym.orbits.word import Word
from capsule_sym.parameters import Parameters
from capsule_sym.processes import end, spawning, undisturbed

ALPHA, GAMMA = (0.001, 2.0), (1.5, 5.0)
EXACT = {"omega": "0.8", "delta": "0.02", "zeta": "0.05", "beta": "1.5", "f_b": "1"}
_BITS = 64
_FIRST = (5, 4)  # levels of the patches to begin with: 32 times 16
_LAST = 30  # level beyond which nothing is halved any more
_PERIODS = ((96, 1e-6), (2048, 1e-6), (2048, 1e-4))  # of a run, and its change over a period
_AHEAD = 6  # patches under way
_OVERLAP = 1e-14
PROVING = [
    "balls",
    "equations",
    "fields",
    "forms",
    "guards",
    "krawczyk",
    "patches",
    "regions",
    "stability",
]
"""The modules on which a proof rests; all others give guesses."""


class Cell(NamedTuple):
    """A patch: how often each side was halved, and which of the parts it is."""

    alpha_level: int
    alpha_place: int
    gamma_level: int
    gamma_place: int

    @property
    def area(self) -> float:
        """The share of the whole plane."""
        return 2.0 ** -(self.alpha_level + self.gamma_level)

    @property
    def middle(self) -> tuple[float, float]:
        """Alpha and gamma at the middle."""
        return (
            _middle(ALPHA, self.alpha_level, self.alpha_place),
            _middle(GAMMA, self.gamma_level, self.gamma_place),
        )

    @property
    def radii(self) -> tuple[float, float]:
        """Half of the sides, and more than the roundings of the middles: neighbours overlap."""
        return (
            (ALPHA[1] - ALPHA[0]) * 2.0 ** -(self.alpha_level + 1) + _OVERLAP,
            (GAMMA[1] - GAMMA[0]) * 2.0 ** -(self.gamma_level + 1) + _OVERLAP,
        )

    def halves(self, along: int) -> tuple[Cell, Cell]:
        """Both halves, in alpha (0) or gamma (1)."""
        a, i, g, k = self
        if along == 0:
            return Cell(a + 1, 2 * i, g, k), Cell(a + 1, 2 * i + 1, g, k)
        return Cell(a, i, g + 1, 2 * k), Cell(a, i, g + 1, 2 * k + 1)


def _middle(ends: tuple[float, float], level: int, place: int) -> float:
    return ends[0] + (ends[1] - ends[0]) * (2 * place + 1) * 2.0 ** -(level + 1)


class Outcome(NamedTuple):
    """What became of a patch: the word that is proved, or along which side to halve it.

    `state` is where the motion is at phase 0, for the runs of its halves, `work` the seconds of
    one core.
    """

    word: str | None
    along: int
    state: tuple[float, ...]
    work: float = 0.0


def attempt(cell: Cell, state: tuple[float, ...]) -> Outcome:
    """Try to prove one stable orbit with one itinerary all over a patch."""
    begin = process_time()
    outcome = _attempt(cell, state)
    return outcome._replace(work=process_time() - begin)


def _attempt(cell: Cell, state: tuple[float, ...]) -> Outcome:
    alpha, gamma = cell.middle
    wider = 0 if cell.alpha_level <= cell.gamma_level else 1
    parameters = Parameters(alpha=alpha, gamma=gamma)
    for periods, change in _PERIODS:
        run = simulate(parameters, state, periods=periods)
        motion = run.steady(change)
        if motion is not None:
            break
    else:
        return Outcome(None, wider, state)
    reached = tuple(float(x) for x in run.final[1])
    try:
        word = Word.of_motion(motion)
        with precision(_BITS):
            values = EXACT | {"alpha": alpha, "gamma": gamma}
            shooting = shooting_of(word, [values[name] for name in PARAMETERS], ("alpha", "gamma"))
            guess = [*guess_of_run(shooting, run, motion), ball(alpha), ball(gamma)]
            patch = Patch(shooting, guess, cell.radii)
            wider = patch.steeper
            patch.prove()
    except (CapsuleError, ArithmeticError, ValueError):
        return Outcome(None, wider, reached)
    periods_told = f" over {word.multiple}" if word.multiple > 1 else ""
    return Outcome(f"{word}{periods_told}", 0, reached)


@dataclass
class Plane:
    """What is proved of the plane so far: shares by word, and the patches that are open."""

    shares: dict[str, float] = field(default_factory=dict)
    patches: int = 0
    seconds: float = 0.0
    work: float = 0.0
    open: list[tuple[float, Cell, tuple[float, ...]]] = field(default_factory=list)

    @property
    def share(self) -> float:
        """The share of the plane that is proved."""
        return sum(self.shares.values())

    def take(self, cell: Cell, outcome: Outcome) -> tuple[Cell, ...]:
        """Count a patch that is proved; of another one, the halves that are to be tried."""
        self.work += outcome.work
        if outcome.word is None:
            deepest = cell.alpha_level + cell.gamma_level == _LAST
            return () if deepest else cell.halves(outcome.along)
        self.shares[outcome.word] = self.shares.get(outcome.word, 0.0) + cell.area
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
    """The digest of the code that proves."""
    digest = sha256()
    for name in PROVING:
        digest.update(Path(__file__).with_name(f"{name}.py").read_bytes())
    return digest.hexdigest()


def _begin() -> str:
    return json.dumps({"code": code()}) + "\n"


def _told(record: dict[str, Any]) -> Outcome:
    """What became of a patch, of a line of a file."""
    word, along = record.get("word"), record.get("along", 0)
    if ("word" in record) == ("along" in record) or along not in (0, 1) or word == "":
        raise ValueError(f"neither proved nor halved: {record}")
    return Outcome(word, along, (0.0, 0.0, 0.0), float(record["work"]))


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
                    for half in plane.take(cell, outcome):
                        plane.add(half, outcome.state)
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
    return told | ({"along": outcome.along} if outcome.word is None else {"word": outcome.word})
