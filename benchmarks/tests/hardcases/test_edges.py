"""Starts at the edge of what double precision decides, by every width and in 106 bits, and the core
with one of its bounds gone.

Decisions of the core there must be those of 50 digits, which decide the rest.
"""

from __future__ import annotations

import ctypes
import math
import shutil
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import NamedTuple

import pytest

from benchmarks.hardcases.reference import Start
from benchmarks.hardcases.starts import RandomStart, random_start
from capsule_sym import Parameters, simulate
from capsule_sym.results import Outcome
from tests.native import built
from tests.native.mutants import KILLED

SURE = (Outcome.REGULAR, Outcome.NEVER, Outcome.END)
COUNT, CANCELLING, CLOSEST = 1500, 100, 3e-16

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

SHIM = """
#include <math.h>
#include <string.h>
#include "batch.h"
#include "number.h"
#define GIVEN(name) [RUN_##name] = c->name,
static int alone(const double *p, const double *state, double phase, int periods, int precision,
                 int *field, int *plane)
{
    static capsule_map map;
    capsule_event event = {0};
    const capsule_request request = {.events = &event, .room = 1, .precision = precision};
    capsule_outcome open;
    size_t written;
    capsule_map_make((const capsule_parameters *)p, &map);
    capsule_state at = capsule_state_at(&map, state[0], state[1], state[2], phase);
    const int stop = capsule_run(&map, &at, periods, &request, &written, &open);
    *field = event.field;
    *plane = event.plane;
    return stop == CAPSULE_OPEN && !written ? -1 : (int)written;
}
/* The same by lanes, with other motions of the same flow in all but one of them; -2 where a batch
   leaves the start to the scalar code. */
static int beside(int lanes, int lane, const double *p, const double *state, double phase,
                  int periods, int *field, int *plane, double *numbers)
{
    enum { RUNS = 8 };
    static capsule_map map;
    double number[RUNS][CAPSULE_RUN_NUMBERS], *runs[RUNS];
    capsule_map_make((const capsule_parameters *)p, &map);
    const capsule_state at = capsule_state_at(&map, state[0], state[1], state[2], phase);
    int from = at.v_c == 0.0 ? at.field : capsule_code_here(0)->field_at(&map, &at);
    if (!from || (at.gap == 0.0 && at.v_r == 0.0) || map.may_rest)
        return -2;
    const capsule_constants *c = &map.field[from - 1];
    for (int l = 0; l < RUNS; l++) {
        const double off = l == lane ? 0.0 : 0.01 * (l + 1), cosine = cos(at.angle),
                     sine = sin(at.angle), x_r = at.x_r - off * (c->contact ? -1.0 : 1.0);
        const double v_c = at.v_c + off * c->drift;
        const double numbers[CAPSULE_RUN_NUMBERS] = {
            [X_R] = x_r, [FAR] = l == lane ? at.gap : x_r - c->delta, [V_R] = at.v_r, [V_C] = v_c,
            [MARGIN] = margin_at(c, x_r, l == lane ? at.gap : x_r - c->delta, at.v_r, cosine),
            [ANGLE] = at.angle, [ANGLE_REST] = at.angle_rest,
            [COSINE] = cosine - at.angle_rest * sine, [SINE] = sine + at.angle_rest * cosine,
            [WAY] = c->drift, [GAP_ZEROS] = l == lane && at.gap == 0.0,
            [SECOND_ZEROS] = c->drift != 0.0 && v_c == 0.0,
            CAPSULE_RUN_PARAMETERS(GIVEN)};
        memcpy(number[l], numbers, sizeof numbers);
        runs[l] = number[l];
    }
    capsule_lane_step *step = lanes == 8 ? capsule_step_8 : capsule_step_4;
    const capsule_table *t = &map.table[2 * (c->contact != 0.0) + (c->drift != 0.0)];
    for (int turn = 0, level = 0, steps = 0; steps < 200; steps++) {
        capsule_outcomes out;
        memset(&out, 0, sizeof out);
        step(c, t, level, 0, 1, runs, &out);
        if (out.open >> lane & 1) {
            if (++level == CAPSULE_LEVELS)
                return -1;
            continue;
        }
        if (out.undetermined >> lane & 1)
            return -1;
        if (out.passed >> lane & 1 && ++turn == periods)
            return *field = *plane = 0;
        if (out.crossing >> lane & 1) {
            const double *n = number[lane];
            const int contact = out.contact >> lane & 1, way = (int)n[WAY];
            memcpy(numbers, n, CAPSULE_RUN_NUMBERS * sizeof *n);
            *field = from;
            *plane = n[V_C] == 0.0 ? (contact ? 5 : 2) - way
                                   : n[V_C] > 0.0 ? (n[V_R] > 0.0 ? 7 : 8)
                                                  : (n[V_R] > 0.0 ? 9 : 10);
            return 1;
        }
        level = 0;
    }
    return -1;
}
int first(int width, const double *p, const double *state, double phase, int periods, int *field,
          int *plane)
{
    double found[CAPSULE_RUN_NUMBERS];
    if (width == 1)
        return alone(p, state, phase, periods, CAPSULE_DOUBLE, field, plane);
    if (width == 2)
        return alone(p, state, phase, periods, CAPSULE_DOUBLE_DOUBLE, field, plane);
    return beside(width, 1, p, state, phase, periods, field, plane, found);
}
/* Number of lanes whose result differs from lane 0's in any bit. */
int neighbours(int width, const double *p, const double *state, double phase, int periods)
{
    int field[2], plane[2], differ = 0;
    double a[CAPSULE_RUN_NUMBERS] = {0}, b[CAPSULE_RUN_NUMBERS] = {0};
    const int made = beside(width, 0, p, state, phase, periods, &field[0], &plane[0], a);
    for (int lane = 1; lane < width; lane++) {
        const int again = beside(width, lane, p, state, phase, periods, &field[1], &plane[1], b);
        differ += again != made || (made > 0 && (field[0] != field[1] || memcmp(a, b, sizeof a)));
    }
    return differ;
}
"""

WIDTHS = {"1": 1, "4": 4, "8": 8, "106 bits": 2}


class Edge(NamedTuple):
    """A start, how far it leads from a tangency or corner, and field and plane of its first switch."""

    start: Start
    distance: float
    switch: tuple[int, int]
    """(0, 0) if none comes."""


Edges = list[Edge]


def cancelling(random: Random) -> RandomStart:
    """A resting capsule whose P, of terms a thousand times larger, is past f_b or -f_b by a rounding,
    and as doubles add it up short of it, or the other way round."""
    x_r, zeta, beta = random.uniform(500, 1000), random.uniform(0.5, 1), random.uniform(0.5, 2)
    p = Parameters(alpha=10, omega=100, delta=1e-4, zeta=zeta, beta=beta)
    gap, f_b = x_r - p.delta, random.choice((-1, 1)) * p.f_b
    v_r = (f_b - x_r - beta * gap) / (2 * zeta)
    true = Fraction(x_r) + Fraction(beta) * (Fraction(x_r) - Fraction(p.delta)) - Fraction(f_b)
    true += 2 * Fraction(zeta) * Fraction(v_r)
    if true * Fraction(2.0 * (v_r * zeta) + gap * beta + x_r - f_b) >= 0:
        return cancelling(random)
    start = Start(p, (x_r, v_r, 0.0), random.uniform(0, p.period), periods=2, max_segments=1)
    return RandomStart("slip start", 0.0, start)


@pytest.fixture(scope="module")
def edges() -> Edges:
    """Starts close to a tangency or corner, and some anywhere."""
    random, found = Random("edges"), []
    while len(found) < COUNT:
        drawn = cancelling(random) if len(found) < CANCELLING else random_start(random)
        if drawn.distance > CLOSEST and len(found) % 3:
            continue
        s = drawn.start
        run = simulate(s.parameters, s.state, s.phase, s.periods, backend="numpy", max_segments=1)
        switches = [
            (segment.field, int(segment.target[1:])) for segment in run.segments if segment.target
        ]
        if run.segments and run.segments[0].outcome in SURE:
            found.append(Edge(s, drawn.distance, switches[0] if switches else (0, 0)))
    return found


def library(directory: Path, change: tuple[str, str] | None) -> ctypes.CDLL:
    """A core, one text of whose sources is changed, with lanes of every width."""
    flags = ("-shared", "-fPIC", "-DCAPSULE_ANY_WIDTH=1", "-Wno-psabi")
    return ctypes.CDLL(str(built(directory, SHIM, *flags, change=change)))


def given(start: Start) -> tuple[object, ...]:
    numbers = [*start.parameters.to_dict().values()], start.state
    arrays = [(ctypes.c_double * len(row))(*row) for row in numbers]
    return (*arrays, ctypes.c_double(start.phase), start.periods)


def decided(core: ctypes.CDLL, edge: Edge, width: int) -> tuple[int, int] | int:
    """Field and plane of the first switch as the core has it, -1 if it cannot decide, -2 where
    it leaves the start to another width."""
    field, plane = ctypes.c_int(), ctypes.c_int()
    made = core.first(width, *given(edge.start), ctypes.byref(field), ctypes.byref(plane))
    return (field.value, plane.value) if made >= 0 else made


def wrong(core: ctypes.CDLL, edges: Edges, width: int) -> list[Start]:
    """Edges that are decided otherwise at a width."""
    found = [(edge, decided(core, edge, width)) for edge in edges]
    return [e.start for e, made in found if not isinstance(made, int) and made != e.switch]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return library(tmp_path_factory.mktemp("sound") / "c", None)


@pytest.mark.parametrize("width", WIDTHS)
def test_the_sound_core_decides_nothing_wrongly(
    sound: ctypes.CDLL, edges: Edges, width: str
) -> None:
    assert wrong(sound, edges, WIDTHS[width]) == []


@pytest.mark.parametrize("width", WIDTHS)
def test_away_from_tangencies_and_corners_all_is_decided(
    sound: ctypes.CDLL, edges: Edges, width: str
) -> None:
    """If no event function comes near zero without crossing, the proofs succeed at every width."""
    far = [edge for edge in edges if edge.distance == math.inf]
    made = [decided(sound, edge, WIDTHS[width]) for edge in far]
    taken = [switch for switch in made if switch != -2]
    assert len(taken) > len(far) // 2  # lanes leave what may rest for ever to the scalar code
    assert -1 not in taken


@pytest.mark.parametrize("width", [4, 8])
def test_a_lane_does_not_depend_on_its_neighbours(
    sound: ctypes.CDLL, edges: Edges, width: int
) -> None:
    assert sum(sound.neighbours(width, *given(start)) for start, *_ in edges[:1000]) == 0


MUTANTS: dict[str, tuple[str, str]] = {
    "rounding": ("#define UNIT 0x1p-53", "#define UNIT 0x1p-80"),
    "a rival guard": ("gt(near_to(value), near_zero)", "gt(near_to(value), all(-1e300))"),
    "one change of sign": (" & not(turned) &", " &"),
    "every coefficient positive": ("least = smaller(least, value[j]);", "least = j > 1 && j < DEGREE - 2 ? least : smaller(least, value[j]);"),
}  # fmt: skip


@pytest.mark.parametrize("mutant", KILLED)
def test_a_bound_that_is_gone_is_noticed(tmp_path: Path, edges: Edges, mutant: str) -> None:
    core = library(tmp_path / "c", MUTANTS[mutant])
    survived = [w for w in KILLED[mutant] if not wrong(core, edges, WIDTHS[w])]
    assert survived == []
