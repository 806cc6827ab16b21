"""Runs of the scenes by every backend, against each other and an integrator of its own."""

import math
import pickle
import re
import shutil
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from capsule_sym import InvalidInput, Parameters, orbits, results, scenes, simulate, simulate_many
from capsule_sym._map.backend import default_backend, how_compiled
from capsule_sym._native import core_of
from capsule_sym.scenes import Scene
from tests.sampling import many, sampled
from tests.scenes import SCENES, Form, Integrator, Start, random_starts

PERIODS = 4
MOST_UNITS = 4096
"""Error of a final state, in units of what rounding each segment's end comes to."""
BACKENDS = sorted({default_backend(), "numpy", "mpmath"})
compiled = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")


def simulated(scene: Scene, start: Start, backend: str) -> results.Trajectory:
    p = scene.Parameters(**start.parameters)
    return simulate(p, start.state, start.phase, PERIODS, backend=backend)


def agree(scene: Scene, form: Form, judge: Integrator, backend: str, starts: list[Start]) -> None:
    """Asserts that runs have the integrator's itineraries and final states."""
    decided = 0
    for start, expected in zip(starts, judge.runs(form, starts, PERIODS), strict=True):
        if expected.status != "done":
            continue
        run = simulated(scene, start, backend)
        assert run.success, (start, run)
        assert tuple(s.field for s in run.segments) == expected.fields, start
        assert expected.off([*map(float, run.final[1]), float(run.advance)]) < MOST_UNITS, (
            start,
            run,
        )
        decided += 1
    assert decided > 0.9 * len(starts)


@compiled
@sampled
@pytest.mark.parametrize("name", [name for name in SCENES if name != "capsule"])
@pytest.mark.parametrize(
    ("backend", "count"), [("c", many(1000, 12)), ("numpy", many(300, 4)), ("mpmath", many(30, 1))]
)
def test_runs_of_a_scene_are_those_of_an_integrator(judge, name, backend, count) -> None:
    scene, form = scenes.load(name), SCENES[name]
    if backend == "c" and core_of(scene) is None:
        pytest.skip("no compiled core here")
    agree(scene, form, judge, backend, random_starts(form, count))


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("later", [0.0, 2e-15, -2e-15, 1e-12, -1e-12])
def test_a_switch_beside_an_edge_is_told_from_it(backend: str, later: float) -> None:
    # Without drive x_r = cos(tau) leaves the stop in front after a sixth of a period.
    scene = scenes.prototype
    free = {"alpha": 0.0, "alpha_low": 0.0, "zeta": 0.0, "omega": 1.0, "s": 0.0}
    p = scene.Parameters(
        **(scene.facts.DEFAULTS | free | {"delta_1": 0.5, "delta_2": 5.0, "beta_1": 0.0})
    ).replace(D=1 / 6 + later, f_plus=3.0, f_minus=3.0)
    run = simulate(p, (1.0, 0.0, 0.0), 0.0, 1, backend=backend)
    first, second = run.segments[:2]
    assert (first.field, run.segments[2].field) == (5, 11)
    fall = Fraction(p.D) - Fraction(1, 6)
    assert second.field == (2 if fall > 0 else 14)
    assert {first.target, second.target} == {"Σ28", f"Σ{second.field if fall > 0 else 11}"}
    assert abs(float(second.duration) - math.tau * float(abs(fall))) < 1e-15


@pytest.mark.parametrize("backend", BACKENDS)
def test_edges_end_segments_at_their_own_times(backend: str) -> None:
    scene = scenes.reaction_pulse
    level = scene.Parameters(alpha=0.5, alpha_low=0.5, D=0.3, omega=1.0)
    run = simulate(level, periods=3, backend=backend)
    assert [s.target for s in run.segments[1:]] == ["Σ18", "Σ17"] * 3
    ends = [(s.end.period, float(s.end.phase)) for s in run.segments[1:]]
    assert ends == [(k + r, 0.0 if r else 0.3 * math.tau) for k in range(3) for r in (0, 1)]
    assert list(run.stroboscopic_periods) == [0, 1, 2, 3]
    # A push on the capsule above its friction breaks its rest.
    strong = level.replace(alpha=3.0, alpha_low=0.0, D=0.5)
    run = simulate(strong, phase=4.0, periods=1, backend=backend)
    assert [s.field for s in run.segments] == [8]
    run = simulate(strong, phase=4.0, periods=2, backend=backend)
    assert [s.field for s in run.segments[:2]] == [8, 3]


def test_what_is_made_of_a_run_is_the_scenes() -> None:
    p = scenes.slope.Parameters(s=0.05)
    run = simulate(p, (0.1, 0.2, 0.3), 0.4, 60)
    reference = simulate(p, (0.1, 0.2, 0.3), 0.4, 1, backend="numpy")
    assert [s.mode for s in run.segments[:4]] == ["C-FD", "NC-FD", "NC-S", "NC-BD"]
    assert np.allclose(run([3.0, 1.0]), reference([3.0, 1.0]), rtol=0, atol=1e-14)
    motion = run.steady()
    assert motion is not None
    for result in (run, motion):
        again = pickle.loads(pickle.dumps(result))
        assert again.segments == result.segments
        assert again.segments[0].scene is scenes.slope


def test_many_runs_of_a_scene_are_its_single_ones() -> None:
    given = [scenes.slope.Parameters(s=s) for s in (-0.1, 0.0, 0.1)]
    rows = np.array([[*p.to_dict().values()] for p in given])
    alone = [simulate(p, periods=9) for p in given]
    for together in (
        simulate_many(given, periods=9),
        simulate_many(rows, periods=9, scene=scenes.slope),
    ):
        assert np.allclose(together.states, [run.final[1] for run in alone], rtol=0, atol=1e-13)
    kept = simulate_many(given, periods=9, keep="stroboscopic")
    for i, run in enumerate(alone):
        assert np.allclose(kept[i], run.stroboscopic, rtol=0, atol=1e-13)
    assert pickle.loads(pickle.dumps(kept)).scene is scenes.slope


def test_parameters_of_two_scenes_are_refused_together() -> None:
    with pytest.raises(InvalidInput, match=r"^parameters = .*: must be of one scene, here slope"):
        simulate_many([scenes.slope.Parameters(), Parameters()])
    with pytest.raises(InvalidInput, match=r"^parameters = .*: must be of one scene, here reac"):
        simulate_many([scenes.slope.Parameters()], scene=scenes.reaction)
    for named in (scenes.slope, "slope"):
        with pytest.raises(InvalidInput, match=r"shape \(n, 9\)"):
            simulate_many(np.ones((2, 7)), scene=named)
    with pytest.raises(InvalidInput, match=r"^itinerary = 'F19 F2': must be an Itinerary"):
        orbits.solve_itinerary(scenes.prototype.Parameters(), "F19 F2")


@pytest.mark.skipif(core_of(scenes.slope) is None, reason="the C core was not compiled")
def test_a_stop_that_is_met_by_less_than_a_rounding_of_the_bias_is_met() -> None:
    """The mass swings about -s: its free part is as uncertain as s, and rises to 5e-16 above 0."""
    p = scenes.slope.Parameters(
        alpha=0,
        omega=3,
        delta=0,
        zeta=0,
        beta=10,
        gamma=1,
        s=5.7113626778970135,
        f_plus=20,
        f_minus=20,
    )
    start = (-2.246888735248697e-15, 1.7856775730217245e-07, 0.0)
    run, exact = (simulate(p, start, periods=2, backend=name) for name in ("c", "mpmath"))
    assert [s.field for s in run.segments] == [s.field for s in exact.segments]
    assert 5 in [s.field for s in run.segments]


@pytest.mark.skipif(core_of(scenes.slope) is None, reason="the C core was not compiled")
@pytest.mark.long
def test_both_gaps_are_known_after_an_edge_that_ends_a_long_segment() -> None:
    """Of 2,244 expansions; the next swing meets the stop behind by 1.4e-13, after 0.0335166."""
    p = scenes.prototype.Parameters(
        alpha=0.1, D=0.5, omega=0.00085683, delta_1=5, delta_2=4.1012451348375745, zeta=0, beta_1=3,
        beta_2=3, gamma=1, f_plus=9, f_minus=9,
    )  # fmt: skip
    run = simulate(p, (4.3, 0.1, 0.0), phase=0.3, periods=1, max_segments=2)
    assert run.segments[0].target == "Σ28"
    assert run.segments[1].duration == pytest.approx(0.0335166, abs=1e-7)


def test_a_copied_scene_is_told_from_the_one_that_ships(tmp_path: Path) -> None:
    """Its folder stands in messages; without a core they say what compiles one."""
    copied = tmp_path / "copy"
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(scenes.slope.facts.__file__).parent, copied, ignore=ignored)
    own = scenes.load(str(copied))
    assert scenes.load(copied) is own
    with pytest.raises(InvalidInput, match=r"must be of one scene, here slope$"):
        simulate_many([own.Parameters()], scene="slope")
    folder = re.escape(str(copied))
    with pytest.raises(InvalidInput, match=f"must be of one scene, here slope in {folder}$"):
        simulate_many([scenes.slope.Parameters()], scene=own)
    assert how_compiled(own).endswith(f"codegen --scene FILE --out {copied} --core")
