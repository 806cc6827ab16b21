"""Public functions, constructors and methods called with typical mistakes: one line each."""

import contextlib
import inspect
import math
import re
import signal
import zlib
from decimal import Decimal
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import scipy.optimize
import scipy.stats  # noqa: F401
import xarray as xr
from matplotlib.figure import Figure

import capsule_sym as cs
import capsule_sym._arguments
from capsule_sym import CapsuleError
from capsule_sym._errors import counted
from capsule_sym._orbits.continuation.records import branch_record
from tests.public import PUBLIC
from tests.sampling import ALL

_BOX = {"x_r": (-1.0, 1.0), "v_r": (-1.0, 1.0)}
_TIMES = np.linspace(0.0, 20.0, 40)
_PULSED = dict(alpha=2.5, omega=0.41, delta=0.41, zeta=0.025, beta=12.0, gamma=2.2)
# A case of each class: an expression of others.
_CASES = {
    "p": "cs.Parameters()",
    "device": "cs.PhysicalParameters(1.0, 3.0, 1.0, 1.0, 0.05, 0.1, 1.0, 1.0, 0.1)",
    "run": "cs.simulate(p, periods=3)",
    "runs": "cs.simulate_many([p, p], periods=3)",
    "orbit": "cs.solve_orbit(p)",
    "none": "solve_itinerary(p, Itinerary.parse('52'), [math.nan] * 6)",
    "itinerary": "orbit.itinerary",
    "branch": "cs.continue_orbit(orbit, 'alpha', 0.4, points=5)",
    "record": "branch_record(branch)",
    "point": "branch.bifurcations[0]",
    "curve": "cs.continue_bifurcation(point, 'zeta', ((0.1, 2.0), (0.01, 0.1)), points=3)",
    "found": "cs.attractors(p, BOX, count=4)",
    "back": "cs.solve_orbit(cs.Parameters(**PULSED), (0.5, -0.9, -0.9))",
    "forth": "cs.solve_orbit(cs.Parameters(**PULSED), (0.4, 0.9, 0.1))",
    "data": "{'t': TIMES, 'x_r': cs.simulate(p, periods=3)(TIMES)[:, 0]}",
    "fitted": "cs.fit(data, p, ['zeta'])",
    "optimum": "cs.optimise('velocity', {'alpha': (0.5, 0.6)}, p)",
    "front": "cs.pareto('velocity', 'work', {'alpha': (0.5, 0.6)}, p, points=3)",
    "spread": "cs.tolerances('velocity', {'alpha': 0.01}, p, samples=128)",
    "slopes": "cs.sensitivities(run, [1.0, 2.0])",
    "performances": "cs.performance_many([[*p.to_dict().values()]], [[0.0, 0.0, 0.0]])",
    "axis": "Axis.linear('alpha', 0.1, 1.0, 2)",
    "sweep": "Sweep((axis,), periods=3)",
    "axes": "__import__('matplotlib.figure').figure.Figure().subplots()",
    "cells": "xr.Dataset({'itinerary': ('alpha', [1, 2])}, {'alpha': [0.5, 0.6]})",
}
# Right arguments of functions, constructors and methods: those that are required.
_CALLS = {
    "attractors": "p, BOX",
    "certify_bifurcation": "point",
    "certify_orbit": "orbit",
    "certify_run": "run",
    "check_certificate": "{}",
    "check_switches": "[1.0], ['F2'], p",
    "continue_attractors": "p, 'alpha', [0.6, 0.7], BOX",
    "continue_bifurcation": "point, 'zeta', ((0.1, 2.0), (0.01, 0.1))",
    "continue_both_ways": "orbit, 'alpha', (0.6, 0.8)",
    "continue_from": "branch, 'BI1', 0.4",
    "continue_orbit": "orbit, 'alpha', 0.6",
    "device_path": "device, 'P_d'",
    "figure_style": "7.0",
    "fit": "data, p, ['zeta']",
    "floquet_multipliers": "orbit",
    "half_orbit": "orbit",
    "is_admissible": "orbit",
    "jacobian": "run",
    "load_parameters": "'parameters.toml'",
    "lyapunov_exponents": "run",
    "minimal_shock": "orbit",
    "mirror_image": "orbit",
    "monodromy_matrix": "orbit",
    "open_results": "'store'",
    "optimise": "'velocity', {'alpha': (0.5, 0.6)}",
    "orbit_at": "p, (0.0, 0.0, 0.0), 1",
    "orbit_from_record": "record['points'][0]",
    "parameter_path": "'alpha'",
    "pareto": "'velocity', 'work', {'alpha': (0.5, 0.6)}",
    "performance": "orbit",
    "performance_many": "[[*p.to_dict().values()]], [[0.0, 0.0, 0.0]]",
    "period_doubling_cascade": "branch, 1",
    "plot": "run",
    "plot_basin": "cells",
    "plot_chart": "cells",
    "plot_diagram": "record",
    "plot_displacements": "run, axes",
    "plot_front": "front",
    "plot_metric": "cells",
    "plot_motion": "run",
    "plot_phase_portrait": "run, axes",
    "plot_residuals": "fitted",
    "plot_tolerances": "spread",
    "read_branch": "'branch.json'",
    "read_measured": "'data.csv'",
    "read_plan": "{'axes': {'alpha': [0.5]}}",
    "read_switches": "'switches.csv'",
    "run_basin": "sweep, 'store'",
    "run_sweep": "sweep, 'store'",
    "saltation_matrix": "orbit.system.flows[0].c, orbit.system.flows[1].c, (0.0, 0.0, 0.0), 1.0",
    "save_figure": "Figure(), 'x.svg'",  # its own: one whose drawing was cut short stays broken
    "search_orbits": "p",
    "sensitivities": "run, [1.0]",
    "simulate": "p",
    "simulate_many": "[p]",
    "solve_itinerary": "p, itinerary",
    "solve_orbit": "p",
    "switch_by_pulse": "back, forth",
    "tightest": "orbit",
    "tolerances": "'velocity', {'alpha': 0.01}",
    "whole_orbit": "orbit",
    "Axis": "'alpha', ('alpha',), np.array([[1.0]])",
    "Axis.linear": "'alpha', 0.1, 1.0, 2",
    "Axis.log": "'alpha', 0.1, 1.0, 2",
    "Axis.of": "'alpha', [0.1, 1.0]",
    "Axis.of_device": "device, 'P_d', [1.0, 2.0]",
    "Axis.sobol": "{'alpha': (0.1, 1.0)}, 4, 0",
    "Itinerary.of": "[5, 4, 1, 2]",
    "Itinerary.of_motion": "orbit.motion",
    "Itinerary.parse": "'F5 F4 F1 F2'",
    "Parameters": "",
    "PhysicalParameters": "1.0, 3.0, 1.0, 1.0, 0.05, 0.1, 1.0, 1.0, 0.1",
    "Sweep": "(axis,)",
    "branch.at": "'BI1'",
    "device.replace": "",
    "device.scale": "'x_r'",
    "device.tie": "'P_d'",
    "orbit.refined": "",
    "orbit.to_dataframe": "",
    "orbit.value": "'alpha'",
    "p.replace": "",
    "performances.itinerary": "0",
    "run.__call__": "1.0",
    "run.position": "1.0",
    "run.steady": "",
    "run.to_dataframe": "",
    "runs.to_dataframe": "",
    "slopes.by": "'alpha'",
}
_OWN = PUBLIC | {
    "scenes": cs.scenes,
    "cs": cs,
    "Figure": Figure,
    "np": np,
    "math": math,
    "xr": xr,
    "BOX": _BOX,
    "TIMES": _TIMES,
    "branch_record": branch_record,
    "PULSED": _PULSED,
}
_MISTAKES: list[Any] = [
    *(None, True, "x", "0.5", "data.csv", Path("data.csv"), b"x", 10**400, -(10**400), math.nan),
    *(
        -math.inf,
        -1,
        0,
        1.5,
        1j,
        Fraction(1, 2),
        Decimal("0.5"),
        [],
        [1.0],
        [1.0, 2.0],
        (1, 2, 3, 4),
    ),
    *(
        ["x"],
        [None],
        [[1.0], [1.0, 2.0]],
        [True],
        [math.nan] * 3,
        [10**400],
        {},
        {"x": "y"},
        {1: 2},
    ),
    *({"alpha": "x"}, {"alpha": None}, {"alpha": (1.0,)}, {1.0, 2.0}, object(), int, len),
    *(np.array("x"), np.array([1j]), np.array([True]), np.float64(math.nan), np.datetime64("2020")),
    *(pd.DataFrame({"a": ["x"]}), pd.Series([1.0]), pd.Timestamp("2020"), xr.Dataset()),
    *(xr.DataArray(["x"]), cs.results.Status.FINISHED, cs.scenes.slope, cs),
]
_GIVEN = ("p", "device", "run", "runs", "orbit", "itinerary", "branch", "record", "point", "axes")


class _Late(BaseException):
    """Raised in a call that takes its time: its arguments are taken."""


class _Cases(dict[str, Any]):
    """Cases by name, each made on its first use."""

    def __missing__(self, name: str) -> Any:
        self[name] = value = eval(_CASES[name], _OWN, self)
        return value


@cache
def cases() -> _Cases:
    return _Cases()


def called(name: str) -> Any:
    """Function, class or method by its name."""
    first, _, method = name.partition(".")
    return getattr(cases()[first], method) if first in _CASES else eval(name, _OWN)


def wrong_calls(name: str) -> list[tuple[str, tuple[Any, ...], dict[str, Any]]]:
    """Calls with one wrong argument, each with its description."""
    text = f"({_CALLS[name]},)" if _CALLS[name] else "()"
    right = eval(text, _OWN, cases())
    wrong = [*_MISTAKES, *(cases()[one] for one in _GIVEN)]
    made = [("misspelt", right, {"maximum_seconds": 1.0}), ("too many", (*right, *[1.0] * 20), {})]
    made += [("too few", right[:-1], {})] if right else []
    for place, (argument, about) in enumerate(inspect.signature(called(name)).parameters.items()):
        for value in wrong:
            if callable(value) and re.search("Callable|Function|Progress", str(about.annotation)):
                continue  # what it raises is the caller's
            shown = f"{argument} = {type(value).__name__} {value!r:.40}"
            right = eval(text, _OWN, cases())
            if place < len(right):
                made.append((shown, (*right[:place], value, *right[place + 1 :]), {}))
            elif about.kind not in (about.VAR_KEYWORD, about.VAR_POSITIONAL):
                made.append((shown, right, {argument: value}))
    return made


def foreign(name: str, arguments: tuple[Any, ...], named: dict[str, Any]) -> BaseException | None:
    """Exception of a call that is not one of the package's."""

    def late(*_: object) -> None:
        raise _Late

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    found = None
    with contextlib.suppress(_Late):
        try:
            called(name)(*arguments, **named)
        except (CapsuleError, cs.results.Rejected):
            pass
        except Exception as error:
            found = error
        signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)
    return found


@pytest.mark.long
@pytest.mark.parametrize("name", _CALLS)
@pytest.mark.filterwarnings("ignore")
def test_no_mistake_ends_in_a_foreign_exception(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = []
    for what, arguments, named in wrong_calls(name):
        if ALL or zlib.crc32(f"{name} {what}".encode()) % 4 == 0:
            error = foreign(name, arguments, named)
            found += [] if error is None else [f"{what}: {error!r}"]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("name", [name for name in _CALLS if "." not in name and _CALLS[name]])
def test_a_wrong_first_argument_is_refused_at_the_door(name: str) -> None:
    for value in (object(), None, 1j, 10**400):
        if not (value is None and name == "figure_style"):
            with pytest.raises((CapsuleError, cs.results.Rejected)) as refused:
                called(name)(value, *[1.0] * 9)
            assert "\n" not in str(refused.value)


def test_every_public_function_is_tried() -> None:
    made = [name for name, one in PUBLIC.items() if inspect.isfunction(one)]
    assert set(made) <= set(_CALLS)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ("continue_orbit(p, 'alpha', 1.0)", "orbit = .*an Orbit, as solve_orbit"),
        ("performance(run)", "orbit = <Trajectory.*an Orbit, as solve_orbit"),
        ("fit('data.csv', p, ['zeta'])", "data = 'data.csv'.*as read_measured"),
        (
            "fit({'t': [0.0], 'x_r': [0.0]}, p, 'alpha')",
            "unknown = 'alpha': must be a list of t",
        ),
        ("run_sweep('sweep.toml', 'store')", "sweep = .*a Sweep, as read_plan"),
        ("simulate(p, periods='x')", "periods = 'x': must be a whole number"),
        ("simulate(p, phase=10**400)", "phase = .*must be a number"),
        ("simulate(p, period=1)", "argument of simulate = 'period'.*did you mean periods"),
        ("simulate()", "missing a required argument: 'parameters'"),
        ("solve_orbit(p, [0, 0])", "state = .*three numbers"),
        ("Parameters(alfa=1)", "argument of Parameters = 'alfa'.*did you mean alpha"),
        ("scenes.load('slop')", "did you mean slope"),
        ("optimise('velocty', {'alpha': (0.1, 0.2)})", "did you mean velocity"),
        ("optimise('velocity', {'P_d': (1.0, 2.0)})", "P_d is a quantity of a device, and none is"),
        ("optimise('velocity', {'alpha': (0.1, 1.0)}, device)", "dimensionless, and a device is"),
        ("plot_motion(run, width=math.nan)", "width = nan: must be a number"),
        ("plot_motion(run, width=-1)", "width = -1: must be a number of inches"),
        (
            "fit(data, p, ['zeta'], bounds={'zeta': (1.0,)})",
            r"bounds of zeta = \(1.0,\): must be two ascending finite numbers",
        ),
        (
            "fit(data, p, ['zeta'], bounds={'zeta': (0, math.inf)})",
            "ascending finite .* from 0 on",
        ),
        ("continue_both_ways(orbit, 'alpha', (0.1, math.nan))", "ends = .*two ascending finite"),
        ("performance(none)", "orbit = <NoOrbit .*an Orbit, as solve_orbit"),
        ("half_orbit(none)", "orbit = <NoOrbit .*an Orbit, as solve_orbit"),
        ("continue_both_ways(none, 'alpha', 0.1, 0.9)", "orbit = <NoOrbit .*an Orbit, as solve"),
        ("continue_orbit(none, 'alpha', 0.9)", "orbit = <NoOrbit .*an Orbit, as solve_orbit"),
        (
            "certify_orbit(cs.solve_orbit(cs.scenes.slope.Parameters()))",
            "scene = 'slope': must be capsule",
        ),
        ("attractors(p, {'x_r': (0, 1)}, phases=3.0)", "phases = 3.0: must be 0 for a box"),
        (
            "solve_itinerary((0.7, 0.8), Itinerary.parse('F2'), [0.0] * 5)",
            "values of alpha, omega",
        ),
        ("simulate_many(p)", "must be a list of Parameters"),
    ],
)
def test_a_mistake_is_named_with_what_was_expected(call: str, words: str) -> None:
    with pytest.raises(cs.InvalidInput, match=words):
        eval(call, _OWN, cases())


@pytest.mark.parametrize(
    "call",
    [
        *("attractors(p, BOX, count=16)", "attractors(p, [(1e-200, 0, 1e-300)])"),
        "simulate_many([p, p], [(0, 0, 0), (1e-300, 0, 1e-300)])",
        "continue_attractors(p, 'alpha', [0.0, 0.6, 0.7], BOX, count=4)",
        "tolerances(['velocity', 'peak_force'], {'alpha': 0.5, 'gamma': 0.9}, p, samples=64)",
        "optimise('speed_per_work', {'alpha': (0.5, 0.6)}, p, samples=16)",
        "pareto('velocity', 'work', {'alpha': (0.5, 0.6)}, p, points=3, max_seconds=0.2)",
        "fit(data, p.replace(zeta=0.06), ['zeta'])",
        "fit({'t': TIMES, 'x_r': 1e-49 * np.cos(TIMES)}, p, ['alpha'])",
        "fit({'t': TIMES, 'x_r': 1e49 * np.cos(TIMES)}, p, ['alpha'])",
        "run_sweep(Sweep((axis,), compute=('lyapunov', 'energies', 'multipliers')), 'store')",
        "run_basin(Sweep((Axis.linear('x_r', -1.0, 1.0, 3),)), 'store')",
        "continue_orbit(orbit, 'alpha', 0.4, points=5)",
        "continue_bifurcation(point, 'zeta', ((0.1, 2.0), (0.01, 0.1)), points=3)",
        *("certify_orbit(orbit)", "certify_bifurcation(point)", "certify_run(run)"),
        *("search_orbits(p, 2)", "performance(orbit)", "sensitivities(run, [1.0])"),
        "performance_many([[*p.to_dict().values()]] * 2, [(0, 0, 0), (1e15, 1e15, 0)])",
    ],
)
def test_no_setting_of_numpy_ends_a_call(call: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with np.errstate(all="raise"):
        eval(call, _OWN, cases())


@pytest.mark.parametrize(
    ("count", "said"), [(0, "0 points"), (1, "1 point"), (2, "2 points"), (1234, "1,234 points")]
)
def test_numbers_of_things_have_their_plural(count: int, said: str) -> None:
    assert counted(count, "point") == said


def test_results_show_in_a_line_what_is_asked_first() -> None:
    shown = {name: repr(cases()[name]) for name in ("run", "runs", "orbit", "branch", "point")}
    assert shown["orbit"].startswith(
        "<Orbit: F5 F4 F1 F2, period number 1, stable, progression 0.41"
    )
    assert shown["branch"] == "<Branch in alpha from 0.7 to 0.4: 21 points, 1 bifurcation, reached>"
    assert shown["point"] == "<Bifurcation BI1: alpha = 0.524593243, F5 F4 F1 F2 to F5 F4 F5 F2>"
    own = filter(inspect.isclass, PUBLIC.values())
    dumps = {"Parameters", "PhysicalParameters"}
    for kind in own:  # no class with arrays or orbits among its fields shows them all
        if kind.__name__ not in dumps and hasattr(kind, "__dataclass_fields__"):
            assert not kind.__repr__.__qualname__.startswith("__create_fn__"), kind
    assert max(map(len, shown.values())) < 80


def test_runs_are_a_table() -> None:
    table = cases()["runs"].to_dataframe()
    assert len(table) == 2
    assert list(table.columns[-6:]) == ["x_r", "v_r", "v_c", "advance", "periods", "status"]
    assert table.x_r[0] == pytest.approx(cases()["run"].final[1][0], rel=1e-14)


def test_an_orbit_says_whether_it_is_stable() -> None:
    assert cases()["orbit"].stable is True
    beyond = cs.continue_orbit(cases()["orbit"], "beta", 60.0, points=5)
    stable = [point.orbit.stable for point in beyond.points]
    assert stable == [bool(abs(point.multipliers[0]) < 1) for point in beyond.points]
    assert not all(stable)


def test_items_of_an_array_are_not_copied_for_its_kind(monkeypatch) -> None:
    # A list of 10^8 values would take 3 GB and a minute in which Ctrl-C waits.
    items, of = capsule_sym._arguments._items, []

    def listed(value):
        of.append(type(value))
        return items(value)

    monkeypatch.setattr(capsule_sym._arguments, "_items", listed)
    assert len(cs.inputs.Axis("alpha", ("alpha",), np.array([[0.1], [0.2]]))) == 2
    assert of
    assert np.ndarray not in of
