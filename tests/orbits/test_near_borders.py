"""Folds, doublings and borders within 1e-4 of a border collision along a branch."""

from collections.abc import Sequence

import numpy as np
import pytest

from capsule_sym import continue_from, continue_orbit, results
from capsule_sym._orbits.continuation import kinds
from tests.orbits.branches import settled

pytestmark = pytest.mark.long


def both_ways(parameter: str, ends: Sequence[float], **fixed: float) -> list[results.Bifurcation]:
    """The bifurcations between two values, which are the same on the way back."""
    orbit, ways = settled(**{parameter: ends[0]}, **fixed), []
    for to in ends[::-1]:
        branch = continue_orbit(orbit, parameter, to, points=2)
        assert branch.status is results.Status.REACHED, branch.message
        ways.append(branch.bifurcations)
        orbit = branch.points[-1].orbit
    there, back = ways[0], ways[1][::-1]
    assert [one.type for one in there] == [one.type for one in back]
    for one, other in zip(there, back, strict=True):
        assert abs(one.value - other.value) <= one.uncertainty + other.uncertainty
    return list(there)


def test_folds_nearer_to_a_border_than_a_first_point_beside_it() -> None:
    """(omega, alpha) where folds on both sides of a border meet it; see `test_curves`.

    Their distances from the border grow with the square of alpha's from there.
    """
    point = (0.866044823146428, 1.224186888611542)

    def events(alpha: float) -> list[results.Bifurcation]:
        found = both_ways("omega", (0.865, 0.8662), alpha=alpha, beta=10.0)
        return [one for one in found if one.type in (kinds.FOLD, kinds.CROSSING)]

    apart = []
    for away in (2e-5, 1e-5):
        found = events(point[1] - away)
        assert [one.type for one in found] == [kinds.FOLD, kinds.CROSSING, kinds.FOLD]
        apart.append([abs(found[k].value - found[1].value) for k in (0, 2)])
    assert np.divide(*apart) == pytest.approx(4, rel=0.01)
    assert [one.type for one in events(point[1] + 1e-5)] == [kinds.CROSSING]


def test_branches_that_leave_a_border_have_the_folds_beside_it() -> None:
    start = settled(omega=0.865, alpha=1.224186888611542 - 1e-5, beta=10.0)
    branch = continue_orbit(start, "omega", 0.8662, points=2)
    (one,) = (b for b in branch.bifurcations if b.type == kinds.CROSSING)
    found = [
        bifurcation.value
        for new in continue_from(branch, one.label, one.value + 1e-4, points=2)
        for bifurcation in new.bifurcations
        if bifurcation.type == kinds.FOLD
    ]
    expected = [b.value for b in branch.bifurcations if b.type == kinds.FOLD]
    assert len(expected) == 2
    assert sorted(found) == pytest.approx(sorted(expected), abs=1e-14)


def test_period_doublings_nearer_to_a_border_than_a_first_point_beside_it() -> None:
    """Multipliers are continuous at adding-sliding: doublings move away from it in proportion."""
    slopes = []
    for away in (1e-5, 1e-8):
        found = both_ways("alpha", (0.34, 0.37), zeta=0.0480661171083319 - away)
        assert [one.type for one in found] == [
            kinds.PERIOD_DOUBLING,
            kinds.ADDING,
            kinds.PERIOD_DOUBLING,
        ]
        slopes.append([(found[k].value - found[1].value) / away for k in (0, 2)])
    assert slopes[1] == pytest.approx(slopes[0], rel=0.02)


#: (alpha, gamma) at which two border collisions happen together, found on their curves.
TOGETHER = {
    (kinds.CORNER, kinds.SWITCHING): (1.389876487080773, 3.858902963081073),
    (kinds.CORNER, kinds.GRAZING_SLIDING): (1.3863144813221504, 3.9068707720216516),
    (kinds.CROSSING, kinds.SWITCHING): (1.6086204300480378, 3.0955278438499905),
    (kinds.CROSSING, kinds.GRAZING_SLIDING): (1.6013680974596105, 3.185456528248273),
}


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("kinds", TOGETHER)
def test_two_border_collisions_within_a_millionth(kinds: tuple[str, str], side: int) -> None:
    """Curves that cross: the events lie on straight lines through the point, near as further on."""
    alpha, gamma = TOGETHER[kinds]
    found = []
    for away in (1e-4, 1e-6):
        ends = (alpha - 0.01, alpha + 0.01)
        events = both_ways("alpha", ends, gamma=gamma + side * away)
        near = [one for one in events if one.type in kinds]
        found.append([(one.type, (one.value - alpha) / away) for one in near])
    assert [kind for kind, _ in found[0]] == [kind for kind, _ in found[1]]
    assert sorted(kind for kind, _ in found[1]) == sorted(kinds)
    far, near = ([slope for _, slope in one] for one in found)
    assert near == pytest.approx(far, rel=1e-3)


def test_a_slip_that_reverses_hides_the_crossing_behind_it() -> None:
    """Near a degenerate point a drift turns back before its landing's margin is 0.

    From the degenerate point on, grazing- and switching-sliding part by the square of the distance.
    """
    alpha, gamma = 1.34731122382007, 4.1674541499034
    apart = []
    for away in (1e-3, 2.5e-4):
        found = both_ways("alpha", (alpha - 1e-3, alpha + 1e-3), gamma=gamma - away)
        assert [one.type for one in found] == [kinds.SWITCHING, kinds.GRAZING_SLIDING]
        apart.append(found[1].value - found[0].value)
    assert apart[0] / apart[1] == pytest.approx(16, rel=0.01)
