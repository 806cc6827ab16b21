"""Brute force: many cells of the bounds, and the best of them polished by sampling around them.

No code is shared with the optimiser, and no gradient is taken: places are ranked by how far they
are beyond their limits, then by the metric of the motion that the starts lead to.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.stats import qmc

from benchmarks.experiments.optima.motions import Vector, stays
from benchmarks.experiments.optima.problems import Problem

AT_ONCE = 16384
PLACES, ZOOMED, ROUNDS = 24, 12, 8  # places that are looked at closer, samples, and rounds of it
FINISHED, APART = 4, 0.02  # places that are polished to the end, and the distance between them
PAIRS, BOX, CLOSE = 512, 0.01, 1e-7  # neighbours, and their distances over the bounds
MARGIN = 0.01  # of multipliers, of the second best
Judged = Callable[[Vector], tuple[Vector, Vector]]


def cells(dimension: int, count: int, seed: int) -> Vector:
    """Points (count, dimension) of a scrambled Sobol sequence in the unit cube."""
    sequence = qmc.Sobol(dimension, rng=np.random.default_rng(seed))
    return sequence.random_base2(math.ceil(math.log2(count)))[:count]


def overview(problem: Problem, u: Vector) -> tuple[Vector, Vector, Vector]:
    """`Problem.judged` for many places, a part of them at once."""
    parts = [problem.judged(problem.motions(u[i : i + AT_ONCE])) for i in range(0, len(u), AT_ONCE)]
    beyond, value, largest = (np.concatenate(one) for one in zip(*parts, strict=True))
    return beyond, value, largest


def best_of(problem: Problem, count: int, number: int) -> dict[str, Any]:
    """The best place of all stable motions, and of those with a margin, with their values."""
    clock = time.process_time()
    u = cells(len(problem.over), count, number)
    beyond, value, largest = overview(problem, u)
    known = value[np.isfinite(value) & (beyond == 0)]
    spread = float(np.subtract(*np.quantile(known, (0.75, 0.25)))) if len(known) else math.nan
    found: dict[str, Any] = {"spread": spread, "settled": float(np.isfinite(value).mean())}
    found["best"] = best = polished(problem, u, beyond, value, None, number)
    if best and best["multiplier"] > 1 - MARGIN and (problem.margin or 0) < MARGIN:
        beyond = np.maximum(beyond, largest - (1 - MARGIN))
        found["held"] = polished(problem, u, beyond, value, MARGIN, number)
    else:
        found["held"] = best
    return found | {"seconds": time.process_time() - clock}


def polished(
    problem: Problem, u: Vector, beyond: Vector, value: Vector, margin: float | None, seed: int
) -> dict[str, Any] | None:
    """The best place near the best cells at which the motion is one that a long run stays on."""
    random = np.random.default_rng(seed)

    def judged(places: Vector) -> tuple[Vector, Vector]:
        return problem.judged(problem.motions(places, sure=True), margin)[:2]

    near = np.asarray(cKDTree(u).query(u, min(len(u), 4 * u.shape[1]))[1])
    ahead = np.lexsort((value, beyond))
    rank = np.empty(len(u), int)
    rank[ahead] = np.arange(len(u))
    peaks = [i for i in ahead.tolist() if rank[i] == rank[near[i]].min()][:PLACES]
    step = len(u) ** (-1 / u.shape[1])
    zoomed = zoom(judged, u[peaks], step, random)
    chosen: list[Vector] = []
    for place in zoomed:
        if len(chosen) < FINISHED and all(abs(place - one).max() > APART for one in chosen):
            chosen.append(place)
    ends = [descended(judged, place, step / 8, random) for place in chosen]
    ends.sort(key=lambda end: end[:2])
    for beyond_it, _, place in ends:
        motions = problem.motions(place[None], sure=True)
        _, worst, largest = problem.judged(motions, margin)
        row = problem.rows(place[None])[0]
        if beyond_it == 0 and np.isfinite(worst[0]):
            starts = zip(problem.starts, motions, strict=True)
            if all(stays(row, start, one, problem.base.scene) for start, one in starts):
                return {
                    "value": float(-worst[0] if problem.maximise else worst[0]),
                    "over": dict(zip(problem.over, over_of(problem, place), strict=True)),
                    "multiplier": float(largest[0]),
                }
    return None


def scattered(problem: Problem, over: dict[str, float], number: int) -> float:
    """Share of pairs of neighbours near to a place whose starts lead to different motions.

    The neighbours are `CLOSE` apart, in a box of `BOX` to each side of the place. Next to a smooth
    boundary hardly any pair is on both sides of it; where basins are riddled many are.
    """
    random, d = np.random.default_rng(number), len(problem.over)
    place = [(over[name] - low) / (high - low) for name, (low, high) in problem.over.items()]
    one = np.clip(np.array(place) + BOX * random.uniform(-1, 1, (PAIRS, d)), 0, 1)
    other = np.clip(one + CLOSE * random.choice([-1.0, 1.0], (PAIRS, d)), 0, 1)
    apart = np.zeros(PAIRS, bool)
    for found in problem.motions(np.vstack([one, other]), sure=True):
        work = np.nan_to_num(found.metrics["work"], nan=-1.0).reshape(2, PAIRS)
        apart |= (abs(work[0] - work[1]) > 1e-4 * (1 + abs(work[0]))) | (
            found.period_number[:PAIRS] != found.period_number[PAIRS:]
        )
    return float(apart.mean())


def over_of(problem: Problem, place: Vector) -> list[float]:
    """The variables at a place, in their own units."""
    names, row = [*problem.base.to_dict()], problem.rows(place[None])[0].tolist()
    return [row[names.index(name)] for name in problem.over]


def zoom(judged: Judged, places: Vector, step: float, random: np.random.Generator) -> list[Vector]:
    """The places after some rounds of sampling around all of them at once, the best first."""
    count, dimension = places.shape
    steps, best = np.full(count, step), judged(places)
    for _ in range(ROUNDS):
        moves = random.normal(size=(count, ZOOMED, dimension)) * steps[:, None, None]
        tried = np.clip(places[:, None] + moves, 0, 1)
        found = judged(tried.reshape(-1, dimension))
        beyond, value = (one.reshape(count, ZOOMED) for one in found)
        for i in range(count):
            k = int(np.lexsort((value[i], beyond[i]))[0])
            if (beyond[i, k], value[i, k]) < (best[0][i], best[1][i]):
                places[i], best[0][i], best[1][i] = tried[i, k], beyond[i, k], value[i, k]
            else:
                steps[i] /= 2
    return [places[i] for i in np.lexsort((best[1], best[0])).tolist()]


def descended(
    judged: Judged, place: Vector, step: float, random: np.random.Generator
) -> tuple[float, float, Vector]:
    """Excess over limits, value and place at the end of CMA-ES: Hansen, arXiv:1604.00772."""
    d = len(place)
    size = 8 + 3 * d
    weights = np.log(size / 2 + 0.5) - np.log(np.arange(1, size // 2 + 1))
    weights /= weights.sum()
    effective = 1 / (weights**2).sum()
    c_step = (effective + 2) / (d + effective + 5)
    damping = 1 + 2 * max(0.0, math.sqrt((effective - 1) / (d + 1)) - 1) + c_step
    c_path = (4 + effective / d) / (d + 4 + 2 * effective / d)
    c_one = 2 / ((d + 1.3) ** 2 + effective)
    c_most = min(1 - c_one, 2 * (effective - 2 + 1 / effective) / ((d + 2) ** 2 + effective))
    normal = math.sqrt(d) * (1 - 1 / (4 * d) + 1 / (21 * d**2))
    mean, shape, step_path, path = place.copy(), np.eye(d), np.zeros(d), np.zeros(d)
    first = judged(place[None])
    best, since = (float(first[0][0]), float(first[1][0]), place), 0
    for _ in range(60 + 30 * d):
        scales, axes = np.linalg.eigh(shape)
        scales = np.sqrt(np.maximum(scales, 1e-30))
        moves = (random.normal(size=(size, d)) * scales) @ axes.T
        tried = np.clip(mean + step * moves, 0, 1)
        beyond, value = judged(tried)
        order = np.lexsort((value, beyond))
        k = order[0]
        since += 1
        if (beyond[k], value[k]) < best[:2]:
            since, best = 0, (float(beyond[k]), float(value[k]), tried[k])
        taken: NDArray[Any] = (tried[order[: len(weights)]] - mean) / step
        move = weights @ taken
        mean = mean + step * move
        whitened = axes @ ((axes.T @ move) / scales)
        step_path = (1 - c_step) * step_path + math.sqrt(c_step * (2 - c_step) * effective) * (
            whitened
        )
        far = float(np.linalg.norm(step_path))
        path = (1 - c_path) * path
        if far < (1.4 + 2 / (d + 1)) * normal:
            path += math.sqrt(c_path * (2 - c_path) * effective) * move
        shape = (1 - c_one - c_most) * shape + c_one * np.outer(path, path)
        shape += c_most * (taken.T * weights) @ taken
        step *= math.exp(min(1.0, (c_step / damping) * (far / normal - 1)))
        if step * scales.max() < 1e-9 or since > 12 + 4 * d:
            break
    return best
