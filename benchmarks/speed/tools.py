"""Tools and settings of the study; which of them can run here."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from importlib import import_module
from typing import NamedTuple

from benchmarks.speed.model import Run
from benchmarks.speed.peers import compiled, cvode, own, scipy_events, taylor
from capsule_sym._native import core

OURS = "this map, C"
ONE_ROW = "this map, simulate_many"
WHOLE = "this map, all segments"
OWN = (OURS, ONE_ROW, WHOLE)
MPMATH = "this map, mpmath"
IN_C = "DOP853 and RK4 in C"
LANES = 8  # of heyoka's batch mode: faster here than the number it recommends, 4


class Tool(NamedTuple):
    """A tool at one setting.

    `build` returns the function that is timed. If that gives states alone, `check` is a run
    function that gives itineraries too. A `slow` tool makes a part of the runs of tangencies and
    sweep.
    """

    name: str
    setting: str
    build: Callable[[], Run]
    slow: bool = False
    check: Run | None = None


def one_at_a_time() -> list[Tool]:
    """Tools for one trajectory."""
    tools = [
        Tool(OURS, "double", lambda: own.final, check=own.simulated("c")),
        Tool(ONE_ROW, "double, one row", lambda: own.one_row, check=own.simulated("c")),
        Tool(WHOLE, "double, kept", lambda: own.whole, check=own.simulated("c")),
        Tool("this map, NumPy", "double", partial(own.simulated, "numpy"), slow=True),
        Tool(MPMATH, "50 digits", partial(own.simulated, "mpmath"), slow=True),
    ]
    for careful in (False, True):
        tools += [
            Tool("heyoka.py", _setting(tol, careful), partial(taylor.build, tol, careful))
            for tol in (1e-6, 1e-9, 1e-12, 1e-15)
        ]
    for method in ("Adams", "BDF"):
        tools += [_cvode(method, tolerance) for tolerance in (1e-6, 1e-9, 1e-12)]
    tools.append(_cvode("Adams", 1e-12, careful=False))
    for method, tolerances in {
        "RK45": (1e-6, 1e-9),
        "DOP853": (1e-6, 1e-9, 1e-12, 1e-13),
        "LSODA": (1e-6, 1e-9, 1e-12),
        "Radau": (1e-6,),
    }.items():
        tools += [_scipy(method, tolerance) for tolerance in tolerances]
    tools.append(_scipy("DOP853", 1e-12, careful=False))
    return _present(tools, (100, 1000, 10000))


def for_sweeps() -> list[Tool]:
    """Tools for many trajectories that differ in alpha."""
    tools = [
        Tool(OURS, "double", lambda: own.sweep, check=own.simulated("c")),
        Tool(WHOLE, "double, kept", lambda: own.whole, check=own.simulated("c")),
        Tool("this map, NumPy", "double", partial(own.simulated, "numpy"), slow=True),
    ]
    for careful in (False, True):
        tools += [
            Tool(
                f"heyoka.py, {LANES} lanes",
                _setting(tol, careful),
                partial(taylor.build, tol, careful, LANES),
            )
            for tol in (1e-9, 1e-12, 1e-15)
        ]
    tools += [_cvode("Adams", 1e-12), _scipy("DOP853", 1e-12)]
    return _present(tools, (100, 1000))


def _present(tools: list[Tool], rk4_steps: tuple[int, ...]) -> list[Tool]:
    """Those that can run here, and the integrators in C, RK4 with so many steps a period."""
    tools += [
        Tool("DOP853 in C", f"{tol:g}, {form}", partial(compiled.dop853, tol, interior))
        for form, interior in (("ends of steps", False), ("inside steps", True))
        for tol in (1e-6, 1e-9, 1e-12, 1e-13)
    ]
    tools += [
        Tool("RK4 in C", f"{steps} steps a period", partial(compiled.rk4, steps))
        for steps in rk4_steps
    ]
    return [tool for tool in tools if _lacks(tool.name) is None]


def _cvode(method: str, tolerance: float, careful: bool = True) -> Tool:
    build = partial(cvode.build, method, tolerance, careful)
    return Tool(f"CVODE {method}", _setting(tolerance, careful), build, slow=True)


def _scipy(method: str, tolerance: float, careful: bool = True) -> Tool:
    build = partial(scipy_events.build, method, tolerance, careful)
    return Tool(f"SciPy {method}", _setting(tolerance, careful), build, slow=True)


def _setting(tolerance: float, careful: bool) -> str:
    return f"{tolerance:g}, {'careful' if careful else 'naive'}"


def skipped() -> list[str]:
    """One line for each tool that cannot run here, with the reason."""
    names = (OURS, "heyoka.py", "CVODE", IN_C)
    return [f"{name} is skipped: {why}" for name in names if (why := _lacks(name))]


def _lacks(name: str) -> str | None:
    if name in OWN and core is None:
        return "the C core was not compiled"
    if name.endswith(" in C"):
        return compiled.problem()
    for package, prefix in (("heyoka", "heyoka.py"), ("sksundae", "CVODE")):
        if name.startswith(prefix) and not _is_there(package):
            return f"{package} is not installed (python -m pip install --group peers)"
    return None


@cache
def _is_there(package: str) -> bool:
    """True if a package can be imported. It is imported here, outside the timed part."""
    try:
        import_module(package)
    except ImportError:
        return False
    return True
