"""Times of a user's first calls: a run with its segments, states at many times, a fit, a command.

Beside it stand SciPy's dense output and heyoka.py's continuous output, over the same segments:
where they begin and how long they last is given to these, so that they look for no switch.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.speed.model import CONTACT, DRIFT, rates
from capsule_sym import Parameters, simulate
from capsule_sym._parameters import of_paper
from capsule_sym.results import Trajectory

TOLERANCE = 1e-12
_FIT_PERIODS, _FIT_TIMES = 20, 2000
_FIRST = "from capsule_sym import Parameters, simulate; simulate(Parameters(), periods=1)"
_FIRST_CALL, _BARE, _NUMPY = ("-c", _FIRST), ("-c", "pass"), ("-c", "import numpy")
_COMMANDS = tuple(
    ("-m", "capsule_sym", *words)
    for words in ((), ("--help",), ("run", "--help"), ("branch", "--help"), ("sweep", "--help"))
)
_SHORT = (_FIRST_CALL, _BARE, _NUMPY, *_COMMANDS)


class Figure(NamedTuple):
    """One figure of the face: a time or a size, what it should be at most, and by whom."""

    what: str
    tool: str
    value: float
    unit: str
    goal: float | None
    error: float | None
    """Largest difference from this map's states."""


Call = Callable[[], object]


def how(repeats: int) -> str:
    """Method of the measurement, in one line."""
    return f"by the clock, the least of {repeats} rounds through all calls, the others' among them"


def figures(quick: bool, repeats: int) -> Iterator[Figure]:
    """All figures; of the quick kind with a tenth of the periods and of the times."""
    part = 10 if quick else 1
    periods, count = 1000 // part, 10**6 // part
    p = Parameters()
    run = simulate(p, periods=periods)
    times = np.linspace(0.0, periods * p.period, count)
    mixed = np.random.default_rng(0).permutation(times)
    others = {"SciPy DOP853, dense output": _scipy}
    if not lacking():
        others["heyoka.py, c_output"] = _heyoka
    integrated: dict[str, Evaluate] = {}
    calls: dict[object, Call] = {
        "one": lambda: simulate(p, periods=1),
        "end": lambda: simulate(p, periods=1, keep="final"),
        "run": lambda: simulate(p, periods=periods),
        "sorted": lambda: run(times, position=True),
        "mixed": lambda: run(mixed, position=True),
        "fit": _fit,
    }
    for tool, build in others.items():
        calls[tool, "built"] = partial(_built, integrated, tool, build, run)
        calls[tool, "states"] = partial(_states, integrated, tool, times)
    for words in _SHORT:
        calls[words] = partial(_process, *words)
    often: dict[object, int] = {"run": 5, "fit": 50, "one": 5000, "end": 5000} | dict.fromkeys(
        _SHORT, 3
    )
    least = _least(calls, repeats, often)

    ours = "this map"
    size = (run.records.nbytes + run.stroboscopic.nbytes) / periods
    taken = least["run"] / periods * 1e6
    one, end = (least[name] * 1e6 for name in ("one", "end"))
    yield Figure("simulate, one period, its segments kept", ours, one, "us", 30.0, None)
    yield Figure("simulate, one period, its end kept", ours, end, "us", 10.0, None)
    yield Figure("simulate, all segments kept, a period", ours, taken, "us", 4.0, None)
    yield Figure("memory of that, a period", ours, size, "bytes", 900.0, None)
    each = f"{count:.0e} times over {periods} periods, with positions".replace("e+0", "e")
    dense, shuffled = 100.0 / part, 250.0 / part
    yield Figure(f"{each}, sorted", ours, least["sorted"] * 1e3, "ms", dense, None)
    yield Figure(f"{each}, in random order", ours, least["mixed"] * 1e3, "ms", shuffled, None)
    what = "a fit: 20 periods and 2,000 samples"
    yield Figure(what, ours, least["fit"] * 1e3, "ms", 0.5, None)
    true = run(times, position=True)
    for tool, evaluate in integrated.items():
        taken = least[tool, "built"] / periods * 1e6
        yield Figure("integrated, switches given, a period", tool, taken, "us", None, None)
        off = float(np.abs(evaluate(times) - true).max())
        taken = least[tool, "states"] * 1e3
        yield Figure(f"{each}, sorted", tool, taken, "ms", None, off)

    whole, bare, with_numpy = (least[words] * 1e3 for words in (_FIRST_CALL, _BARE, _NUMPY))
    yield Figure("python, before anything is imported", "python", bare, "ms", None, None)
    yield Figure("import numpy alone", "python", with_numpy, "ms", None, None)
    yield Figure("import and first simulate", ours, whole, "ms", 150.0, None)
    yield Figure("of that, what is not NumPy's", ours, whole - with_numpy, "ms", None, None)
    for words in _COMMANDS:
        name = " ".join(("capsule-sym", *words[2:]))
        yield Figure(name, ours, least[words] * 1e3, "ms", 100.0, None)


def _least(
    calls: Mapping[object, Call], repeats: int, more: Mapping[object, int]
) -> dict[object, float]:
    """Seconds of each call, the least of all rounds; those in `more` so many times in each.

    A machine's clock may change by a factor while it is measured. In rounds the change is felt by
    all calls, and no call has the fast minutes for itself.
    """
    least = dict.fromkeys(calls, float("inf"))
    for _ in range(repeats):
        for name, call in calls.items():
            for _ in range(more.get(name, 1)):
                begin = perf_counter()
                call()
                least[name] = min(least[name], perf_counter() - begin)
    return least


def lacking() -> list[str]:
    """A line for each tool that is not there."""
    try:
        import heyoka  # type: ignore[import-not-found,import-untyped,unused-ignore] # noqa: F401
    except ImportError:
        return ["heyoka.py is skipped: it is not installed (python -m pip install --group peers)"]
    return []


def _fit() -> NDArray[np.float64]:
    """A model's evaluation in a fit: another amplitude and damping each time, then the samples."""
    _fit.count += 1  # type: ignore[attr-defined]
    shift = 1e-7 * _fit.count  # type: ignore[attr-defined]
    p = Parameters(alpha=0.7 + shift, zeta=0.05 + shift)
    times = np.linspace(0.0, _FIT_PERIODS * p.period, _FIT_TIMES)
    return simulate(p, periods=_FIT_PERIODS)(times)


_fit.count = 0  # type: ignore[attr-defined]


def _process(*words: str) -> None:
    """A process as a user has it, whose modules were compiled when they were installed."""
    settings = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    # In a session of its own, Ctrl-C is for this process alone, which ends that one.
    own: Any = {"stdout": subprocess.DEVNULL, "env": settings, "start_new_session": True}
    subprocess.run([sys.executable, *words], check=False, **own)


Evaluate = Callable[[NDArray[np.float64]], NDArray[np.float64]]
Build = Callable[[Trajectory], Evaluate]


def _built(kept: dict[str, Evaluate], tool: str, build: Build, run: Trajectory) -> None:
    kept[tool] = build(run)


def _states(kept: Mapping[str, Evaluate], tool: str, times: NDArray[np.float64]) -> None:
    kept[tool](times)


def _begins(run: Trajectory) -> NDArray[np.float64]:
    """When the segments begin, and the run ends."""
    p, records = run.parameters, run.records
    starts = records["start_period"] * p.period + records["start_angle"] / p.omega
    return np.append(starts, run.final[0].period * p.period + run.final[0].phase)


def _scipy(run: Trajectory) -> Evaluate:
    """All segments by solve_ivp, and their dense outputs as one."""
    from scipy.integrate import OdeSolution, solve_ivp

    begins, ends, parts = _begins(run), [0.0], []
    for i, segment in enumerate(run.segments):
        rate = rates(of_paper(run.parameters), segment.field)

        def derivative(t: float, z: Any, rate: Any = rate) -> tuple[float, ...]:
            x_r, v_r, v_c, _ = z.tolist()
            return *rate(t, x_r, v_r), v_c

        found: Any = solve_ivp(
            derivative,
            (begins[i], begins[i + 1]),
            np.array([*segment.start_state, segment.position]),
            method="DOP853",
            rtol=TOLERANCE,
            atol=TOLERANCE,
            dense_output=True,
        )
        ends += found.sol.ts[1:].tolist()
        parts += found.sol.interpolants
    whole: Any = OdeSolution(ends, parts)
    return lambda times: np.asarray(whole(times)).T


def _heyoka(run: Trajectory) -> Evaluate:
    """All segments by one Taylor integrator, and their continuous outputs."""
    import heyoka as hy

    hy.set_logger_level_critical()
    p = of_paper(run.parameters)
    x, v, w, z = hy.make_vars("x", "v", "w", "z")
    spring, slip, friction = (hy.par[i] for i in range(3))
    pull = x + 2.0 * p.zeta * v + spring * (x - p.delta)
    capsule = slip * pull - friction
    system = [
        (x, v),
        (v, p.alpha * hy.cos(p.omega * hy.time) - pull - capsule),
        (w, capsule),
        (z, w),
    ]
    integrator = hy.taylor_adaptive(system, state=np.zeros(4), pars=np.zeros(3), tol=TOLERANCE)
    begins, outputs = _begins(run), []
    for i, segment in enumerate(run.segments):
        drift = DRIFT[segment.field]
        slips = 1 / p.gamma if drift else 0.0
        integrator.pars[:] = (CONTACT[segment.field] * p.beta, slips, drift * p.f_b * slips)
        integrator.state[:] = (*segment.start_state, segment.position)
        integrator.time = begins[i]
        outputs.append(integrator.propagate_until(begins[i + 1], c_output=True)[4])

    def evaluate(times: NDArray[np.float64]) -> NDArray[np.float64]:
        places = np.searchsorted(times, begins[:-1])
        chunks = np.split(times, places[1:])
        return np.concatenate(
            [np.array(out(chunk)) for out, chunk in zip(outputs, chunks, strict=True) if len(chunk)]
        )

    return evaluate
