"""Every tool and setting of the study, and which of them can run here."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import NamedTuple

from capsule_sym._native import core
from capsule_sym.bench.model import Run
from capsule_sym.bench.peers import compiled, cvode, own, scipy_events, taylor

OURS = "this map, C"
MPMATH = "this map, mpmath"
LANES = 8  # of heyoka's batch mode: faster here than the number it recommends, 4


class Tool(NamedTuple):
    """A tool at one setting.

    `build` gives what is timed; `check` a run that gives words too, where that one gives states
    alone. Of the tangencies and the sweep a `slow` tool makes only some.
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
        Tool("this map, NumPy", "double", partial(own.simulated, "numpy"), slow=True),
        Tool(MPMATH, "50 digits", partial(own.simulated, "mpmath"), slow=True),
    ]
    for form, careful in (("naive", False), ("careful", True)):
        tools += [
            Tool("heyoka.py", f"{tol:g}, {form}", partial(taylor.build, tol, careful))
            for tol in (1e-6, 1e-9, 1e-12, 1e-15)
        ]
    tools += _compiled(rk4_steps=(100, 1000, 10000))
    for method in ("Adams", "BDF"):
        tools += [
            Tool(f"CVODE {method}", f"{tol:g}", partial(cvode.build, method, tol), slow=True)
            for tol in (1e-6, 1e-9, 1e-12)
        ]
    for method, tolerances in {
        "RK45": (1e-6, 1e-9),
        "DOP853": (1e-6, 1e-9, 1e-12, 1e-13),
        "LSODA": (1e-6, 1e-9, 1e-12),
        "Radau": (1e-6,),
    }.items():
        tools += [
            Tool(f"SciPy {method}", f"{tol:g}", partial(scipy_events.build, method, tol), slow=True)
            for tol in tolerances
        ]
    return [tool for tool in tools if _lacks(tool.name) is None]


def for_sweeps() -> list[Tool]:
    """Tools for many trajectories that differ in alpha."""
    tools = [
        Tool(OURS, "double", lambda: own.sweep, check=own.simulated("c")),
        Tool("this map, NumPy", "double", partial(own.simulated, "numpy"), slow=True),
    ]
    for form, careful in (("naive", False), ("careful", True)):
        tools += [
            Tool(
                f"heyoka.py, {LANES} lanes",
                f"{tol:g}, {form}",
                partial(taylor.build, tol, careful, LANES),
            )
            for tol in (1e-9, 1e-12, 1e-15)
        ]
    tools += [
        *_compiled(rk4_steps=(100, 1000)),
        Tool("CVODE Adams", "1e-12", partial(cvode.build, "Adams", 1e-12), slow=True),
        Tool("SciPy DOP853", "1e-12", partial(scipy_events.build, "DOP853", 1e-12), slow=True),
    ]
    return [tool for tool in tools if _lacks(tool.name) is None]


def _compiled(rk4_steps: tuple[int, ...]) -> list[Tool]:
    tools = []
    for form, interior in (("ends of steps", False), ("inside steps", True)):
        tools += [
            Tool("DOP853 in C", f"{tol:g}, {form}", partial(compiled.dop853, tol, interior))
            for tol in (1e-6, 1e-9, 1e-12, 1e-13)
        ]
    return tools + [
        Tool("RK4 in C", f"{steps} steps a period", partial(compiled.rk4, steps))
        for steps in rk4_steps
    ]


def skipped() -> list[str]:
    """A line for every tool that cannot run here, which says why."""
    names = (OURS, "heyoka.py", "CVODE", "DOP853 and RK4 in C")
    return [f"{name} is skipped: {why}" for name in names if (why := _lacks(name))]


def _lacks(name: str) -> str | None:
    if name == OURS and core is None:
        return "the C core was not compiled"
    for package, prefix in (("heyoka", "heyoka.py"), ("sksundae", "CVODE")):
        if name.startswith(prefix) and find_spec(package) is None:
            return f"{package} is not installed (pip install 'capsule-sym[peers]')"
    if name.endswith("in C") and compiled.compiler() is None:
        return "there is no C compiler cc"
    return None
