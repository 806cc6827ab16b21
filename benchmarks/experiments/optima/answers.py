"""`optimise` beside brute force: `python -m benchmarks optima --problems 40 --cells 100000`.

Both append to files in a folder, a line each: interrupted work resumes where it ended,
brute force is not repeated, and answers are computed again if the code has changed.
"""

from __future__ import annotations

import json
import math
import time
from hashlib import sha256
from pathlib import Path

import numpy as np

from benchmarks.experiments.kept import Record, kept
from benchmarks.experiments.optima import brute
from benchmarks.experiments.optima.motions import settled
from benchmarks.experiments.optima.problems import Problem, problem
from capsule_sym import optimise, simulate_many
from capsule_sym.results import Optimum

HERE = Path(__file__).parent
WORSE, SEEDS_APART = 1e-6, 1e-9
ENDED = ("optimal", "optimal-at-border")
BESIDE = 8  # places next to an answer
RIDDLED = 0.02  # of neighbours near to the best on different motions: no best can be found there
LIMIT = 600.0  # seconds after which an answer is given up


def forced(number: int, cells: int) -> Record:
    """A problem, and what brute force finds."""
    given = problem(number)
    found = {"number": number, "call": given.call, "cells": cells}
    return found | brute.best_of(given, cells, number)


def answered(number: int, seed: int, samples: int | None = None) -> Record:
    """Result of `optimise` with a seed, by a survey of so many cells, and its time."""
    given = problem(number)
    wall, clock = time.perf_counter(), time.process_time()
    found = optimise(
        given.metric,
        given.over,
        given.base,
        seed=seed,
        samples=samples,
        max_seconds=LIMIT,
        **given.options,
    )
    return {
        "number": number,
        "seed": seed,
        "seconds": time.process_time() - clock,
        "wall": time.perf_counter() - wall,
        "status": str(found.status),
        "message": found.message,
        "value": found.value,
        "limit": found.limit,
        "bifurcation": found.bifurcation,
        "multiplier": found.multiplier,
        "over": found.over,
        "wrong": wrong(given, found),
    }


def wrong(given: Problem, found: Optimum) -> list[str]:
    """Claims of an answer that the motions from the starts contradict."""
    if str(found.status) not in (*ENDED, "not-converged"):
        return []
    names = [*found.system.to_dict()]
    rows = np.tile([*found.system.to_dict().values()], (1 + BESIDE, 1))
    # Exactly on a border between itineraries a motion is not closed, but next to it.
    for name, (low, high) in given.over.items():
        moved = np.random.default_rng(names.index(name)).uniform(-1e-9, 1e-9, BESIDE) * (high - low)
        rows[1:, names.index(name)] = np.clip(rows[1:, names.index(name)] + moved, low, high)
    motions = given.at(rows, sure=True)
    if not np.isfinite(given.judged(motions)[1]).any():
        # Next to a basin boundary, or to a bifurcation, a motion settles slowly.
        scene, row = given.base.scene, rows[:1]
        ends = [simulate_many(row, one, periods=20_000, scene=scene) for one in given.starts]
        motions = [settled(row, tuple(end.states[0]), True, scene) for end in ends]
    found_there = given.judged(motions)
    beyond, value, largest = (
        float(one[np.argmax(np.isfinite(found_there[1]))]) for one in found_there
    )
    sign, problems = -1 if given.maximise else 1, []
    if not math.isfinite(value):
        return ["no motion settles there"]
    if not abs(value - sign * found.value) <= 1e-7 * max(abs(value), 1e-3):
        problems.append(f"the starts lead to {sign * value!r}, multiplier {largest:.6f}")
    if beyond > 2e-6:
        problems.append(f"beyond a limit by {beyond:.2g}")
    return problems


def judged(known: Record, found: Record) -> Record:
    """By how much brute force is better than an answer, over the larger of value and spread."""
    sign = -1 if problem(known["number"]).maximise else 1
    best, held = known["best"], known["held"]
    if best is None:
        return {"miss": 0.0, "by": None}
    unit = unit_of(known)
    told = found["value"] if found["status"] in (*ENDED, "not-converged", "time-limit") else None

    def behind(claimed: float | None, better: Record | None) -> float:
        if better is None:
            return -math.inf
        if claimed is None or not math.isfinite(claimed):
            return math.inf
        return float(sign * (claimed - better["value"]) / unit)

    misses: tuple[tuple[float, Record | None], ...]
    limit = found["limit"]
    if limit is not None and math.isfinite(limit):
        misses = (behind(told, held), held), (behind(limit, best), best)
    else:
        misses = ((behind(told, best), best),)
    miss, by = max(misses, key=lambda one: one[0])
    return {"miss": miss, "by": by}


def unit_of(known: Record) -> float:
    """The larger of the best value and the spread of values; 1 if nothing moves."""
    spread = known["spread"] if math.isfinite(known["spread"]) else 0.0
    return max(abs(known["best"]["value"]), spread) or 1.0


def riddled(number: int, known: list[Record]) -> Record:
    """Share of neighbours on different motions near to the best that brute force found."""
    best = known[number]["best"]
    share = brute.scattered(problem(number), best["over"], number) if best else 0.0
    return {"number": number, "share": share}


def report(
    known: list[Record], answers: list[Record], shares: list[Record], out: Path | None
) -> int:
    """Print the table, and write the failures.

    Where basins are riddled the best has no place: such problems are counted apart.
    """
    torn = {one["number"] for one in shares if one["share"] > RIDDLED}
    by_number: dict[int, list[Record]] = {}
    for one in answers:
        by_number.setdefault(one["number"], []).append(one | judged(known[one["number"]], one))
    misses, spreads, failures, open_, lost = [], [], list[Record](), 0, 0
    apart: list[tuple[float, float]] = []
    for number, found in by_number.items():
        best = known[number]["best"]
        unit = unit_of(known[number]) if best else 1.0
        ended = [one["value"] for one in found if one["value"] == one["value"]]
        spreads.append(float(np.ptp(ended)) / unit if ended else 0.0)
        misses.append(max(one["miss"] for one in found))
        if number in torn:
            apart.append((misses[-1], spreads[-1]))
        open_ += any(one["status"] not in ENDED for one in found)
        lost += any(bool(one["wrong"]) for one in found)
        for one in found:
            kinds = ["missed"] * (one["miss"] > WORSE) + ["wrong"] * bool(one["wrong"])
            kinds += ["unconverged"] * (one["status"] not in ENDED)
            kinds += ["seeds"] * (spreads[-1] > SEEDS_APART) + ["slow"] * (one["seconds"] > 5)
            if kinds:
                call = known[number]["call"][:-1] + f", seed={one['seed']})"
                kinds += ["riddled"] * (number in torn)
                failures.append({"kinds": kinds, "call": call} | one)
    times = [one["seconds"] for one in answers] or [math.nan]
    rows = {
        "problems": len(misses),
        "with riddled basins at the best": len(apart),
        "missed by more than 1e-6": sum(miss > WORSE for miss in misses),
        "of these with riddled basins": sum(miss > WORSE for miss, _ in apart),
        "brute force is worse by as much": sum(miss < -WORSE for miss in misses),
        "worst miss": f"{max(misses, default=0):.3g}",
        "seeds differ by more than 1e-9": sum(spread > SEEDS_APART for spread in spreads),
        "of these with riddled basins ": sum(spread > SEEDS_APART for _, spread in apart),
        "largest difference of seeds": f"{max(spreads, default=0):.3g}",
        "not optimal, nor at a border": open_,
        "the starts lead elsewhere": lost,
        "seconds of processor, median": f"{np.median(times):.2f}",
        "longest": f"{max(times):.2f}",
        "brute force, median": f"{np.median([one['seconds'] for one in known]):.1f}",
    }
    for name, shown in rows.items():
        print(f"{name:32} {shown:>10}")
    if out is not None:
        out.write_text("".join(json.dumps(one) + "\n" for one in failures))
    return int(sum(miss > WORSE for miss in misses) > sum(miss > WORSE for miss, _ in apart))


def code() -> str:
    """A digest of what an answer rests on."""
    files = sorted((HERE.parents[2] / "capsule_sym" / "_design").glob("*.py"))
    files += [HERE / name for name in ("problems.py", "motions.py")]
    return sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]


def check(
    problems: int, cells: int, seeds: int, samples: int | None, only_known: bool, out: Path
) -> int:
    """Check so many problems, or those that brute force has done, with so many seeds."""
    survey = f"-{samples}" if samples else ""
    out.mkdir(parents=True, exist_ok=True)
    known = kept(
        out / "brute.jsonl",
        lambda number: forced(number, cells),
        lambda done: only_known or len(done) >= problems,
    )[:problems]
    answers = kept(
        out / f"answers-{seeds}{survey}-{code()}.jsonl",
        lambda number: answered(number // seeds, number % seeds, samples),
        lambda done: len(done) >= seeds * len(known),
    )
    answers = [one for one in answers if one["number"] < len(known)]
    shares = kept(
        out / "scattered.jsonl",
        lambda number: riddled(number, known),
        lambda done: len(done) >= len(known),
    )
    return report(known, answers, shares, out / f"failures{survey}.jsonl")
