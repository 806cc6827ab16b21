"""Pareto fronts beside random cells: `python -m benchmarks fronts`.

A cell beats a point if it costs no more and is better by more than 1e-6 of the front's range. A
hole is how far a cell that nothing beats is from the next point, over the ranges of the front.
"""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.experiments.kept import Record, kept
from benchmarks.experiments.optima.answers import LIMIT
from benchmarks.experiments.optima.brute import AT_ONCE, cells
from benchmarks.experiments.optima.motions import Vector
from benchmarks.experiments.optima.problems import Problem, problem, valued
from capsule_sym import Parameters, pareto, scenes
from capsule_sym.inputs import SceneParameters

WORSE = 1e-6
PAIRS = (
    ("speed", "peak_force"),
    ("speed", "power"),
    ("velocity", "peak_contact"),
    ("speed", "cost_of_transport"),
    ("speed_per_work", "peak_force"),
)
DRIVE = {"alpha": (0.1, 2.0), "omega": (0.5, 1.5)}
SLOPE: SceneParameters = scenes.slope.Parameters()
CHOSEN = (
    (
        (
            Problem(
                "speed",
                {"alpha": (0.2, 3.0), "omega": (0.3, 2.5)},
                Parameters(zeta=0.02, beta=10.0),
            )
        ),
        "peak_force",
    ),
    (Problem("speed", DRIVE, SLOPE), "cost_of_transport"),
)
FIRST = 1000  # of the problems whose bounds random fronts have


def front(number: int) -> tuple[Problem, str]:
    """The problem of a front's first metric, without limits, and what it costs."""
    if number < len(CHOSEN):
        return CHOSEN[number]
    drawn = problem(FIRST + number)
    metric, cost = PAIRS[number % len(PAIRS)]
    return Problem(metric, drawn.over, drawn.base), cost


def clouded(number: int, count: int) -> tuple[Vector, Vector]:
    """The metric and the cost of motions from rest in many cells, those that no other beats."""
    given, cost = front(number)
    u = cells(len(given.over), count, number)

    def both(places: Vector, sure: bool) -> Vector:
        (motions,) = given.motions(places, sure)
        return np.array([valued(text, motions) for text in (given.metric, cost)])

    found = [both(u[i : i + AT_ONCE], sure=False) for i in range(0, count, AT_ONCE)]
    u = u[unbeaten(np.concatenate(found, axis=1))]
    certain = both(u, sure=True)
    values, costs = certain[:, unbeaten(certain)]
    return values, costs


def unbeaten(both: Vector) -> NDArray[np.intp]:
    """Those of (values, costs) that no other beats, by increasing costs."""
    values, costs = both
    order = np.lexsort((-values, costs))
    order = order[np.isfinite(values[order]) & np.isfinite(costs[order])]
    best = np.maximum.accumulate(np.append(-np.inf, values[order]))[:-1]
    found: NDArray[np.intp] = order[values[order] > best]
    return found


def forced(number: int, count: int) -> Record:
    """The cells that no other beats, to be kept."""
    values, costs = clouded(number, count)
    return {"number": number, "values": values.tolist(), "costs": costs.tolist()}


def judged(number: int, known: Record, points: int) -> Record:
    """Number of points of a front that cells beat, the excess, and the front's largest hole."""
    given, cost = front(number)
    clock = time.process_time()
    found = pareto(given.metric, cost, given.over, given.base, points=points, max_seconds=LIMIT)
    seconds = time.process_time() - clock
    values, costs = np.array(known["values"]), np.array(known["costs"])
    record = {
        "front": f"{given.metric} against {cost} over {', '.join(given.over)}",
        "points": len(found.points),
        "status": str(found.status),
        "message": found.message,
        "seconds": seconds,
        "beaten": 0,
        "worst": 0.0,
        "hole": 1.0,
    }
    if not len(found.points):
        return record
    ranges = np.ptp(found.values) or 1.0, np.ptp(found.costs) or 1.0
    gains = np.array(
        [
            (values[costs <= own_cost] - value).max(initial=-np.inf) / ranges[0]
            for value, own_cost in zip(found.values, found.costs, strict=True)
        ]
    )
    reached = [
        found.values[found.costs <= own_cost].max(initial=-np.inf) / ranges[0] for own_cost in costs
    ]
    left = values / ranges[0] > np.array(reached) + WORSE
    off = np.maximum(
        abs(values[left, None] - found.values) / ranges[0],
        abs(costs[left, None] - found.costs) / ranges[1],
    )
    return record | {
        "beaten": int((gains > WORSE).sum()),
        "worst": float(gains.max()),
        "hole": float(off.min(axis=1).max(initial=0.0)),
    }


def report(count: int, cells_each: int, points: int, out: Path) -> int:
    """Print a table of the chosen fronts and random ones; how many have points that cells beat."""
    out.mkdir(parents=True, exist_ok=True)
    known = kept(
        out / f"clouds-{cells_each}.jsonl",
        lambda number: forced(number, cells_each),
        lambda done: len(done) >= count,
    )
    row = "{:58} {:>8} {:>8} {:>9} {:>6} {:>8}  {}"
    print(row.format("front", "points", "beaten", "by", "hole", "seconds", "status"))
    bad, lines = 0, []
    for number in range(count):
        one = judged(number, known[number], points)
        lines.append(json.dumps(one) + "\n")
        bad += bool(one["beaten"])
        shown = (f"{one['worst']:.1e}", f"{one['hole']:.2f}", f"{one['seconds']:.1f}")
        of = f"{one['points']}/{points}"
        print(row.format(one["front"], of, one["beaten"], *shown, one["status"]), flush=True)
    (out / "fronts.jsonl").write_text("".join(lines))
    return bad
