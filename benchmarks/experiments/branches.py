"""Branches against brute force: `python -m benchmarks battery`.

Branches in all parameters and on two paths, from random motions. At values along the branch the map
alone, run from a state next to the branch's orbit, has to settle on a motion with the branch's
fields there; an event that the branch missed or misplaced appears as other fields. Events have to
form a chain of itineraries, each once. Results are appended to a file, one line a branch: a battery
that was stopped resumes.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.experiments.kept import kept
from capsule_sym import Parameters, continue_orbit, simulate, solve_orbit
from capsule_sym._map.interface import cyclic_start
from capsule_sym.results import Branch, BranchPoint

KINDS = ("alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b", "base excitation", "device")
RANGES = {
    "alpha": (0.05, 2.0),
    "omega": (0.3, 2.0),
    "delta": (0.0, 1.2),
    "zeta": (0.005, 0.2),
    "beta": (0.0, 20.0),
    "gamma": (0.5, 8.0),
    "f_b": (0.5, 2.0),
}
# Low damping, no stiffness, gap beyond friction, a capsule nearly pinned, resonance, superharmonic.
SPECIAL: tuple[dict[str, float], ...] = (
    {"zeta": 0.005},
    {"beta": 0.0},
    {"delta": 1.2},
    {"f_b": 50.0},
    {"omega": 1.0},
    {"omega": 0.34},
    {},
)
TIES = {
    "base excitation": ("omega", {"alpha": "0.9*omega**2"}),
    "device": ("stiffness", {"beta": "10*stiffness", "delta": "0.02+0.1*stiffness"}),
}
SAMPLES, PERIODS, OFF = 24, 600, 1e-6


def start(number: int) -> tuple[Parameters, str, float, float, dict[str, str]]:
    """Parameters at a branch's begin, what varies, its ends, and its ties."""
    kind, random = KINDS[number % len(KINDS)], np.random.default_rng([60, number])
    values = {name: float(random.uniform(*ends)) for name, ends in RANGES.items()}
    values["f_b"] = 1.0
    values |= SPECIAL[number % len(SPECIAL)]
    name, ties = TIES.get(kind, (kind, {}))
    low, high = RANGES.get(name, (0.1, 1.5))
    if name == "f_b" and values["f_b"] > high:
        values["f_b"] = 1.0
    begin = float(random.uniform(low, high))
    end = float(np.clip(begin + random.choice([-1, 1]) * 0.3 * (high - low), low, high))
    if name in values:
        values[name] = begin
    for tied, text in ties.items():
        values[tied] = float(eval(text, {name: begin}))
    return Parameters(**values), name, begin, end, ties


def settled(point: BranchPoint) -> tuple[int, ...] | None:
    """The cycle of fields on which the map settles from beside an orbit; None if it does not."""
    orbit, number = point.orbit, point.orbit.itinerary.period_number
    flow, p = orbit.system.flows[0], orbit.parameters
    state = np.array(flow.start, dtype=float) + OFF
    phase = min(float(flow.angle) / p.omega % p.period, np.nextafter(p.period, 0.0))
    run = simulate(p, state.tolist(), phase, PERIODS)
    motion = run.steady()
    if motion is None or motion.period_number != number:
        return None
    return written([one.field for one in motion.segments], p)


def written(fields: Sequence[int], parameters: Any) -> tuple[int, ...]:
    """A cycle begun where it is written; without stiffness contact is nothing."""
    cycle = list(fields)
    if parameters.beta == 0:
        cycle = [(field - 1) % 3 + 1 for field in cycle]
        merged = [field for k, field in enumerate(cycle) if field != cycle[k - 1]]
        cycle = merged or cycle[:1]
    first = cyclic_start(cycle)
    return (*cycle[first:], *cycle[:first])


def judged(number: int) -> dict[str, object]:
    """Events of a branch, and the verdict of brute force."""
    parameters, name, begin, end, ties = start(number)
    clock = time.process_time()
    result: dict[str, object] = {"number": number, "name": name, "from": begin, "to": end}
    orbit = solve_orbit(parameters)
    if not orbit.success:
        return result | {"status": str(orbit.status), "wrong": []}
    branch = continue_orbit(orbit, name, end, ties=ties or None)
    result["seconds"] = time.process_time() - clock
    wrong = chain(branch)
    stable = [p for p in branch.points if abs(p.multipliers[0]) < 0.97]
    chosen = stable[:: max(1, len(stable) // SAMPLES)]
    agreed = 0
    for point in chosen:
        if float(point.admissibility.value) < 1e-9:
            continue
        there = settled(point)
        own = written(point.orbit.itinerary.fields, point.orbit.parameters)
        if there is None:
            wrong.append(f"no motion of {len(own)} segments settles at {point.value!r}")
        elif there != own:
            wrong.append(f"at {point.value!r} the map has {there}, the branch {own}")
        else:
            agreed += 1
    return result | {
        "status": str(branch.status),
        "message": branch.message,
        "points": len(branch.points),
        "events": [one.type for one in branch.bifurcations],
        "agreed": agreed,
        "of": len(chosen),
        "wrong": wrong,
    }


def chain(branch: Branch) -> list[str]:
    """Errors in the order of a branch's events, and repeated events."""
    wrong, before = [], None
    for one in branch.bifurcations:
        if before is not None and str(before) != str(one.itinerary_before):
            wrong.append(f"{one.label} begins with {one.itinerary_before}, not {before}")
        before = one.itinerary_after
    for one, other in zip(branch.bifurcations, branch.bifurcations[1:], strict=False):
        near = abs(one.value - other.value) <= one.uncertainty + other.uncertainty
        if near and one.type == other.type:
            wrong.append(f"{one.label} and {other.label} are at the same value")
    return wrong


def check(count: int, path: Path) -> int:
    """Check so many branches; print the table."""
    known = kept(path, judged, lambda known: len(known) >= count)
    for one in known:
        counts = (
            f"{len(one.get('events', ())):3} events, {one.get('agreed', 0):2}/{one.get('of', 0)}"
        )
        ends = f"{one['name']:>9} {one['from']:8.4f} to {one['to']:8.4f}"
        print(f"{one['number']:3} {ends} {counts} {one.get('seconds', 0):6.1f} s {one['status']}")
        for what in one["wrong"]:
            print(f"      {what}")
    bad = sum(bool(one["wrong"]) for one in known)
    print(f"{len(known)} branches, {bad} with something wrong")
    return 1 if bad else 0
