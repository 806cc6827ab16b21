"""Goals of design and attractors beside what brute force finds: `python -m benchmarks design`.

Each part of `PARTS` yields goals with what was reached. Results stay in a folder, so that a stopped
measurement resumes. Times are processor time.
"""

from __future__ import annotations

import ast
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from typing import NamedTuple

from benchmarks.experiments import pulses, shocks
from benchmarks.experiments.kept import Record, kept
from benchmarks.experiments.optima import answers, fronts
from benchmarks.lines import count, files
from benchmarks.speed.design import attractors
from benchmarks.speed.goals import Goal

ROOMS = ("capsule_sym/_design", "capsule_sym/_attractors")
_MISSED, _FAR = 1e-3, 0.05  # of the larger of the best value and the spread of values
_MOST_MISSED = 100 * 8 / 300  # per cent
_BEATEN = 1e-3  # of a front's range
POINTS = 20  # of a front


class Sizes(NamedTuple):
    """Sizes of a measurement."""

    first: int
    """Number of the first random problem."""
    problems: int
    cells: int
    """Cells of brute force, for each problem and front."""
    fronts: int
    motions: int
    """Motions whose minimal shocks are compared."""
    knocks: int
    pairs: int
    """Pairs of motions whose shortest pulses are compared."""


def size(_: Sizes, out: Path) -> Iterator[Goal]:
    """Lines of code and numeric constants of modules."""
    code = [path for path in files(*ROOMS) if path.suffix == ".py"]
    yield Goal("lines of code", sum(map(count, code)), "", "<=", 3600)
    yield Goal("numeric constants of modules", sum(map(constants, code)), "", "<=", 40)


def constants(path: Path) -> int:
    """Names that a module gives a number, each of a tuple of them counted."""
    found = 0
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
        found += sum(any(map(_is_number, ast.walk(value))) for value in values)
    return found


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def optima(sizes: Sizes, out: Path) -> Iterator[Goal]:
    """Best drives of random problems beside the best of many cells."""
    first, last = sizes.first, sizes.first + sizes.problems

    def enough(done: list[Record]) -> bool:
        return len(done) >= sizes.problems

    known = kept(
        out / f"brute-{first}-{sizes.cells}.jsonl",
        lambda number: answers.forced(first + number, sizes.cells),
        enough,
    )
    found = kept(
        out / f"answers-{first}-{answers.code()}.jsonl",
        lambda number: answers.answered(first + number, seed=0),
        enough,
    )
    misses = [answers.judged(*pair)["miss"] for pair in zip(known, found, strict=False)]
    misses = misses[: sizes.problems]
    times = [one["seconds"] for one in found[: sizes.problems]]
    numbers = f"of problems {first} to {last - 1}"
    missed = 100 * sum(m > _MISSED for m in misses) / len(misses)
    yield Goal("optima missed by more than 1e-3, in %", missed, numbers, "<=", _MOST_MISSED)
    yield Goal("optima missed by more than 5 %", sum(m > _FAR for m in misses), numbers, "<=", 0)
    yield Goal("optimise, median", median(times), "s", "<=", 1)
    yield Goal("optimise, longest", max(times), "s", "<=", 10)


def pareto_fronts(sizes: Sizes, out: Path) -> Iterator[Goal]:
    """Points of fronts that a random cell beats."""
    known = kept(
        out / f"clouds-{sizes.cells}.jsonl",
        lambda number: fronts.forced(number, sizes.cells),
        lambda done: len(done) >= sizes.fronts,
    )
    found = [fronts.judged(number, known[number], POINTS) for number in range(sizes.fronts)]
    worst, times = max(one["worst"] for one in found), [one["seconds"] for one in found]
    bad = sum(one["worst"] > _BEATEN for one in found)
    yield Goal("fronts with a point beaten by 1e-3 of the range", bad, f"of {len(found)}", "<=", 0)
    yield Goal("the worst of them", worst, "of the range", "<=", _BEATEN)
    yield Goal(f"front of {POINTS} points, median", median(times), "s", "<=", 5)
    yield Goal(f"front of {POINTS} points, longest", max(times), "s", "<=", 15)


def minimal_shocks(sizes: Sizes, out: Path) -> Iterator[Goal]:
    """Motions that a random knock below the minimal shock loses."""
    path = out / f"shocks-{answers.code()}.json"
    bad = shocks.check(sizes.motions, sizes.knocks, path)
    longest = max(seconds for *_, seconds in json.loads(path.read_text()).values())
    yield Goal("motions lost by a shock smaller by 1e-4", bad, f"of {sizes.motions}", "<=", 0)
    yield Goal("minimal shock, longest", longest, "s", "<=", 5)


def shortest_pulses(sizes: Sizes, out: Path) -> Iterator[Goal]:
    """Pairs of motions between which brute force finds a shorter pulse."""
    longer = pulses.check(range(sizes.pairs))
    yield Goal("pulses longer than brute force", longer, f"of {sizes.pairs}", "<=", 0)


def all_attractors(_: Sizes, out: Path) -> Iterator[Goal]:
    """Attractors at 100 values from 400 starts."""
    yield from attractors(quick=False, repeats=1)


PARTS: tuple[Callable[[Sizes, Path], Iterator[Goal]], ...] = (
    size,
    optima,
    pareto_fronts,
    minimal_shocks,
    shortest_pulses,
    all_attractors,
)
