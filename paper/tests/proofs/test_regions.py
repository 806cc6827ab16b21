"""The (alpha, gamma) plane in patches: against single orbits, and with a remainder taken away."""

from __future__ import annotations

import json
import math
from fractions import Fraction
from itertools import product
from pathlib import Path
from types import ModuleType

import grimp
import numpy as np
import pytest
from flint import arb_mat

from capsule_sym import InvalidInput, Parameters, solve_orbit
from capsule_sym._enclosures.numbers.balls import (
    Unproved,
    arb,
    assembled,
    ball,
    floats,
    largest,
    stacked,
)
from capsule_sym._enclosures.numbers.fields import Field
from capsule_sym._enclosures.orbits.proof import guess_of, shooting_of
from capsule_sym._orbits.shooting import changes, itinerary
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym.generated.capsule import facts
from capsule_sym.orbits import solve_itinerary
from paper.proofs import forms, patch_orbits, patches
from paper.proofs.case import ALPHA, EXACT, GAMMA
from paper.proofs.digest import closure, digest
from paper.proofs.forms import Form, exponential, polynomial
from paper.proofs.parts import Patch
from paper.proofs.patch_orbits import PatchOrbits
from paper.proofs.patches import attempt
from paper.proofs.subdivision import PLANE, begun, prove
from tests.enclosures.case import precise

REST = (0.0, 0.0, 0.0)

bits = precise(64)


def patch_at(alpha: float, gamma: float, radii: tuple[float, float], **other: float) -> PatchOrbits:
    orbit = solve_orbit(Parameters(alpha=alpha, gamma=gamma, **other))
    assert orbit.success, orbit.message
    exact = {name: text for name, text in EXACT.items() if name not in other}
    shooting = shooting_of(orbit.itinerary, orbit.values, ("alpha", "gamma"), exact)
    return PatchOrbits(shooting, guess_of(shooting, orbit), radii)


def at(form: Form, x: float, y: float):
    """A form's ball at a place of its box."""
    return sum((c * x**a * y**b for c, (a, b) in zip(form.p, forms.MONOMIALS, strict=True)), form.e)


PLACES = tuple(product((-1.0, -0.3, 0.6, 1.0), repeat=2))
ONE = polynomial([1.3, 0.1, -0.05, 0.02], 1e-9)
OTHER = polynomial([-0.7, 0.03, 0.08, 0.0, 0.01, 0.01])


@pytest.mark.parametrize(
    ("made", "true"),
    [
        (ONE * OTHER, lambda x, y: x * y),
        (ONE * ONE * OTHER + ONE - OTHER, lambda x, y: x * x * y + x - y),
        (OTHER.inverse(), lambda x, y: 1 / y),
        ((2 - ONE * OTHER) / ONE + 1 - arb(3), lambda x, y: (2 - x * y) / x - 2),
        (ONE.sin_cos()[0], lambda x, y: x.sin()),
        (ONE.sin_cos()[1], lambda x, y: x.cos()),
    ],
)
def test_forms_hold_what_they_stand_for_and_not_without_remainder(made: Form, true) -> None:
    bare = Form(made.p, made.e * 0)
    held = [at(made, *s).contains(true(at(ONE, *s), at(OTHER, *s)).mid()) for s in PLACES]
    without = [at(bare, *s).contains(true(at(ONE, *s), at(OTHER, *s)).mid()) for s in PLACES]
    assert all(held)
    assert not all(without)
    assert float(made.e.rad()) < 5e-2


def test_a_matrix_of_forms_and_balls_holds_both() -> None:
    made = assembled(2, 2, [(0, 0, ONE), (0, 1, arb(3)), (1, 0, OTHER * ONE)])
    below = stacked([made, arb_mat([[5, 7]])])
    turned = arb_mat([[0, 1, 0], [2, 0, 1]]) * below
    for x, y in PLACES:
        one, other = at(ONE, x, y), at(OTHER, x, y)
        expected = [[one * other, arb(0)], [2 * one + 5, arb(13)]]
        for i, j in product(range(2), repeat=2):
            assert at(turned[i, j], x, y).overlaps(expected[i][j])
            assert forms.hull(turned)[i, j].contains(expected[i][j].mid())


def test_exponential_over_a_patch_holds_the_flow_at_its_corners() -> None:
    patch = patch_at(1.64, 3.3, (2e-3, 2e-2))
    h = polynomial([1.2, 0.01, -0.02])
    found = exponential(patch.flows[4].A, h)
    for x, y in PLACES:
        exact = Field(4, patch.given | {"gamma": patch.gamma.c + ball(0.02) * y})
        flow = exact.flow(ball(1.2 + 0.01 * x - 0.02 * y))
        for i, j in product(range(6), repeat=2):
            entry = found[i, j]
            assert at(entry, x, y).overlaps(flow[i, j])
    assert float(max(abs(x) for row in floats(found.e) for x in row)) < 1e-3


@pytest.mark.parametrize("index", range(1, 7))
def test_rates_over_a_patch_are_those_of_its_places(index: int) -> None:
    patch = patch_at(1.64, 3.3, (2e-3, 2e-1))
    flow = patch_orbits._Flow(index, patch.given, patch.gamma)
    bare = Form(flow.A.p, flow.A.e * 0)
    missed = 0
    for x, y in PLACES:
        exact = Field(index, patch.given | {"gamma": patch.gamma.c + ball(0.2) * y}).A
        for i, j in product(range(6), repeat=2):
            assert at(flow.A[i, j], x, y).overlaps(exact[i, j])
            missed += not at(bare[i, j], x, y).overlaps(exact[i, j])
    assert (missed > 0) == (index not in (2, 5))  # no rate at rest depends on gamma


@pytest.mark.parametrize(("alpha", "gamma"), [(1.2, 3.3), (1.9, 2.0), (0.005, 3.0)])
def test_patch_holds_the_orbits_of_its_corners(alpha: float, gamma: float) -> None:
    radii = (1e-3, 1e-2)
    patch = patch_at(alpha, gamma, radii)
    segments = patch.enclose()
    patch.prove()
    orbit = solve_orbit(Parameters(alpha=alpha, gamma=gamma))
    assert orbit.success, orbit.message
    for x, y in ((-1.0, -1.0), (-1.0, 1.0), (1.0, 0.3)):
        values = list(orbit.values)
        values[0] += x * radii[0]
        values[PARAMETERS.index("gamma")] += y * radii[1]
        moved = solve_itinerary(values, orbit.itinerary, list(orbit.z))
        assert moved.success, moved.message
        for node, flow in zip(segments.nodes, moved.system.flows, strict=True):
            for row in range(2):
                held = at(node.state[row, 0], x, y)
                assert (held + arb(0, 1e-12)).contains(arb(float(flow.start[row])))


def test_patches_that_are_too_large_or_across_a_border_are_not_proved() -> None:
    with pytest.raises(Unproved, match="existence"):
        patch_at(1.2, 3.3, (0.05, 0.5)).prove()
    with pytest.raises(Unproved, match="guards"):
        patch_at(0.36, 3.3, (0.02, 0.02)).prove()  # forward drift begins at 0.3687...


def test_unstable_orbits_are_not_proved_to_be_stable() -> None:
    orbit = solve_orbit(Parameters(alpha=0.0428, zeta=0.005))
    assert orbit.success, orbit.message
    values = [0.045, *orbit.values[1:]]  # between two period doublings
    unstable = solve_itinerary(values, orbit.itinerary, list(orbit.z))
    assert unstable.success, unstable.message
    assert unstable.itinerary.period_number == 1
    exact = {**EXACT, "zeta": "0.005"}
    shooting = shooting_of(unstable.itinerary, unstable.values, ("alpha", "gamma"), exact)
    patch = PatchOrbits(shooting, guess_of(shooting, unstable), (1e-6, 1e-6))
    patch.admissible(patch.enclose())
    with pytest.raises(Unproved, match="stability"):
        patch.prove()


def test_a_guard_that_is_negative_somewhere_is_found_in_no_part() -> None:
    """The zero of the equations beyond a border is rejected, however small the patch."""
    orbit = solve_orbit(Parameters(alpha=0.36))
    assert orbit.success, orbit.message
    beyond = solve_itinerary([0.37, *orbit.values[1:]], orbit.itinerary, list(orbit.z))
    assert beyond.success, beyond.message
    shooting = shooting_of(beyond.itinerary, beyond.values, ("alpha", "gamma"), EXACT)
    patch = PatchOrbits(shooting, guess_of(shooting, beyond), (1e-6, 1e-6))
    with pytest.raises(Unproved, match="guards"):
        patch.admissible(patch.enclose())


def test_halves_tile_their_patch() -> None:
    part = Patch(5, 7, 4, 3)
    for along in (0, 1):
        low, high = part.halved((along,))
        assert low.area + high.area == part.area
        (here, _), (radius, _) = (
            (part.middle, part.radii)
            if along == 0
            else (
                part.middle[::-1],
                part.radii[::-1],
            )
        )
        for half, side in ((low, -1), (high, 1)):
            middle = half.middle[along]
            assert middle == pytest.approx(here + side * radius / 2, rel=1e-8)
            # No gap between neighbours: each reaches a little over the common side.
            assert side * (middle - side * half.radii[along] - here) < 0


def test_parts_of_several_halvings_are_a_grid() -> None:
    parts = Patch(5, 7, 4, 3).halved((0, 1, 0))
    assert {*parts} == {Patch(7, 28 + i, 5, 6 + k) for i, k in product(range(4), range(2))}
    assert len(parts) == 8
    assert sum(part.area for part in parts) == Patch(5, 7, 4, 3).area


@pytest.mark.parametrize(
    ("alpha", "gamma", "levels", "along"),
    [(0.941, 3.3, (8, 6), 0), (1.5514, 3.3, (11, 4), 1), (1.2, 3.3, (8, 6), None)],
)
def test_a_patch_across_a_border_is_halved_where_its_corners_differ(
    alpha: float, gamma: float, levels: tuple[int, int], along: int | None
) -> None:
    """The border at 0.941 hardly depends on gamma, that at 1.5514 falls by 0.5 as gamma grows."""
    a, g = levels
    shares = ((x - ends[0]) / (ends[1] - ends[0]) for x, ends in ((alpha, ALPHA), (gamma, GAMMA)))
    i, k = (int(share * 2**level) for share, level in zip(shares, levels, strict=True))
    assert patches._border(patches._corners(Patch(a, i, g, k), REST)) == along


def test_attempt_names_the_itinerary_or_how_to_halve() -> None:
    small = Patch(9, 300, 6, 40)
    alpha, gamma = small.middle
    itinerary = attempt(small, REST).itinerary
    orbit = solve_orbit(Parameters(alpha=alpha, gamma=gamma))
    assert orbit.success, orbit.message
    assert itinerary == str(orbit.itinerary)
    large = attempt(Patch(0, 0, 0, 0), REST)
    assert large.itinerary is None
    assert large.along
    assert {*large.along} <= {0, 1}


def test_a_run_goes_on_where_its_file_ends(tmp_path: Path) -> None:
    path = tmp_path / "regions.jsonl"
    fresh = begun(path)
    assert sum(-area for area, *_ in fresh.open) == pytest.approx(1.0)
    first, second = (part for *_, part, _ in sorted(fresh.open)[:2])
    low, high = second.halved((1,))
    records = (
        {"part": first, "seconds": 1.0, "work": 0.5, "itinerary": "F5 F2"},
        {"part": second, "seconds": 2.0, "work": 0.5, "along": [1]},
        {"part": low, "seconds": 3.0, "work": 0.25, "itinerary": "F2"},
    )
    path.write_text("".join(json.dumps(one) + "\n" for one in (PLANE.begin(), *records)))
    # A kill in the middle of a line costs its patch.
    with path.open("a") as file:
        file.write('{"part": [5, 0, 4, 0], "wo')
    again = begun(path)
    assert again.share == first.area + low.area
    assert (again.patches, again.seconds, again.work) == (2, 3.0, 1.25)
    open_parts = {part for *_, part, _ in again.open}
    assert high in open_parts
    assert not {first, second, low} & open_parts
    total = again.share + sum(-area for area, *_ in again.open)
    assert total == pytest.approx(1.0)
    assert prove(path, 1e-9).share == again.share
    assert [json.loads(line) for line in path.read_text().splitlines()[1:]] == [
        {**one, "part": list(one["part"])} for one in records
    ]


@pytest.mark.parametrize(
    "lines",
    [
        ['{"certificates": []}'],
        ['{"code": "CODE"}', '{"part": [5, 0, 4, 0], "seconds": 1.0, "work": 1.0}'],
        ['{"code": "CODE"}', '{"part": [5, 0, 4, 0], "seconds": 1.0, "work": 1.0, "along": [2]}'],
        [
            '{"code": "CODE"}',
            '{"part": [5, 0, 4, 0], "seconds": 1.0, "work": 1.0, "itinerary": ""}',
        ],
        [
            '{"code": "CODE"}',
            '{"part": [5, 0, 4, 0], "seconds": 1, "work": 1, "along": [1], "itinerary": "F2"}',
        ],
        [
            '{"code": "CODE"}',
            '{"part": [5, 0.5, 4, 0], "seconds": 1.0, "work": 1.0, "itinerary": "F2"}',
        ],
        ['{"part": [5, 0, 4, 0], "seconds": 1.0, "work": 1.0, "itinerary": "F2"}'],
    ],
)
def test_a_file_of_something_else_is_refused(tmp_path: Path, lines: list[str]) -> None:
    path = tmp_path / "other.json"
    path.write_text(
        "".join(
            line.replace('{"code": "CODE"}', json.dumps(PLANE.begin())) + "\n" for line in lines
        )
    )
    with pytest.raises(InvalidInput, match="one that `python -m paper enclose --region` wrote"):
        begun(path)


def test_the_digest_covers_all_that_proves() -> None:
    graph = grimp.build_graph("capsule_sym", "paper")
    name = patches.__name__
    below = graph.find_upstream_modules(name) | {name}
    homes = "capsule_sym._enclosures.", "paper.proofs."
    proving = {one for one in below if one.startswith(homes)} | {
        one.__name__ for one in (facts, changes, itinerary)
    }
    assert {one.__name__ for one in closure(patches)} == proving


def test_a_digest_is_of_what_is_said_not_where(tmp_path: Path) -> None:
    def of(text: str, name: str) -> str:
        path = tmp_path / f"{name}.py"
        path.write_text(text)
        module = ModuleType(name)
        module.__file__ = str(path)
        return digest((module,))

    imports = "from capsule_sym.a.b import c\nfrom capsule_sym.e import d\n"
    moved_imports = "from capsule_sym.e import d\nfrom capsule_sym.z import c\n"
    text = f'''"""One."""\n{imports}from math import exp\n\n
def f(x):\n    """Two."""\n    # Note.\n    return c(x, 2) > exp(x)\n'''
    was = of(text, "one")
    same = ("One.", "Another."), ("Two.", "More."), ("# Note.", ""), (imports, moved_imports)
    for number, (old, new) in enumerate(same):
        assert of(text.replace(old, new), f"same{number}") == was
    changed = (">", ">="), ("2", "3"), ("exp", "log"), ("import c", "import e"), ("math", "cmath")
    for number, (old, new) in enumerate(changed):
        assert of(text.replace(old, new), f"other{number}") != was


def test_what_other_code_proved_is_not_gone_on_from(tmp_path: Path) -> None:
    path = tmp_path / "regions.jsonl"
    path.write_text('{"option": "--region", "code": "0"}\n')
    with pytest.raises(InvalidInput, match="a new one: this was proved by other code"):
        begun(path)


def test_the_smallest_patches_overlap_too() -> None:
    level = 30
    for place in (1, 12345, 2**level - 3):
        here, there = Patch(level, place, 0, 0), Patch(level, place + 1, 0, 0)
        end = Fraction(here.middle[0]) + Fraction(here.radii[0])
        exact = Fraction(ALPHA[0]) + Fraction(place + 1, 2**level) * (
            Fraction(ALPHA[1]) - Fraction(ALPHA[0])
        )
        assert end > exact
        assert Fraction(there.middle[0]) - Fraction(there.radii[0]) < exact


def test_a_matrix_that_knows_nothing_is_not_small() -> None:
    assert np.isnan(largest(arb_mat([[1, 2], [arb("nan"), 0]])))
    assert np.isnan(largest(arb_mat([[arb("nan"), 0], [1, 2]])))


def test_sizes_of_a_large_residual_prove_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the residual's remainder taken away a patch that is too large would pass."""
    radii = (9e-3, 9e-2)
    monkeypatch.setattr(PatchOrbits, "promising", np.inf)
    with pytest.raises(Unproved, match="existence"):
        patch_at(1.9, 2.0, radii).enclose()
    whole = Form.__mul__

    def bare(self: Form, other: object) -> Form:
        found = whole(self, other)
        return Form(found.p, found.e * 0)

    patch = patch_at(1.9, 2.0, radii)
    monkeypatch.setattr(Form, "__mul__", bare)
    assert np.isfinite(float(patch.enclose().durations[0].hull.mid()))


@pytest.mark.parametrize("seconds", [math.nan, 0, -1.0, None])
def test_a_time_that_is_none_is_refused(seconds: float, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"seconds = .* a number > 0"):
        prove(tmp_path / "region.jsonl", seconds)
    assert not any(tmp_path.iterdir())
