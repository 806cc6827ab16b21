"""The shortest pulses of ten pairs of motions beside brute force over the drive's values.

Brute force is separate code over runs of the map: it closes no orbit, and identifies a motion by
the states that its run repeats. `python -m benchmarks pulses` prints the table, and fails if
a pulse is longer.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym import scenes, simulate, simulate_many, solve_orbit, switch_by_pulse

VALUES, MOST = 100_000, 8
_SETTLED, _LONGEST, _CLOSE = 4000, 16, 1e-6  # periods, periods of a motion, distance from it
_BLOCK, _BLOCKS = 64, 16  # excitation periods after which runs are looked at, and how often
State = tuple[float, float, float]
# Scene, parameters that are not the scene's own, starts of both motions, and the bounds of the
# amplitude over its own.
PAIRS: list[tuple[str, dict[str, float], State, State, tuple[float, float]]] = [
    (
        "capsule",
        {"alpha": 2.5, "omega": 0.41, "delta": 0.41, "zeta": 0.025, "beta": 12.0, "gamma": 2.2},
        (0.5, -0.9, -0.9),
        (0.4, 0.9, 0.1),
        (0.8, 1.2),
    ),
    (
        "capsule",
        {"alpha": 2.5, "omega": 0.41, "delta": 0.41, "zeta": 0.025, "beta": 12.0, "gamma": 2.2},
        (0.4, 0.9, 0.1),
        (0.5, -0.9, -0.9),
        (0.8, 1.2),
    ),
    (
        "capsule",
        {"alpha": 0.85, "omega": 0.746, "delta": 0.375, "zeta": 0.035, "beta": 15.0, "gamma": 5.9},
        (0.5, -0.9, -0.9),
        (0.8, -0.4, -0.7),
        (0.0, 2.0),
    ),
    (
        "capsule",
        {"alpha": 0.5, "omega": 1.6, "delta": 0.48, "zeta": 0.032, "beta": 21.0, "gamma": 3.8},
        (0.5, -0.9, -0.9),
        (-0.8, -0.3, -0.9),
        (0.0, 2.0),
    ),
    (
        "capsule",
        {"alpha": 2.0, "omega": 0.882, "delta": 0.5, "zeta": 0.029, "beta": 26.6, "gamma": 2.64},
        (0.5, -0.9, -0.9),
        (1.7, 1.3, -1.0),
        (0.8, 1.2),
    ),
    (
        "capsule",
        {"alpha": 1.33, "omega": 1.173, "delta": 0.02, "zeta": 0.044, "beta": 21.0, "gamma": 3.36},
        (0.5, -0.9, -0.9),
        (0.4, 0.9, 0.1),
        (0.7, 1.3),
    ),
    (
        "slope",
        {"alpha": 2.17, "omega": 0.478, "zeta": 0.031, "beta": 14.7, "gamma": 3.41, "s": 0.09},
        (1.2, -1.1, -0.9),
        (0.5, -0.9, -0.9),
        (0.8, 1.2),
    ),
    (
        "reaction",
        {"alpha": 2.55, "omega": 1.004, "delta": 0.31, "zeta": 0.043, "beta": 20.1, "gamma": 1.46},
        (0.5, -0.9, -0.9),
        (1.7, 1.3, -1.0),
        (0.5, 1.5),
    ),
    (
        "reaction_pulse",
        {"alpha": 2.93, "D": 0.42, "omega": 0.677, "delta": 0.54, "zeta": 0.053, "beta": 15.2}
        | {"gamma": 4.0},
        (0.1, 2.7, -1.4),
        (2.7, -1.1, -0.3),
        (0.0, 2.0),
    ),
    (
        "prototype",
        {"alpha": 1.77, "D": 0.47, "omega": 1.075, "delta_1": 0.13, "delta_2": 0.27}
        | {"zeta": 0.057, "beta_1": 10.6, "beta_2": 8.1, "gamma": 1.07, "s": 0.08},
        (0.1, 2.7, -1.4),
        (-1.5, 1.6, -1.2),
        (0.9, 1.1),
    ),
]


def motion(parameters: Any, start: State) -> NDArray[np.float64]:
    """The states at phase 0 that a run repeats in the end."""
    begin = simulate(parameters, start, periods=_SETTLED, keep="final").final[1]
    marks = np.array(
        simulate(parameters, begin, periods=_LONGEST, keep="stroboscopic").stroboscopic
    )
    for length in range(1, _LONGEST + 1):
        if abs(marks[-1] - marks[-1 - length]).max() < 1e-9:
            return marks[-length:]
    raise ValueError(f"the run from {start} does not repeat itself")


def hits(
    parameters: Any, start: NDArray[Any], end: NDArray[Any], values: NDArray[Any], periods: int
) -> int:
    """Number of the amplitudes, over so many periods, that lead from one motion to the other."""
    found = 0
    usual = np.array([*parameters.to_dict().values()])
    for state in start:
        rows = np.tile(usual, (len(values), 1))
        rows[:, 0] = values
        states = simulate_many(rows, state, periods=periods, scene=parameters.scene).states
        for _ in range(_BLOCKS):
            rows = np.tile(usual, (len(states), 1))
            states = simulate_many(rows, states, periods=_BLOCK, scene=parameters.scene).states
            there, back = (
                abs(states[:, None] - marks).max(axis=2).min(axis=1) < _CLOSE
                for marks in (end, start)
            )
            found += int(there.sum())
            states = states[~there & ~back]
            if not len(states):
                break
    return found


def check(numbers: Sequence[int] = (), amplitudes: int = VALUES) -> int:
    """Print the table of these pairs, of all by default; how many pulses brute force beats."""
    print("  scene           periods   velocity          alpha         value    found  brute    s")
    longer = 0
    for number in numbers or range(len(PAIRS)):
        scene, given, *starts, shares = PAIRS[number]
        parameters = getattr(scenes, scene).Parameters(**given)
        bounds = shares[0] * parameters.alpha, shares[1] * parameters.alpha
        before, after = (solve_orbit(parameters, start) for start in starts)
        begun = time.process_time()
        found = switch_by_pulse(before, after, {"alpha": bounds}, most_periods=MOST)
        taken = time.process_time() - begun
        start, end = (motion(parameters, one) for one in starts)
        values = np.linspace(*bounds, amplitudes)
        brute = next(
            (n for n in range(1, MOST + 1) if hits(parameters, start, end, values, n)), MOST + 1
        )
        ours = found.periods or MOST + 1
        longer += ours > brute
        speeds = " ".join(f"{float(one.average_velocity):+.3f}" for one in (before, after))
        shown = [f"{n}" if n <= MOST else "none" for n in (ours, brute)]
        print(
            f"{number:2d} {scene:15s} {len(start)} to {len(end)}  {speeds}  "
            f"{bounds[0]:.3f}:{bounds[1]:.3f}  {found.value:9.6f}  {shown[0]:>5s}  {shown[1]:>5s}"
            f"  {taken:5.2f}",
            flush=True,
        )
    print(f"{longer} longer than brute force over {amplitudes:,} amplitudes")
    return longer
