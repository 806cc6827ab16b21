"""The curves that leave points of codimension two: against branches at other values."""

import numpy as np
import pytest

from capsule_sym import continue_bifurcation, continue_orbit, orbits, results
from capsule_sym._orbits.continuation.points import kinds
from tests.orbits.branches import settled, upwards

pytestmark = pytest.mark.long

DOUBLING = (0.36857435716012, 0.0480661171083319)
DEGENERATE = (1.34731122382007, 4.1674541499034)


def ends(curve: results.Curve) -> list[tuple[float, float]]:
    return [curve.points[0].values, curve.points[-1].values]


def values_at(curve: results.Curve, second: float) -> list[float]:
    return [first for first, other in ends(curve) if other == pytest.approx(second, abs=1e-12)]


def test_period_doublings_leave_a_curve_of_adding_sliding_to_both_sides() -> None:
    ranges = ((0.3, 0.4), (0.0478, 0.05))
    branch = continue_orbit(settled(alpha=0.36), "alpha", 0.38, points=4)
    border = continue_bifurcation(branch.at("AS1"), "zeta", ranges, points=4)
    (doubling,) = orbits.curves_from(border, ranges, points=4)
    assert (doubling.type, doubling.success) == (kinds.PERIOD_DOUBLING, True)
    assert doubling.codimension_two[0].values == pytest.approx(DOUBLING, abs=1e-12)
    assert {str(p.orbit.itinerary) for p in doubling.points} == {"F5 F4 F5 F2", "F5 F2"}
    # The branch at the other end has both of them.
    low = continue_orbit(settled(alpha=0.33, zeta=0.0478), "alpha", 0.39, points=4)
    expected = [one.value for one in low.bifurcations if one.type == kinds.PERIOD_DOUBLING]
    assert sorted(values_at(doubling, 0.0478)) == pytest.approx(expected, abs=1e-11)
    # From these the curve of border collisions is found again, once.
    (back,) = orbits.curves_from(doubling, ranges, points=4)
    assert back.type == kinds.ADDING
    assert np.array(ends(back)) == pytest.approx(np.array(ends(border)), abs=1e-11)
    assert [one.values for one in back.codimension_two] == [doubling.codimension_two[0].values]
    assert orbits.curves_from(doubling, ranges, points=4, known=[border]) == ()


@pytest.mark.parametrize("kind", [kinds.SWITCHING, kinds.GRAZING_SLIDING])
def test_both_sliding_curves_leave_a_degenerate_point(kind: str) -> None:
    ranges = ((1.2, 1.8), (3.0, 4.4))
    branch = continue_orbit(settled(alpha=1.34, gamma=4.1), "alpha", 1.37, points=4)
    (one,) = (b for b in branch.bifurcations if b.type == kind)
    curve = continue_bifurcation(one, "gamma", ranges, points=8)
    assert curve.success
    found = {one.type: one for one in orbits.curves_from(curve, ranges, points=8)}
    (other,) = {kinds.SWITCHING, kinds.GRAZING_SLIDING} - {kind}
    assert found[other].codimension_two[0].values == pytest.approx(DEGENERATE, abs=1e-12)
    # Each of them comes to the value that a branch has at the border of the range.
    for name in (other, kinds.CROSSING):
        (expected,) = (b.value for b in upwards(3.0).bifurcations if b.type == name)
        assert values_at(found[name], 3.0) == pytest.approx([expected], abs=1e-11)
    if other == kinds.SWITCHING:
        assert results.Status.CODIMENSION_TWO in [ending for ending, _ in found[other].endings]
    else:
        # Beyond the point the slip is no grazing one any more: the branch there has one crossing.
        beyond = continue_orbit(settled(alpha=1.3, gamma=4.4), "alpha", 1.35, points=4)
        (expected,) = (b.value for b in beyond.bifurcations if b.type == kinds.CROSSING)
        assert values_at(found[other], 4.4) == pytest.approx([expected], abs=1e-11)


def test_no_curve_leaves_a_cusp() -> None:
    ranges = ((0.04, 0.06), (0.193, 0.2))
    start = settled(alpha=0.049, omega=1.1, delta=0.1, beta=10.0, gamma=3.0, zeta=0.194)
    branch = continue_orbit(start, "alpha", 0.046, points=10)
    one = next(b for b in branch.bifurcations if b.type == kinds.FOLD)
    curve = continue_bifurcation(one, "zeta", ranges, points=5)
    (cusp,) = curve.codimension_two
    # The curve passes it smoothly, with folds on both of its sides.
    assert cusp.values == pytest.approx((0.0480574624443136, 0.194951952797834), abs=1e-12)
    assert np.array(ends(curve))[:, 1] == pytest.approx(0.193, abs=1e-12)
    assert orbits.curves_from(curve, ranges) == ()
