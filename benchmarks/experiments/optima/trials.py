"""SciPy's global optimisers on the problems of `optima`: `python -m benchmarks trials`.

Each gets the same metric of the motions from the starts, equally often; what is beyond a limit is
worse than all that keeps it. The best known value is that of brute force, of `optimise` or of any
of them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

import numpy as np
from scipy.optimize import differential_evolution, direct, dual_annealing, shgo

from benchmarks.experiments.kept import Record, kept
from benchmarks.experiments.optima.answers import answered, forced
from benchmarks.experiments.optima.motions import Vector
from benchmarks.experiments.optima.problems import Problem, problem

AMONG = (1e-6, 1e-3)
REFUSED = 1e6  # where no motion settles


class Spent(Exception):
    """All evaluations are used up."""


class Counted:
    """The objective of a problem, which keeps the best feasible value of so many evaluations."""

    def __init__(self, given: Problem, most: int) -> None:
        self.problem, self.left, self.best = given, most, math.inf
        probe = given.judged(given.motions(np.random.default_rng(0).uniform(size=(64, self.d))))
        finite = probe[1][np.isfinite(probe[1])]
        self.worst, self.unit = float(finite.max()), float(np.ptp(finite)) or 1.0

    @property
    def d(self) -> int:
        """Number of variables."""
        return len(self.problem.over)

    def __call__(self, u: Vector) -> float:
        """The objective at a place, or a punishment for what is beyond the limits."""
        return float(self.many(np.asarray(u)[:, None])[0])

    def many(self, u: Vector) -> Vector:
        """The same of places (d, n), as `vectorized` requires."""
        if self.left <= 0:
            raise Spent
        self.left -= u.shape[1]
        beyond, value, _ = self.problem.judged(self.problem.motions(np.clip(u.T, 0, 1)))
        self.best = min(self.best, float(value[beyond == 0].min(initial=math.inf)))
        punished = self.worst + self.unit * (1 + np.minimum(beyond, REFUSED))
        return np.where(beyond == 0, value, punished)


METHODS: dict[str, Callable[[Counted, Any], object]] = {
    "shgo": lambda f, box: shgo(f, box, n=256, iters=64, sampling_method="sobol"),
    "direct": lambda f, box: direct(f, box, maxfun=10**6, maxiter=10**6, vol_tol=0, len_tol=0),
    "differential_evolution": lambda f, box: differential_evolution(
        cast("Any", f.many),
        box,
        maxiter=10**6,
        tol=0,
        polish=False,
        vectorized=True,
        updating="deferred",
        init="sobol",
        rng=0,
    ),
    "dual_annealing": lambda f, box: dual_annealing(f, box, maxiter=10**6, rng=0),
}


def tried(number: int, evaluations: int, known: Record) -> Record:
    """The best value that each method finds, as what is to be least, and its seconds."""
    given = problem(number)
    sign = -1.0 if given.maximise else 1.0
    found: Record = {"number": number, "seconds": {}, "values": {}}
    for name, method in METHODS.items():
        counted, clock = Counted(given, evaluations), time.process_time()
        with suppress(Spent):
            method(counted, [(0, 1)] * counted.d)
        found["seconds"][name] = time.process_time() - clock
        found["values"][name] = counted.best
    found["values"]["brute force"] = sign * known["best"]["value"] if known["best"] else math.inf
    return found | {"unit": known["spread"]}


def with_own(one: Record) -> Record:
    """The same with what `optimise` finds."""
    found = answered(one["number"], 0)
    good = found["status"].startswith("optimal") and not found["wrong"]
    sign = -1.0 if problem(one["number"]).maximise else 1.0
    one["values"]["optimise"] = sign * found["value"] if good else math.inf
    one["seconds"]["optimise"] = found["seconds"]
    best = min(one["values"].values())
    return one | {"best": best, "unit": max(abs(best), one["unit"])}


def report(problems: int, evaluations: int, cells: int, out: Path) -> None:
    """Try all of them on the first problems, and print a table."""
    out.mkdir(parents=True, exist_ok=True)

    def enough(done: list[Record]) -> bool:
        return len(done) >= problems

    known = kept(out / "brute.jsonl", lambda number: forced(number, cells), enough)
    path = out / f"trials-{evaluations}.jsonl"
    records = kept(path, lambda n: tried(n, evaluations, known[n]), enough)
    records = [with_own(one) for one in records[:problems]]
    row = "{:24} {:>12} {:>12} {:>10} {:>10}"
    print(row.format("method", *(f"within {by:g}" for by in AMONG), "median s", "longest s"))
    for name in ("optimise", *METHODS):
        off = np.array([(one["values"][name] - one["best"]) / one["unit"] for one in records])
        seconds = [one["seconds"][name] for one in records]
        counts = (f"{int((off <= by).sum())} of {len(off)}" for by in AMONG)
        print(row.format(name, *counts, f"{np.median(seconds):.2f}", f"{max(seconds):.2f}"))
