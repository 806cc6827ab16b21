"""States at times, at the ends of periods and of steady motions, beside the integrator."""

import math
import shutil
from random import Random

import pytest

from capsule_sym import results, scenes, simulate
from capsule_sym._native import core_of
from tests.scenes import SCENES, Form, Integrator, Run, Start, random_starts

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

PERIODS = 4
WITHIN = 16
"""Units of a run's rounding errors; a time in a run is itself rounded to a few of its own."""


@pytest.fixture(scope="module", params=SCENES)
def form(request: pytest.FixtureRequest) -> Form:
    if core_of(scenes.load(request.param)) is None:
        pytest.skip("no compiled core here")
    return SCENES[request.param]


def runs(form: Form, starts: list[Start], periods: int) -> list[results.Trajectory]:
    (name,) = (name for name, known in SCENES.items() if known == form)
    of = scenes.load(name).Parameters
    return [simulate(of(**s.parameters), s.state, s.phase, periods) for s in starts]


@pytest.fixture(scope="module")
def judged(form: Form, judge: Integrator) -> list[tuple[Start, results.Trajectory, Run]]:
    """Runs that the integrator decides."""
    starts = random_starts(form, 30, 5)
    made, expected = runs(form, starts, PERIODS), judge.runs(form, starts, PERIODS)
    found = [one for one in zip(starts, made, expected, strict=True) if one[2].status == "done"]
    assert len(found) > 25
    return found


def test_states_at_times_lead_where_the_run_does(form, judge, judged) -> None:
    """From a state at a time the integrator comes to the run's end, and on the way moves as far."""
    random = Random(6)
    for start, run, expected in judged:
        period = run.parameters.period
        times = [random.uniform(start.phase, PERIODS * period) for _ in range(8)]
        states = run(times, position=True).tolist()
        for t, (*state, x_c) in zip(times, states, strict=True):
            passed = int(t // period)
            later = start._replace(state=tuple(state), phase=math.fmod(t, period))
            (rest,) = judge.runs(form, [later], PERIODS - passed, checked=False)
            assert rest.status == "done"
            end = [*map(float, rest.state[:3]), float(rest.state[3]) + x_c]
            assert expected.off(end) < WITHIN, (start, t)
            assert expected.fields[-len(rest.fields) :] == rest.fields, (start, t)


def test_states_at_the_ends_of_periods_are_the_integrator_s(form, judge, judged) -> None:
    starts, made, _ = zip(*judged, strict=True)
    for k in range(1, PERIODS + 1):
        for run, expected in zip(made, judge.runs(form, starts, k), strict=True):
            places = run.stroboscopic_periods.tolist()
            assert expected.off(run.stroboscopic[places.index(k)].tolist()) < WITHIN


def test_steady_motions_are_the_integrator_s(form: Form, judge: Integrator) -> None:
    """They repeat after their period number and not before, and advance as they say."""
    starts = [s for s in random_starts(form, 60, 7) if s.parameters["zeta"] >= 0.05]
    compared = 0
    for start, run in zip(starts, runs(form, starts, 800), strict=True):
        if (motion := run.steady()) is None:
            continue
        later = start._replace(state=tuple(map(float, run.final[1][:3])), phase=0.0)
        ends = [
            judge.runs(form, [later], k, checked=False)[0].state
            for k in range(1, motion.period_number + 1)
        ]
        *before, last = ([*map(float, end)] for end in ends)
        size = 1 + max(map(abs, later.state))
        away = [max(abs(a - b) for a, b in zip(end, later.state, strict=False)) for end in before]
        assert max(abs(a - b) for a, b in zip(last, later.state, strict=False)) < 1e-8 * size
        assert not away or min(away) > 1e-7
        assert abs(last[3] / motion.period_number - motion.progression) < 1e-8 * size
        compared += 1
    assert compared >= 15
