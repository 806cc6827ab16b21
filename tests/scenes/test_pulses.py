"""A drive of pulses in C beside the integrator: runs with their edges, orbits with derivatives."""

from __future__ import annotations

import math
import random
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.native import LIBRARY
from tests.scenes import Form, Integrator, Run, Start, grouped, integrator, random_starts
from tests.scenes.library import SANITIZED, Library, library, printed

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

FORM = Form(pulsed=True, biased=True)
PERIODS = 4
ORBITS = Path(__file__).with_name("orbits.c")
DOUBLE, WIDE = 1, 2
CORNER = 2  # a capsule_outcome


@pytest.fixture(scope="module")
def pulsed(tmp_path_factory: pytest.TempPathFactory) -> Library:
    return library("pulsed", tmp_path_factory.mktemp("pulsed"), *SANITIZED)


@pytest.fixture(scope="module")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Integrator:
    return integrator(tmp_path_factory.mktemp("judge"))


def varied(count: int) -> list[Start]:
    """Random starts, fifty after the other of one linear flow; of every other one the pulses are
    very short or long, or of levels that are equal or opposite."""
    r, starts = random.Random(30), grouped(random_starts(FORM, count), 50)
    for i, start in enumerate(starts):
        given = start.parameters
        if i % 2:
            short = r.choice([1e-6, 10 ** r.uniform(-6, -1)])
            given["D"] = r.choice([short, 1 - short])
            given["alpha_low"] = r.choice([1, -1, given["alpha_low"]]) * given["alpha"]
    return starts


@pytest.fixture(scope="module")
def judged(judge: Integrator) -> tuple[list[Start], list[Run]]:
    starts = varied(1000)
    runs = judge.runs(FORM, starts, PERIODS)
    assert {run.status for run in runs} == {"done"}
    return starts, runs


@pytest.mark.parametrize(
    ("precision", "lanes", "most"), [(0, 0, 10), (2, 0, 2), (0, 4, 10), (0, 8, 10)]
)
def test_runs_are_those_of_the_integrator(
    precision: int, lanes: int, most: float, pulsed: Library, judged: tuple[list[Start], list[Run]]
) -> None:
    """Every field passed, edges among their ends, and final states to a few roundings."""
    starts, runs = judged
    ends = pulsed.many(starts, lanes) if lanes else pulsed.runs(starts, precision=precision)
    for end, run in zip(ends, runs, strict=True):
        assert end.stop == "done"
        assert lanes or end.fields == run.fields
        assert run.off(end.state) < most


def beside_edges(judge: Integrator, count: int) -> list[Start]:
    """Starts from which the fall meets a switch within a few roundings of the share."""
    r, found = random.Random(31), []
    starts = [start for start in random_starts(FORM, count) if start.phase == 0.0]
    longer = [Start({**s.parameters, "D": 1 - 1e-9}, s.state) for s in starts]
    for start, run in zip(longer, judge.runs(FORM, longer, 1, checked=False), strict=True):
        ends = np.cumsum([float(one.duration) for one in run.segments])
        passed = [t for t, one in zip(ends, run.segments, strict=True) if one.event not in "RDE"]
        for time in passed:
            share = start.parameters["omega"] * time / (2 * math.pi)
            share *= 1 + r.choice([0, 1e-16, 1e-15, 1e-14, 1e-13]) * r.uniform(-4, 4)
            if 0 < share < 1:
                found.append(Start({**start.parameters, "D": share}, start.state))
    return found


def test_edges_beside_switches_are_in_their_order(pulsed: Library, judge: Integrator) -> None:
    """Decisions by doubles are right; 106 bits decide the corners that doubles cannot.

    A few stay open, where the edge comes within a rounding after a slip has begun.
    """
    starts = beside_edges(judge, 200)
    runs = judge.runs(FORM, starts, 1, checked=False)
    alone, wide = (pulsed.runs(starts, 1, precision=digits) for digits in (DOUBLE, WIDE))
    for one, other, run in zip(alone, wide, runs, strict=True):
        assert run.status == "done"
        assert one.stop == "open" or one.fields == run.fields
        assert other.stop == "open" or other.fields == run.fields
    assert sum(one.outcome == CORNER for one in alone if one.stop == "open") > len(starts) / 2
    assert sum(one.stop == "open" for one in wide) < len(starts) / 50


_GRAZE = {
    **{"alpha": 0.27816855360267984, "alpha_low": 0.27816855360267984},
    **{"omega": 3.5476470466002863, "D": 0.00039193655817916495, "delta": 0.004422052516724615},
    **{"zeta": 1.9738230793479639, "beta": 13.656262710801034, "gamma": 0.4643834192737085},
    **{"s": 0.1616125928345832, "f_plus": 0.807826402213583, "f_minus": 80.7826402213583},
}
_SLOW = {
    **{"alpha": 0.08841918377210436, "alpha_low": 0.08841918377210436},
    **{"omega": 9.751208382046174, "D": 0.246501748712606, "delta": 0.7765769113192902},
    **{"zeta": 0.008178905459410583, "beta": 165.3011392001688, "gamma": 1.3156357703056694},
    **{"s": 0.0, "f_plus": 1.9347387537028216, "f_minus": 3.974518317662491},
}
DIPS = [
    Start(
        _GRAZE,
        (0.004422055166461264, -9.882785931921581e-05, 1.2689450716200772),
        6.031247968062638e-4,
    ),
    Start(_SLOW, (-3.919156097415805, -0.6906268307242979, -0.0014872844831682053)),
]
"""Starts from which a guard crosses zero and comes back shortly before an edge: a contact that is
left for 1.5e-7, and a capsule that stops 2.8e-4 before it moves on."""


def test_a_switch_shortly_before_an_edge_is_not_passed_over(
    pulsed: Library, judge: Integrator
) -> None:
    runs = judge.runs(FORM, DIPS, 1, checked=False)
    for end, run in zip(pulsed.runs(DIPS, 1, precision=DOUBLE), runs, strict=True):
        assert end.stop == "open" or end.fields == run.fields


TERMS = {
    "error of the switch": ("off = f->error + error;", "off = error;"),
    "error of the edge": ("off = f->error + error;", "off = f->error;"),
    "error of the angle": ("8.0 * UNIT * TWO_PI", "0.0 * UNIT * TWO_PI"),
    "value at the edge": (
        "gt(near_to(value), near_zero)",
        "gt(near_to(value), all(-1e300))",
    ),
    "end of what is proved of a guard": ("lt(at + error, g->to) &\n                        ", ""),
}
"""Terms of the proof that an edge comes first, in step.h, and what is in the place of each."""


@pytest.mark.parametrize("name", TERMS)
def test_a_term_left_out_is_noticed(
    name: str, pulsed: Library, judge: Integrator, tmp_path: Path
) -> None:
    """Doubles then decide some of these runs wrongly."""
    old, new = TERMS[name]
    source = tmp_path / "weaker"
    shutil.copytree(LIBRARY, source)
    text = (source / "step.h").read_text(encoding="utf-8")
    assert text.count(old) == 1
    (source / "step.h").write_text(text.replace(old, new), encoding="utf-8")
    shutil.copytree(pulsed.program.with_name("generated"), tmp_path / "generated")
    changed = library("pulsed", tmp_path, "-O1", "-w", source=source)
    starts = [*beside_edges(judge, 400), *DIPS]
    runs = judge.runs(FORM, starts, 1, checked=False)
    ends = changed.runs(starts, 1, precision=DOUBLE)
    assert any(
        end.stop == "done" and end.fields != run.fields for end, run in zip(ends, runs, strict=True)
    )


STEP = 2.0**-16


def test_orbits_and_what_they_depend_on_are_those_of_the_integrator(
    pulsed: Library, judge: Integrator
) -> None:
    """Derivatives by share, levels and frequency among them, against differences of fourth order.

    The itinerary's own equations, of which edges are some, come to the same multipliers.
    """
    starts = [s for s in random_starts(FORM, 200, 7) if s.parameters["zeta"] > 0]
    rows = [pulsed.row(start) for start in starts]
    names, orbits = pulsed.parameters, printed(pulsed.linked(ORBITS), rows, 1)
    m, compared = len(names), 0
    for row, (fit, *texts) in zip(rows, orbits, strict=True):
        if not int(fit):
            continue
        places = np.cumsum([3, 9, 3 * m, 1, m])
        state, by, moved, (advance,), gradient, rest = np.split(np.array(texts, float), places)
        at = np.array([*row[:m], *state])
        steps = [k * STEP * e for e in np.eye(len(at)) for k in (-2, -1, 1, 2)]
        beside = [at, *(at + step for step in steps)]
        if any(not 0 < one[names.index("D")] < 1 for one in beside):
            continue
        starts = [Start(dict(zip(names, p, strict=False)), tuple(p[m:])) for p in beside]
        runs = judge.runs(FORM, starts, 1, checked=False)
        if len({run.fields for run in runs}) > 1:
            continue
        compared += 1
        middle = runs[0].state
        away = [[float(a - b) for a, b in zip(run.state, middle, strict=True)] for run in runs]
        four = np.array(away[1:]).reshape(len(at), 4, 4)
        slopes = (four[:, 0] - 8 * four[:, 1] + 8 * four[:, 2] - four[:, 3]).T / (12 * STEP)
        follows = np.linalg.solve(np.eye(3) - slopes[:3, m:], slopes[:3, :m])
        residual, trace, determinant = rest
        assert residual < 1e-12
        assert apart(state, np.array(middle[:3], float)) < 1e-13
        assert abs(advance - float(middle[3])) < 1e-12
        assert apart(by.reshape(3, 3), slopes[:3, m:]) < 1e-9
        assert apart(moved.reshape(3, m), follows) < 1e-7
        assert apart(gradient, slopes[3, :m] + slopes[3, m:] @ follows) < 1e-7
        assert abs(trace - np.trace(slopes[:3, m:])) < 1e-9
        assert abs(determinant - np.linalg.det(slopes[:3, m:])) < 1e-9
    assert compared >= 15


def apart(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.max(np.abs(first - second)) / (1 + np.max(np.abs(second))))
