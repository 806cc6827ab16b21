"""The integrator of 113 bits beside one of 50 digits, which states the equations once more."""

from __future__ import annotations

import shutil
from random import Random

import pytest
from mpmath import mp, mpf

from benchmarks.experiments.scene_starts import hard_start
from benchmarks.tests.experiments.digits import Motion
from tests.sampling import many, sampled, some
from tests.scenes import SCENES, Form, Integrator, Start, random_starts

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")

FORMS = {**SCENES, "all terms": Form(stops=2, pulsed=True, reacts=True, biased=True)}


def compare(judge: Integrator, form: Form, starts: list[Start], periods: int, most: int) -> None:
    """Itineraries and events are equal, states and durations to some 28 digits of conditioning."""
    for start, run in zip(starts, judge.runs(form, starts, periods, most), strict=True):
        motion = Motion(form, start)
        pieces = motion.go(periods, most)
        assert run.status in {"done", "most"}
        assert [(s.field, s.event) for s in run.segments] == [p[:2] for p in pieces]
        with mp.workdps(40):
            for a, b, unit in zip(run.state, motion.state, run.unit, strict=True):
                exact = mpf(a.numerator) / a.denominator
                assert abs(exact - b) < 1e-28 * unit
            first, true = run.segments[0], pieces[0].duration
            slow = first.size / abs(first.rate) if first.rate else 0
            exact = mpf(first.duration.numerator) / first.duration.denominator
            assert abs(exact - true) < 1e-28 * (1 + slow)


@sampled
@pytest.mark.parametrize("name", some(FORMS, 2))
def test_runs_agree_with_50_digits(name: str, judge: Integrator) -> None:
    starts = random_starts(FORMS[name], many(20, 1), seed=50)
    compare(judge, FORMS[name], starts, 2, 1000)


@sampled
@pytest.mark.parametrize("name", some(FORMS, 2))
def test_hard_starts_agree_with_50_digits(name: str, judge: Integrator) -> None:
    random = Random(f"50 {name}")
    starts = [hard_start(FORMS[name], random).start for _ in range(many(200, 4))]
    compare(judge, FORMS[name], starts, 2, 1)
