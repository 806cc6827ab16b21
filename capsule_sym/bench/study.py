"""The work-precision study: time per period, largest error and wrong switches of every tool."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from difflib import SequenceMatcher
from importlib import resources
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from capsule_sym.bench import peers
from capsule_sym.bench.model import Result
from capsule_sym.map import simulate
from capsule_sym.map.batch import final_state, final_states, parameter_rows, switches
from capsule_sym.parameters import Parameters

ALPHAS = (0.3, 0.45, 0.7, 1.2, 1.5, 1.64, 1.69, 1.9)
PERIODS = 20


class Tool(NamedTuple):
    """A tool at one setting; `check` gives the fields and state, `timed` only what is timed."""

    name: str
    setting: str
    check: peers.Run
    timed: Callable[[Parameters, int], Any]


class Row(NamedTuple):
    """A tool's result over all alphas."""

    tool: str
    setting: str
    us_per_period: float
    max_error: float
    missed: int
    invented: int


def tools() -> Iterator[Tool]:
    """Every tool and setting that can run here; a line says which cannot."""
    # The timed call is what a caller gets: one call from Python for one final state.
    yield Tool("capsule-sym C", "double", _core_check, _core_timed)
    yield Tool("capsule-sym NumPy", "double", _reference("numpy"), _reference("numpy"))
    try:
        import heyoka  # type: ignore[import-not-found,import-untyped,unused-ignore] # noqa: F401
    except ImportError:
        print("heyoka is not installed and is skipped: pip install 'capsule-sym[peers]'")
    else:
        for tolerance in (1e-9, 1e-12, 1e-15):
            for nudged in (False, True):
                run = peers.heyoka_run(tolerance, nudged)
                form = "nudged" if nudged else "naive"
                yield Tool("heyoka.py", f"{tolerance:g}, {form}", run, run)
    for method, tolerances in {
        "RK45": (1e-6, 1e-9),
        "DOP853": (1e-6, 1e-9, 1e-12),
        "LSODA": (1e-6, 1e-9),
        "Radau": (1e-6,),
    }.items():
        for tolerance in tolerances:
            run = peers.scipy_run(method, tolerance)
            yield Tool(f"SciPy {method}", f"{tolerance:g}", run, run)
    run = peers.rk4_run(1000)
    yield Tool("RK4, naive switching", "1000 steps a period", run, run)


def _core_check(p: Parameters, periods: int) -> Result:
    fields = "".join(map(str, switches(p, periods=periods)["field"]))
    state = final_states(parameter_rows(p), periods=periods).states[0]
    return Result(fields, tuple(state.tolist()))


def _core_timed(p: Parameters, periods: int) -> Any:
    return final_state(p, periods=periods)


def _reference(backend: str) -> peers.Run:
    def run(p: Parameters, periods: int) -> Result:
        trajectory = simulate(p, periods=periods, backend=backend)
        word = "".join(str(s.field) for s in trajectory.segments)
        return Result(word, tuple(float(v) for v in trajectory.final[1]))

    return run


def truth() -> dict[float, Result]:
    """Fields and final state at every alpha by the 50-digit map, rounded once."""
    text = resources.files(__package__).joinpath("truth.json").read_text(encoding="utf-8")
    return {
        float(alpha): Result(entry["fields"], tuple(map(float, entry["state"])))
        for alpha, entry in json.loads(text).items()
    }


def wrong_switches(word: str, exact: str) -> tuple[int, int]:
    """Switches missed and invented: letters of the exact word that are lacking, and additional."""
    same = sum(m.size for m in SequenceMatcher(None, exact, word, False).get_matching_blocks())
    return len(exact) - same, len(word) - same


def trajectories(repeats: int) -> list[Row]:
    """One trajectory at a time, peers interleaved; processor time, medians of the repeats."""
    exact, chosen = truth(), list(tools())
    spent: dict[Tool, list[float]] = {tool: [] for tool in chosen}
    for _ in range(repeats):
        for tool in chosen:
            calls = 200 if tool.name == "capsule-sym C" else 1
            begin = time.process_time()
            for alpha in ALPHAS:
                for _ in range(calls):
                    tool.timed(Parameters(alpha=alpha), PERIODS)
            used = time.process_time() - begin
            spent[tool].append(used / calls / len(ALPHAS) / PERIODS * 1e6)
    rows = []
    for tool in chosen:
        error, missed, invented = 0.0, 0, 0
        for alpha in ALPHAS:
            result = tool.check(Parameters(alpha=alpha), PERIODS)
            error = max(error, float(np.abs(np.subtract(result.state, exact[alpha].state)).max()))
            # The run's end cuts the last segment; it is no switch, whether a tool lists it or not.
            word, right = result.fields, exact[alpha].fields
            if tool.name == "capsule-sym C":
                right = right[:-1]
            lost, more = wrong_switches(word, right)
            missed, invented = missed + lost, invented + more
        rows.append(Row(tool.name, tool.setting, median(spent[tool]), error, missed, invented))
    return rows


def ratios(rows: list[Row]) -> dict[str, float]:
    """How many times the C core is faster than each other tool and setting."""
    ours = next(row for row in rows if row.tool == "capsule-sym C").us_per_period
    return {f"{row.tool} {row.setting}": row.us_per_period / ours for row in rows[1:]}


def growth(repeats: int) -> list[dict[str, float]]:
    """Time per period of the C core in sweeps of many alphas, by threads and by run length."""
    found = []
    for count, periods, threads in (
        (1000, 100, 1),
        (1000, 100, 2),
        (1, 10, 1),
        (1, 10**3, 1),
        (1, 10**5, 1),
    ):
        rows = parameter_rows(Parameters(), alpha=np.linspace(2.0, 0.002, count))
        spent, wall = [], []
        for _ in range(repeats):
            begin, start = time.process_time(), time.perf_counter()
            final_states(rows, periods=periods, threads=threads)
            spent.append(time.process_time() - begin)
            wall.append(time.perf_counter() - start)
        scale = 1e6 / count / periods
        found.append(
            {
                "alphas": count,
                "periods": periods,
                "threads": threads,
                "us_per_period": median(spent) * scale,
                "wall_us_per_period": median(wall) * scale,
            }
        )
    return found
