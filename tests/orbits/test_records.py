"""Convergence in records, with and without a result."""

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._map.backend import backend
from capsule_sym._orbits.continuation import locating
from capsule_sym._orbits.continuation.bifurcations import sorted_multipliers
from capsule_sym._orbits.continuation.conditions import EventSolution
from capsule_sym._orbits.continuation.kinds import PERIOD_DOUBLING
from capsule_sym._orbits.continuation.problem import Family
from capsule_sym._orbits.continuation.records import (
    bifurcation_record,
    bifurcation_rows,
    branch_record,
    codimension_two_rows,
    curve_record,
    curve_rows,
    failure_record,
    labelled_point,
    orbit_record,
    point_rows,
)
from capsule_sym._orbits.shooting.equations import shooting
from capsule_sym._records import dumps
from tests.orbits.branches import settled, upwards


def solved(record: dict) -> bool:
    """Check that all entries of a record agree on its convergence."""
    assert record["success"] is (record["status"] == "converged")
    assert record["iterations"] >= 0
    return record["success"]


def test_an_orbit_tells_how_well_its_equations_are_solved() -> None:
    orbit = settled(alpha=1.2)
    record = orbit_record(orbit)
    assert solved(record)
    assert 1 <= record["iterations"] <= 10
    assert record["residual"] < 1e-13
    # One digit off, it is none.
    z = orbit.z + 1e-6
    with backend("numpy") as numbers:
        system = shooting(numbers, orbit.values, orbit.itinerary, z)
    off = orbit_record(replace(orbit, z=z, system=system))
    assert not solved(off)
    assert off["residual"] == float(max(abs(system.residual))) > 1e-8


@pytest.mark.parametrize("name", ["state", "phase", "itinerary", "parameters"])
def test_a_record_of_no_orbit_is_refused_by_the_name_that_it_lacks(name: str) -> None:
    whole = orbit_record(settled(alpha=1.2))
    assert cs.results.orbit_from_record(whole).success
    with pytest.raises(cs.InvalidInput, match=f"must be of an orbit, with {name}$"):
        cs.results.orbit_from_record({key: value for key, value in whole.items() if key != name})
    without = {**whole, "parameters": {"alpha": 1.2}}
    with pytest.raises(cs.InvalidInput, match=r"with parameters\.omega, "):
        cs.results.orbit_from_record(without)
    with pytest.raises(cs.InvalidInput, match="of an orbit, whole"):
        cs.results.orbit_from_record({**whole, name: None})


def test_no_orbit_tells_where_newtons_method_ended() -> None:
    orbit = settled(alpha=1.2)
    found = cs.orbits.solve_itinerary((0.1, *orbit.values[1:]), orbit.itinerary, list(orbit.z))
    assert not found.success
    record = failure_record(found)
    assert not solved(record)
    assert record["status"] == found.status
    assert record["iterations"] > 0
    assert record["residual"] is None or record["residual"] > 1e-13


@lru_cache
def doubled() -> cs.results.Branch:
    """A short branch with a period doubling."""
    start = settled(alpha=1.2, beta=10.0, omega=0.965)
    return cs.continue_orbit(start, "omega", 0.98, points=4)


def first_doubling(branch: cs.results.Branch) -> cs.results.Bifurcation:
    return next(one for one in branch.bifurcations if one.type == PERIOD_DOUBLING)


def answer(monkeypatch: pytest.MonkeyPatch, answers: Iterable[EventSolution | None]) -> None:
    """Answers in place of those of Newton's method for a period doubling, as long as there are."""
    given, solve = iter(answers), Family.solved

    def solved(self: Family, orbit: cs.results.Orbit, names: tuple[str, ...], *rest: Any) -> Any:
        own = solve(self, orbit, names, *rest)
        return next(given, own) if PERIOD_DOUBLING in names else own

    monkeypatch.setattr(Family, "solved", solved)


@pytest.mark.parametrize("outside", [True, False])
def test_a_bifurcation_that_does_not_converge_says_so(monkeypatch, outside: bool) -> None:
    whole = first_doubling(doubled())
    # Newton's method finds none, or one that is not between the states.
    there = EventSolution(doubled().points[0].orbit, (), 0.0, (0.0,)) if outside else None
    answer(monkeypatch, repeat(there))
    branch = doubled.__wrapped__()
    one = first_doubling(branch)
    # The interval is still valid, and the uncertainty is the whole step.
    assert one.interval[0] < whole.value < one.interval[1]
    assert one.uncertainty > one.interval[1] - one.interval[0]
    record = next(
        one for one in branch_record(branch)["bifurcations"] if one["type"] == PERIOD_DOUBLING
    )
    assert not solved(record)
    assert record["residual"] == one.residual > 1e-9
    (row,) = (row for row in bifurcation_rows([one]))
    assert not solved(row)


def test_a_bifurcation_that_does_not_converge_at_first_is_found_from_nearer(monkeypatch) -> None:
    whole = first_doubling(doubled())
    answer(monkeypatch, [None, None])
    one = first_doubling(doubled.__wrapped__())
    assert one.success
    assert one.value == pytest.approx(whole.value, abs=1e-12)
    # As many halvings as requested.
    answer(monkeypatch, [None, None])
    monkeypatch.setattr(locating, "_ZERO_HALVINGS", 2)
    assert not first_doubling(doubled.__wrapped__()).success


def test_branches_and_curves_tell_of_every_point() -> None:
    branch = doubled()
    records = branch_record(branch)
    assert all(map(solved, records["points"]))
    assert all(map(solved, records["bifurcations"]))
    assert all(row["status"] == "converged" for row in point_rows(branch))
    assert any(record["iterations"] > 1 for record in records["points"])
    assert all(record["iterations"] > 1 for record in records["bifurcations"])
    sliding = upwards(3.3).bifurcations[-3]
    curves = [
        cs.continue_bifurcation(
            first_doubling(branch), "alpha", ((0.97, 0.98), (1.199, 1.201)), points=2
        ),
        cs.continue_bifurcation(sliding, "gamma", ((0.001, 2.0), (3.0, 3.3)), points=8),
    ]
    for curve in curves:
        record = curve_record(curve)
        assert all(map(solved, [*record["points"], *record["codimension_two"]]))
        assert all(point.residual >= float(point.orbit.residual) for point in curve.points)
    assert all(map(solved, codimension_two_rows(curves)))
    assert all(row["status"] == "converged" for row in curve_rows(curves))
    assert codimension_two_rows(curves)


@pytest.mark.parametrize("label", ["GR1", "GS1", "CS1"])
def test_a_record_has_the_multipliers_of_both_sides_of_a_border(label: str, tmp_path: Path) -> None:
    """The limits of motions that settle on each side; their own jump only at grazing-sliding."""
    branch = upwards(3.3)
    one = branch.at(label)
    assert isinstance(one, cs.results.Bifurcation)
    sides = [settled(alpha=one.value + side) for side in (-1e-9, 1e-9)]
    longer, shorter = sorted(sides, key=lambda orbit: -len(orbit.itinerary))
    record = bifurcation_record(one)
    for name, orbit in (("multipliers", longer), ("multipliers_without", shorter)):
        expected = sorted_multipliers(orbit)
        assert [complex(*pair) for pair in record[name]] == pytest.approx(expected, abs=1e-3)
    jump = abs(np.subtract(one.multipliers, one.multipliers_without)).max()
    assert (jump > 1e-2) == (label == "GS1")
    # A file holds no more digits of the orbit than are needed to have them again.
    file = tmp_path / "branch.json"
    file.write_text(dumps(branch_record(branch)))
    _, again = labelled_point(file, label)
    assert (again.type, again.segment is None) == (one.type, one.segment is None)
    again = replace(one, orbit=again.orbit, segment=again.segment)
    assert again.multipliers == pytest.approx(one.multipliers, abs=1e-12)
    assert again.multipliers_without == pytest.approx(one.multipliers_without, abs=1e-12)
