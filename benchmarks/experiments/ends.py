"""Ends of branches and curves at stiff stops: `python -m benchmarks ends`.

A branch may end where its orbit continues. Random motions of all scenes, at stops of stiffness 10
to 1,000, are continued in omega, alpha, a gap or a stiffness. Where a branch ends as if no orbit
were beyond, the map runs a little beyond the end, from the branch's last orbit. If it settles on a
motion close to that orbit, the end is false. Where the last orbits are unstable no run settles on
the next one: Newton's method on the map closes a run instead. A curve of a bifurcation in two
parameters has to end at a range, at its start, or in a codimension-two point. Results are appended
to a file, one line each: a run that was stopped resumes.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.experiments.kept import Record, kept
from capsule_sym import (
    InvalidInput,
    continue_bifurcation,
    continue_orbit,
    scenes,
    simulate,
    solve_orbit,
)
from capsule_sym.orbits import jacobian, orbit_at
from capsule_sym.results import Branch, Orbit

VARIED = ("omega", "omega", "omega", "alpha", "omega", "delta", "omega", "omega", "beta", "alpha")
UNIFORM = {
    **{"alpha": (0.3, 2.5), "omega": (0.3, 1.2), "D": (0.05, 0.5), "s": (-0.2, 0.2)},
    **{"alpha_low": (-2.0, 2.0), "zeta": (0.01, 0.1), "delta": (0.0, 1.0)},
    **{"f_b": (0.3, 1.5), "f_plus": (0.3, 1.5), "f_minus": (0.3, 1.5)},
}
LOGARITHMIC = {"beta": (10.0, 1000.0), "gamma": (0.2, 5.0)}
POINTS, LONGEST = 20, 4
BEYOND = (1e-6, 1e-5, 1e-4)
"""Relative distances beyond an end."""
PERIODS, CLOSE, NEWTON_STEPS = 2000, 10.0, 12
"""`CLOSE` times the root of the distance beyond: beyond a grazing an orbit changes by its root."""
BLUNT = ("no-admissible-orbit", "not-converged")
"""Statuses that say that no orbit is found beyond."""
NAMED = "codimension-two"


def drawn(random: Random, scene: Any) -> Any:
    """Random parameters of a scene."""
    values = {}
    for name in scene.Parameters().to_dict():
        kind = name.rstrip("_12") if name[-1] in "12" else name
        if kind in LOGARITHMIC:
            low, high = map(math.log, LOGARITHMIC[kind])
            values[name] = math.exp(random.uniform(low, high))
        else:
            values[name] = random.uniform(*UNIFORM[kind])
    return scene.Parameters(**values)


def start(random: Random, number: int) -> tuple[Orbit, str, float]:
    """A periodic motion at random parameters, the varied parameter and its last value."""
    scene = getattr(scenes, scenes.SHIPPED[number % len(scenes.SHIPPED)])
    while True:
        orbit = solve_orbit(drawn(random, scene), max_seconds=1.0)
        if orbit.success and orbit.itinerary.period_number <= LONGEST:
            break
    kind = random.choice(VARIED)
    name = kind if kind in orbit.parameters.to_dict() else f"{kind}_1"
    begin = orbit.value(name)
    ratio = 0.6 if kind == "omega" else random.choice([0.6, 1.5])
    return orbit, name, begin * ratio


def closed(parameters: Any, state: Any, number: int) -> Orbit | None:
    """Orbit to which Newton's method on the map leads from a state; None if to none."""
    for _ in range(NEWTON_STEPS):
        run = simulate(parameters, state.tolist(), periods=number)
        if not run.success:
            return None
        change = np.array(run.final[1], dtype=float) - state
        if abs(change).max() < 1e-8 * (1 + abs(state).max()):
            return orbit_at(parameters, state.tolist(), number)
        try:
            step = np.linalg.solve(jacobian(run) - np.eye(3), change)
        except np.linalg.LinAlgError:
            return None
        state = state - step
        if not np.all(abs(state) < 1e6):
            return None
    return None


def beyond(branch: Branch) -> list[Record]:
    """Motions a little beyond the end of a branch: how found, and how far from its last orbit."""
    last = branch.points[-1]
    before = branch.points[-2].value if len(branch.points) > 1 else branch.axis.begin
    way = math.copysign(1.0, (last.value - before) or branch.axis.end - branch.axis.begin)
    value, orbit = last.value, last.orbit
    for one in branch.bifurcations[-1:]:
        if way * (one.value - value) >= 0:
            value, orbit = one.value, one.orbit
    number, found = orbit.itinerary.period_number, list[Record]()
    period = orbit.parameters.period
    states = [np.array(orbit.trajectory()(k * period), dtype=float) for k in range(1, number + 1)]
    state = states[-1]
    size = 1 + max(abs(one).max() for one in states)

    def record(distance: float, how: str, marks: Any, periods: int) -> None:
        apart = min(abs(mark - state).max() for mark in marks) / size
        close = bool(apart < CLOSE * math.sqrt(distance))
        found.append(
            {"beyond": distance, "how": how, "apart": apart, "periods": periods, "close": close}
        )

    for distance in BEYOND:
        try:
            p = last.orbit.parameters.replace(
                **{branch.parameter: value + way * distance * max(abs(value), 1e-2)}
            )
        except InvalidInput:
            continue
        run = simulate(p, state.tolist(), periods=PERIODS)
        motion = run.steady()
        if motion is not None:
            marks = np.array(run.stroboscopic[-motion.period_number :], dtype=float)
            record(distance, "run", marks, motion.period_number)
        other = closed(p, state, number)
        if other is not None:
            periods = other.itinerary.period_number
            times = [k * p.period for k in range(1, periods + 1)]
            marks = np.array([other.trajectory()(t) for t in times], dtype=float)
            record(distance, "Newton", marks, periods)
    return found


def judged_branch(seed: int, number: int, seconds: float) -> Record:
    """Record of a branch: its end, and what the map does beyond."""
    clock = time.process_time()
    orbit, name, to = start(Random(f"ends {seed} {number}"), number)
    branch = continue_orbit(orbit, name, to, points=POINTS, max_seconds=seconds)
    at = branch.points[-1].value if branch.points else branch.axis.begin
    result = {
        "number": number,
        "scene": orbit.scene.name,
        "parameters": orbit.parameters.to_dict(),
        "name": branch.parameter,
        "to": branch.axis.end,
        "at": at,
        "share": (at - branch.axis.begin) / branch.axis.width,
        "status": str(branch.status),
        "message": branch.message,
        "points": len(branch.points),
        "events": [one.type for one in branch.bifurcations],
        "stable": all(abs(point.multipliers[0]) < 1 for point in branch.points[-1:]),
        "seconds": time.process_time() - clock,
    }
    judged = str(branch.status) in BLUNT and branch.points
    return result | {"beyond": beyond(branch) if judged else []}


def is_false(one: Record) -> bool:
    """True if there is a motion close to the last orbit at the least distance beyond the end."""
    return any(found["close"] and found["beyond"] == BEYOND[0] for found in one["beyond"])


def judged_curve(seed: int, number: int, seconds: float) -> Record:
    """Record of a curve in two parameters from a bifurcation of a branch, and of its ends."""
    random = Random(f"curves {seed} {number}")
    clock = time.process_time()
    while True:
        orbit, name, to = start(random, number)
        branch = continue_orbit(orbit, name, to, points=POINTS, max_seconds=seconds / 4)
        known = [one for one in branch.bifurcations if one.success]
        if known:
            break
    one = random.choice(known)
    second = "alpha" if name == "omega" else "omega"
    p = one.orbit.parameters.to_dict()
    (low, high), (lower, upper) = (sorted((0.8 * v, 1.2 * v)) for v in (p[name], p[second]))
    curve = continue_bifurcation(
        one, second, ((low, high), (lower, upper)), points=10, max_seconds=seconds / 2
    )
    named = [point.success for point in curve.codimension_two]
    return {
        "number": number,
        "scene": orbit.scene.name,
        "parameters": orbit.parameters.to_dict(),
        "name": name,
        "to": to,
        "label": one.label,
        "type": curve.type,
        "names": curve.parameters,
        "points": len(curve.points),
        "endings": [[str(status), message] for status, message in curve.endings],
        "named": named,
        "seconds": time.process_time() - clock,
    }


def is_missed(one: Record) -> bool:
    """True if a curve ends without a range, its start or a codimension-two point of this end."""
    found = [status for status, _ in one["endings"]]
    return any(status in BLUNT for status in found) or found.count(NAMED) > len(one["named"])


def check(branches: int, curves: int, seed: int, seconds: float, out: Path) -> int:
    """Judge ends of branches and curves; print counts and what is wrong; 1 if anything is."""
    out.mkdir(parents=True, exist_ok=True)
    known = kept(
        out / f"branches-{seed}.jsonl",
        lambda number: judged_branch(seed, number, seconds),
        lambda known: len(known) >= branches,
    )
    lost = [one for one in known if is_false(one)]
    _counted("branches", known, Counter(one["status"] for one in known))
    for one in lost:
        stable = "stable" if one["stable"] else "unstable"
        print(f"false end {one['number']}: {one['message']}, {stable} before; {one['beyond']}")
        print(f"    {one['scene']}, {one['name']} to {one['to']!r}, {one['parameters']}")
    known = kept(
        out / f"curves-{seed}.jsonl",
        lambda number: judged_curve(seed, number, seconds),
        lambda known: len(known) >= curves,
    )
    _counted("curves", known, Counter(status for one in known for status, _ in one["endings"]))
    missed = [one for one in known if is_missed(one)]
    for one in missed:
        print(f"curve {one['number']}: {one['type']} {one['label']}, {one['endings']}")
        print(f"    {one['scene']}, {one['name']} to {one['to']!r}, {one['parameters']}")
    print(f"{len(lost)} branches end falsely, {len(missed)} curves without a named point")
    return 1 if lost or missed else 0


def _counted(what: str, known: list[Record], counts: Counter[str]) -> None:
    seconds = sum(one["seconds"] for one in known)
    listed = ", ".join(f"{count} {status}" for status, count in counts.most_common())
    print(f"{len(known)} {what}, {seconds:.0f} s: {listed}")
