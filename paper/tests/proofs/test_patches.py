"""Orbits over a patch of the plane: each condition of their proof alone."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from capsule_sym import Parameters, solve_orbit
from capsule_sym._enclosures.numbers.balls import Unproved, arb, ball
from capsule_sym._enclosures.orbits.proof import guess_of, shooting_of
from capsule_sym._enclosures.passage.guards import Signs
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym.orbits import solve_itinerary
from paper.proofs import patch_orbits
from paper.proofs.case import EXACT
from paper.proofs.forms import MONOMIALS, Form, polynomial
from paper.proofs.patch_orbits import PatchOrbits
from tests.enclosures.case import precise

AXIS = (-1.0, 0.0, 0.5, 1.0)

bits = precise(64)


def patch_at(alpha: float, gamma: float, radii: tuple[float, float]) -> tuple[PatchOrbits, Any]:
    orbit = solve_orbit(Parameters(alpha=alpha, gamma=gamma))
    assert orbit.success, orbit.message
    shooting = shooting_of(orbit.itinerary, orbit.values, ("alpha", "gamma"), EXACT)
    return PatchOrbits(shooting, guess_of(shooting, orbit), radii), orbit


def at(form: Form, place: tuple[float, float]) -> Any:
    """A form's ball at a place of its box."""
    x, y = place
    return sum((c * x**a * y**b for c, (a, b) in zip(form.p, MONOMIALS, strict=True)), form.e)


@pytest.mark.parametrize(
    ("alpha", "gamma", "radii"),
    [(1.2, 3.3, (1.2e-2, 1.2e-1)), (1.2, 3.3, (1.3e-2, 1.3e-1)), (1.9, 2.0, (9e-3, 9e-2))],
)
def test_a_patch_whose_image_leaves_the_box_is_not_proved(
    alpha: float, gamma: float, radii: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is a little too large: the remainder of the unit matrix is small enough."""
    monkeypatch.setattr(PatchOrbits, "promising", np.inf)
    with pytest.raises(Unproved, match="existence"):
        patch_at(alpha, gamma, radii)[0].enclose()


@pytest.mark.parametrize(("alpha", "gamma"), [(1.2, 3.3), (1.9, 2.0)])
def test_a_patch_holds_its_orbits(alpha: float, gamma: float) -> None:
    """Orbits in double precision, which are right to 1e-12, on a patch that is nearly too large."""
    radii = (7.5e-3, 7.5e-2)
    patch, orbit = patch_at(alpha, gamma, radii)
    found = patch.enclose()
    for place in product(AXIS, repeat=2):
        values = list(orbit.values)
        for name, share, radius in zip(("alpha", "gamma"), place, radii, strict=True):
            values[PARAMETERS.index(name)] += share * radius
        moved = solve_itinerary(values, orbit.itinerary, list(orbit.z))
        assert moved.success, moved.message
        for node, h, flow, true in zip(
            found.nodes, found.durations, moved.system.flows, moved.durations, strict=True
        ):
            assert (at(h, place) + ball(0, 1e-12)).contains(arb(float(true)))
            for row in range(3):
                held = at(node.state[row, 0], place) + ball(0, 1e-12)
                assert held.contains(arb(float(flow.start[row])))


def test_guards_are_those_of_all_durations_states_and_mass_ratios(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each proof of a segment is given all of what its part of the patch has."""
    radii = (1e-3, 1e-2)
    patch, _ = patch_at(1.2, 3.3, radii)
    found, seen = patch.enclose(), []
    monkeypatch.setattr(Signs, "segment", lambda self, *given: seen.append(given))
    patch.admissible(found)
    assert len(seen) == len(found.nodes)
    for (field, start, end, h, _, _), node, duration in zip(
        seen, found.nodes, found.durations, strict=True
    ):
        assert field._values["gamma"].contains(arb(3.3) + arb(radii[1]))
        assert field._values["gamma"].contains(arb(3.3) - arb(radii[1]))
        assert h.contains(duration.hull)
        assert end.ncols() == start.ncols() == len(MONOMIALS) + 1
        for row in range(6):
            parts = *(part[row, 0] for part in node.state.p), node.state.e[row, 0]
            assert all(start[row, k].contains(part) for k, part in enumerate(parts))


def test_a_patch_is_admissible_only_if_all_of_its_parts_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    patch, _ = patch_at(1.2, 3.3, (1e-3, 1e-2))
    found, refused = patch.enclose(), (3.3 + 1e-2, 3.3 - 1e-2)

    def fails_at(gamma: float) -> None:
        def segment(self: Signs, field: Any, *_: object) -> None:
            values = field._values["gamma"]
            if values.contains(arb(gamma)) and not field.stick:
                raise Unproved("guards", "at an edge")

        monkeypatch.setattr(Signs, "segment", segment)

    for gamma in (*refused, 3.3):
        fails_at(gamma * (1 - 1e-9) if gamma > 3.3 else gamma * (1 + 1e-9))
        with pytest.raises(Unproved, match="at an edge"):
            patch.admissible(found)


def test_parts_cover_their_patch() -> None:
    form = polynomial([0.5, 1.0, -2.0, 0.25, 0.75, -0.5, 0.125, -0.375, 0.625, 0.25], 0.125)
    whole = (0.0, 1.0, 0.0, 1.0)
    for along, then in product(range(2), repeat=2):
        parts = [
            small
            for half in patch_orbits._halves(whole, along)
            for small in patch_orbits._halves(half, then)
        ]
        for x, y in product((-1.0, -0.6, 0.1, 0.9, 1.0), repeat=2):
            inside = [
                part
                for part in parts
                if abs(x - part[0]) <= part[1] and abs(y - part[2]) <= part[3]
            ]
            assert inside
            for a, wide, b, high in inside:
                there = patch_orbits.within(form, (a, wide, b, high))
                local = at(there, ((x - a) / wide, (y - b) / high))
                assert float(abs(local.mid() - at(form, (x, y)).mid())) < 1e-15
                assert there.e.rad() >= form.e.rad()
