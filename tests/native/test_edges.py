"""Starts at the edge of what double precision decides, and the core with one of its bounds gone.

What the core decides there must be what 50 digits decide; what it leaves open is theirs. Bounds
stand behind one another, so that many a one may go alone and nothing is decided wrongly.
"""

from __future__ import annotations

import ctypes
import shutil
from pathlib import Path
from random import Random

import pytest

from capsule_sym import simulate
from capsule_sym.errors import Outcome
from capsule_sym.hardcases.judge import Start
from capsule_sym.hardcases.starts import random_start
from tests.native import built

SURE = (Outcome.REGULAR, Outcome.NEVER, Outcome.END)
COUNT, CLOSEST = 4000, 3e-16

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

SHIM = """
#include "capsule.h"
int first(const double *p, const double *state, double phase, int periods, int *field, int *plane)
{
    static capsule_map map;
    capsule_event event = {0};
    const capsule_wish wish = {.events = &event, .room = 1};
    capsule_outcome open;
    size_t written;
    capsule_map_make((const capsule_parameters *)p, &map);
    capsule_state at = capsule_state_at(&map, state[0], state[1], state[2], phase);
    const int stop = capsule_run(&map, &at, periods, &wish, &written, &open);
    *field = event.field;
    *plane = event.plane;
    return stop == CAPSULE_OPEN && !written ? -1 : (int)written;
}
"""


@pytest.fixture(scope="module")
def edges() -> list[tuple[Start, tuple[int, int]]]:
    """Starts, and field and plane of their first switch, (0, 0) if none comes."""
    random, found = Random("edges"), []
    while len(found) < COUNT:
        drawn = random_start(random)
        if drawn.distance > CLOSEST:
            continue
        s = drawn.start
        run = simulate(s.parameters, s.state, s.phase, s.periods, backend="numpy", max_segments=1)
        switches = [(leg.field, int(leg.target[1:])) for leg in run.segments if leg.target]
        if run.segments and run.segments[0].outcome in SURE:
            found.append((s, switches[0] if switches else (0, 0)))
    return found


def wrong(
    directory: Path,
    edges: list[tuple[Start, tuple[int, int]]],
    change: tuple[str, str, str] | None,
) -> int:
    """How many of the edges a core decides otherwise, one line of whose sources is changed."""
    core = built(directory, SHIM, "-shared", "-fPIC", change=change)
    first, count = ctypes.CDLL(str(core)).first, 0
    for start, true in edges:
        numbers = [*start.parameters.to_dict().values()], start.state
        arrays = [(ctypes.c_double * len(row))(*row) for row in numbers]
        field, plane = ctypes.c_int(), ctypes.c_int()
        made = first(
            *arrays,
            ctypes.c_double(start.phase),
            start.periods,
            ctypes.byref(field),
            ctypes.byref(plane),
        )
        count += made >= 0 and (field.value, plane.value) != true
    return count


def test_the_sound_core_decides_nothing_wrongly(
    tmp_path: Path, edges: list[tuple[Start, tuple[int, int]]]
) -> None:
    assert wrong(tmp_path / "c", edges, None) == 0


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        # Rounding is counted far too low.
        ("internal.h", "#define UNIT 0x1p-53", "#define UNIT 0x1p-80"),
        # What a polynomial of low degree leaves out is not counted.
        ("expansion.c", "= dot(guard == GAP ? t->x_tail : t->second_tail, e->size);", "= 0.0;"),
        # Nothing is lost on the way to a later expansion.
        ("expansion.c", "to->later = 1;", "to->later = 0;"),
        # Two guards are never taken to vanish together.
        ("run.c", "fabs(ahead) <= first->root.error + next.root.error", "0"),
    ],
)
def test_a_bound_that_is_gone_is_noticed(
    tmp_path: Path, edges: list[tuple[Start, tuple[int, int]]], file: str, old: str, new: str
) -> None:
    assert wrong(tmp_path / "c", edges, (file, old, new)) > 0
