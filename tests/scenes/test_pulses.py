"""Edges of pulses in C beside the integrator: their order with switches beside them."""

import math
import random
import shutil

import numpy as np
import pytest

from tests.native import LIBRARY
from tests.scenes import Form, Integrator, Start, random_starts
from tests.scenes.library import SANITIZED, Library, library

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

FORM = Form(pulsed=True, biased=True)
DOUBLE, WIDE = 1, 2
CORNER = 2  # a capsule_outcome


@pytest.fixture(scope="module")
def pulsed(tmp_path_factory: pytest.TempPathFactory) -> Library:
    return library("pulsed", tmp_path_factory.mktemp("pulsed"), *SANITIZED)


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


def test_a_switch_shortly_before_an_edge_is_not_passed_over(pulsed, judge) -> None:
    runs = judge.runs(FORM, DIPS, 1, checked=False)
    for end, run in zip(pulsed.runs(DIPS, 1, precision=DOUBLE), runs, strict=True):
        assert end.stop == "open" or end.fields == run.fields


TERMS = {
    "error of the switch": ("off = f->error + error;", "off = error;"),
    "error of the edge": ("off = f->error + error;", "off = f->error;"),
    "error of the angle": ("8.0 * UNIT * TWO_PI", "0.0 * UNIT * TWO_PI"),
    "value at the edge": ("gt(near_to(value), near_zero)", "gt(near_to(value), all(-1e300))"),
    "end of what is proved of a guard": ("lt(at + error, g->to) &\n                        ", ""),
}
"""Terms of the proof that an edge comes first, in step.h, and what is in the place of each."""


@pytest.mark.parametrize("name", TERMS)
def test_a_term_left_out_is_noticed(name, pulsed, judge, tmp_path) -> None:
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
