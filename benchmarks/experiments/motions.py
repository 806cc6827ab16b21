"""Random periodic motions found by `solve_orbit`: `python -m benchmarks battery`.

Parameters are uniform in the ranges below. A run from rest that repeats itself over at most 16
excitation periods within 1e-9, by the states of the map alone, is a periodic motion; `solve_orbit`
has to find its orbit, through the run's last state. Results are appended to a file, one line each:
a run that was stopped resumes.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from benchmarks.experiments.kept import kept
from capsule_sym import Parameters, simulate, solve_orbit
from capsule_sym._orbits.interface import rerun

RANGES = {
    "alpha": (0.0, 5.0),
    "omega": (0.05, 3.0),
    "delta": (0.0, 1.5),
    "zeta": (0.005, 0.5),
    "beta": (0.0, 30.0),
    "gamma": (0.3, 10.0),
}
PERIODS, LONGEST, SAME, NEAR = 2048, 16, 1e-9, 1e-6


def drawn(number: int) -> Parameters:
    """The parameters of a motion; every tenth is hardly damped, every tenth without stiffness."""
    random = np.random.default_rng([16, number])
    values = {name: float(random.uniform(*ends)) for name, ends in RANGES.items()}
    if number % 10 == 0:
        values["zeta"] = 0.005
    if number % 10 == 1:
        values["beta"] = 0.0
    return Parameters(**values)


def judged(number: int) -> dict[str, object]:
    """Record of a motion: periodic or not, found or not."""
    parameters, begin = drawn(number), time.process_time()
    run = simulate(parameters, periods=PERIODS)
    marks = np.array(run.stroboscopic, dtype=float)
    result: dict[str, object] = {"number": number, "periods": None, "found": None}
    if run.success:
        size = 1 + abs(marks[-1]).max()
        off = [abs(marks[-1] - marks[-1 - k]).max() / size for k in range(1, LONGEST + 1)]
        periods = next((k for k, by in enumerate(off, 1) if by < SAME), None)
        result["periods"] = periods
        if periods is not None:
            orbit = solve_orbit(parameters)
            result["found"] = orbit.success
            result["message"] = "" if orbit.success else orbit.message
            if orbit.success:
                own = orbit.itinerary.period_number
                apart = abs(np.array(rerun(orbit).stroboscopic, dtype=float) - marks[-1])
                near = apart.max(axis=1).min() < NEAR * size
                result["found"] = bool(own == periods and near)
                result["message"] = "" if result["found"] else f"another orbit, of {own} periods"
    result["seconds"] = time.process_time() - begin
    return result


def check(count: int, path: Path) -> int:
    """Check motions until so many periodic ones are known; print those that are not found."""
    known = kept(
        path, judged, lambda known: sum(one["periods"] is not None for one in known) >= count
    )
    periodic = [one for one in known if one["periods"] is not None]
    lost = [one for one in periodic if not one["found"]]
    for one in lost:
        print(f"{one['number']}: {one['periods']} periods, not found: {one['message']}")
        print(f"    {drawn(one['number'])}")
    slow = sorted(one["seconds"] for one in periodic)
    print(f"{len(periodic)} periodic motions of {len(known)}, {len(lost)} not found")
    if slow:
        print(f"seconds: median {slow[len(slow) // 2]:.2f}, longest {slow[-1]:.2f}")
    return 1 if lost else 0
