"""Codimension two in balls: against curves followed in doubles, and with proofs undone."""

from __future__ import annotations

from dataclasses import replace

import pytest

from capsule_sym import continue_bifurcation
from capsule_sym._enclosures.numbers.balls import Unproved, arb, precision
from capsule_sym._enclosures.orbits.krawczyk import Tube
from capsule_sym.results import Curve
from paper.proofs import codimension_two
from paper.proofs.case import EXACT
from paper.proofs.codimension_two import (
    ProvedPoint,
    prove_codimension_two,
    record,
)
from tests.orbits.branches import upwards


@pytest.fixture(scope="module")
def curves() -> dict[str, Curve]:
    """The curves of the last three bifurcations, between the two mass ratios and beyond."""
    chosen = [one for one in upwards(3.3).bifurcations if one.label in ("CS1", "SS1", "GS1")]
    return {
        one.type: continue_bifurcation(one, "gamma", ((1.4, 1.7), (3.0, 3.3))) for one in chosen
    }


@pytest.fixture(scope="module")
def proved(curves: dict[str, Curve]) -> list[ProvedPoint]:
    found = curves["crossing-sliding"].codimension_two
    return [
        prove_codimension_two(one, EXACT) for one in sorted(found, key=lambda one: one.values[1])
    ]


@pytest.mark.long
def test_both_points_are_those_that_the_curves_meet_at(proved, curves) -> None:
    lower, upper = proved
    assert lower.event.type == "switching-sliding and crossing-sliding"
    assert upper.event.type == "grazing-sliding and crossing-sliding"
    for one, other in zip(proved, ("switching-sliding", "grazing-sliding"), strict=True):
        values = one.event.values
        assert max(float(value.rad()) for value in values.values()) < 1e-90
        # Found once more, on the other curve.
        (same,) = (m for m in curves[other].codimension_two if "crossing-sliding" in m.types)
        for name, value, doubt in zip(values, same.values, same.uncertainties, strict=True):
            assert abs(float(values[name]) - value) <= doubt + 1e-15


def test_slopes_are_those_of_the_curves_nearby(proved, curves) -> None:
    """The crossing-sliding orbits without the other event's segment lie outside the two points."""
    for one, side in zip(proved, (-1, 1), strict=True):
        alpha, gamma = (float(value) for value in one.event.values.values())
        near = [
            (a - alpha) / (g - gamma)
            for a, g in (point.values for point in curves["crossing-sliding"].points)
            if 1e-4 < side * (g - gamma) < 0.05
        ]
        slope = float(one.slopes[1])
        assert len(near) > 2
        assert min(abs(found - slope) for found in near) < 0.05 * abs(slope)


def test_a_record_is_decimals(proved) -> None:
    told = record(proved[0])
    assert told["gamma"].startswith("3.09552784384999")
    assert len(told["alpha"]) > 30
    assert told["slopes"][0] < told["slopes"][1] < 0


def test_curves_that_touch_are_not_seen_to_cross(proved, curves, monkeypatch) -> None:
    found = curves["crossing-sliding"].codimension_two[0]
    monkeypatch.setattr(codimension_two, "_slope", lambda *_: arb(1))
    with pytest.raises(Unproved, match="not seen to cross"):
        prove_codimension_two(found, EXACT)


def test_a_slope_is_that_of_the_point_s_own_orbit(proved, monkeypatch) -> None:
    event = proved[0].event
    monkeypatch.setattr(Tube, "holds", lambda self, columns: False)
    with precision(320), pytest.raises(Unproved, match="not seen to be that of the other side"):
        codimension_two._slope(event.tube, *event.segments)


def test_one_leg_is_no_meeting(curves) -> None:
    curve = curves["crossing-sliding"]
    single = replace(curve.codimension_two[0], orbit=curve.points[0].orbit)
    with pytest.raises(Unproved, match="1 segments have the duration 0"):
        prove_codimension_two(single, EXACT)
