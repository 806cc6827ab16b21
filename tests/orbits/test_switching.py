"""From one branch to another: doubled orbits, folds, border collisions, labels, files."""

import json
import math
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._orbits.continuation import continue_orbits
from capsule_sym._orbits.continuation.kinds import FOLD, PERIOD_DOUBLING
from capsule_sym._orbits.continuation.records import branch_record
from capsule_sym._orbits.shooting.symmetry import same
from capsule_sym._records import dumps
from tests.orbits.branches import hysteretic, settled, upwards


@lru_cache
def light() -> cs.results.Branch:
    """A lightly damped branch with one period doubling."""
    return cs.continue_orbit(settled(alpha=0.03, zeta=0.005), "alpha", 0.3, points=20)


def difference(orbit: cs.results.Orbit) -> float:
    """Distance of the states at the start of two excitation periods."""
    run, period = orbit.trajectory(), orbit.parameters.period
    begin = float(run.origin[0].phase)
    return float(np.linalg.norm(run(begin) - run(begin + period)))


@pytest.mark.long
def test_the_doubled_branch_is_that_of_the_motion_that_settles() -> None:
    doubling = light().at("PD1")
    assert doubling.value == pytest.approx(0.04290361839719182, abs=1e-13)
    kept, doubled = cs.continue_from(light(), "PD1", 0.045, points=10)
    assert (kept.origin, doubled.origin) == ("PD1.1", "PD1.2")
    assert kept.points[-1].orbit.itinerary.period_number == 1
    assert abs(kept.points[-1].multipliers[0]) > 1
    # The map alone settles on the doubled orbit, from rest.
    assert same(doubled.points[-1].orbit, settled(alpha=0.045, zeta=0.005))
    # The doubled orbits leave the others like a square root.
    near = [p for p in doubled.points if 1e-6 < p.value - doubling.value < 2e-4]
    ratios = [difference(p.orbit) ** 2 / (p.value - doubling.value) for p in near]
    assert len(ratios) > 1
    assert max(ratios) < 1.05 * min(ratios)
    # On the side without stable doubled orbits only the branch itself continues.
    assert [
        one.points[-1].orbit.itinerary.period_number
        for one in cs.continue_from(light(), "PD1", 0.04)
    ] == [1]


@pytest.mark.long
def test_a_doubled_branch_says_where_it_arrives() -> None:
    first = hysteretic()
    (one,) = cs.orbits.period_doubling_cascade(first, 1, points=20)
    assert (one.origin, one.status) == ("PD1", cs.results.Status.PERIOD_HALVED)
    assert one.message.endswith("PD2 of the first branch")
    end, known = one.bifurcations[-1], first.at("PD2")
    assert end.type == PERIOD_DOUBLING
    assert abs(end.value - known.value) <= end.uncertainty + known.uncertainty
    # Half way the map settles on a motion of two periods that the branch passes through.
    omega = (first.at("PD1").value + known.value) / 2
    orbit = settled(alpha=1.2, beta=10.0, omega=omega)
    assert orbit.itinerary.period_number == 2
    (_, there) = cs.continue_from(first, "PD1", omega, points=10)
    assert same(there.points[-1].orbit, orbit)


def test_a_fold_is_left_on_both_sides_of_it() -> None:
    fold = hysteretic().at("FO1")
    found = cs.continue_from(hysteretic(), "FO1", 0.86522, points=4)
    assert len(found) == 2
    norms = sorted(abs(one.points[0].multipliers[0]) for one in found)
    assert norms[0] < 1 < norms[1]
    with pytest.raises(cs.InvalidInput, match="no branch starts at FO1 that way"):
        cs.continue_from(hysteretic(), "FO1", fold.value + 0.01)


@pytest.mark.long
def test_every_border_collision_is_left_to_the_words_on_its_sides() -> None:
    branch = upwards(3.3)
    for one in branch.bifurcations:
        for side, itinerary in ((-1e-3, one.itinerary_before), (1e-3, one.itinerary_after)):
            (found,) = cs.continue_from(branch, one.label, one.value + side, points=1)
            assert found.status is cs.results.Status.REACHED
            assert str(found.points[0].orbit.itinerary) == str(itinerary), (one.label, side)


def test_a_symmetric_motion_is_gone_on_from_in_pairs() -> None:
    branch = cs.continue_orbit(settled(alpha=0.3, delta=1.2), "alpha", 0.5, points=5)
    for label, side, itinerary in (("AS1", 0.01, "F2 F1 F2 F3"), ("AS1", -0.01, "F2")):
        to = branch.at(label).value + side
        (found,) = cs.continue_from(branch, label, to, points=1)
        assert str(found.points[-1].orbit.itinerary) == itinerary
    (found,) = cs.continue_from(branch, "GR1", 0.3, points=2)
    assert [one.label for one in found.bifurcations] == ["AS1"]
    known = branch.at("AS1")
    assert abs(found.at("AS1").value - known.value) <= 2 * known.uncertainty + 1e-14


def test_labels_count_each_type_and_name_the_ends() -> None:
    branch = hysteretic()
    labels = [one.label for one in branch.bifurcations]
    assert labels[:6] == ["GS1", "BI1", "BI2", "AS1", "FO1", "CS1"]
    assert len(set(labels)) == len(labels)
    assert branch.at("FO2").type == FOLD
    assert branch.at("EP1") is branch.points[0]
    assert branch.at("EP2") is branch.points[-1]
    with pytest.raises(cs.InvalidInput, match=r"label = 'PD9': must be one of GS1, BI1,"):
        branch.at("PD9")


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("branch") / "branch.json"
    path.write_text(dumps(branch_record(light())))
    return path


@pytest.mark.parametrize("label", ["PD1", "EP2"])
def test_a_file_goes_on_as_its_branch_does(file: Path, label: str) -> None:
    from_file = cs.continue_from(file, label, 0.035, points=2)
    from_branch = cs.continue_from(light(), label, 0.035, points=2)
    for one, other in zip(from_file, from_branch, strict=True):
        assert one.origin == other.origin
        assert one.origin.split(".")[0] == label
        assert one.points[-1].orbit.z == pytest.approx(other.points[-1].orbit.z, abs=1e-10)


def test_another_parameter_can_be_gone_on_in(file: Path) -> None:
    for one in cs.continue_from(file, "PD1", 0.02, parameter="zeta", points=2):
        assert one.parameter == "zeta"
        assert one.points[-1].orbit.parameters.alpha == light().at("PD1").value
        assert one.points[-1].value == pytest.approx(0.02)


def test_branches_that_leave_are_gone_on_from_by_both_labels(tmp_path: Path) -> None:
    (doubled,) = cs.orbits.period_doubling_cascade(light(), 1, points=20)
    path = tmp_path / "branch.json"
    path.write_text(dumps(branch_record(light(), [doubled])))
    known = doubled.bifurcations[0]
    to = known.value - 1e-3
    for one, other in zip(
        cs.continue_from(path, f"PD1/{known.label}", to, points=2),
        cs.continue_from(doubled, known.label, to, points=2),
        strict=True,
    ):
        assert one.points[-1].orbit.itinerary.period_number == 2
        assert one.points[-1].orbit.z == pytest.approx(other.points[-1].orbit.z, abs=1e-10)
    with pytest.raises(cs.InvalidInput, match=r"PD1/EP2"):
        cs.continue_from(path, "PD7", to)


def test_a_doubling_whose_orbits_are_not_found_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(continue_orbits, "_doubled", lambda *_: None)
    (lost,) = cs.orbits.period_doubling_cascade(light(), 1)
    assert (lost.origin, lost.status, lost.points) == ("PD1", cs.results.Status.NOT_CONVERGED, ())
    assert lost.message == "no doubled orbit is found beside PD1"
    assert json.loads(dumps(branch_record(light(), [lost])))["switched"][0]["points"] == []


def test_what_does_not_change_with_the_parameter_is_told() -> None:
    # Without contact the stiffness of the second spring is all the same.
    branch = cs.continue_orbit(settled(alpha=0.3, delta=1.2), "alpha", 0.4, points=4)
    with pytest.raises(cs.InvalidInput, match="a point from which a branch in"):
        cs.continue_from(branch, "AS1", 2.0, parameter="beta")


def test_functions_that_no_file_holds_are_asked_for_again(tmp_path: Path) -> None:
    ties = {"alpha": lambda omega: 1.25 * omega}
    branch = cs.continue_orbit(settled(alpha=0.625, omega=0.5), "omega", 0.52, points=2, ties=ties)
    path = tmp_path / "branch.json"
    path.write_text(dumps(branch_record(branch)))
    with pytest.raises(cs.InvalidInput, match=r"ties = \['alpha'\]: must be given again"):
        cs.continue_from(path, "EP2", 0.54)
    (found,) = cs.continue_from(path, "EP2", 0.54, ties=ties, points=2)
    assert found.points[-1].orbit.parameters.alpha == pytest.approx(1.25 * 0.54)


def damaged(file: Path, **changes: object) -> str:
    return json.dumps(json.loads(file.read_text()) | changes)


def wrong_points(file: Path) -> Iterator[dict[str, Any]]:
    """The doubling of a file with numbers that no orbit has."""
    (one, *_) = json.loads(file.read_text())["bifurcations"]
    yield one | {"segment": 99}
    for changes in (
        {"period_number": 10**9},
        {"state": [math.nan, 0.0, 0.0]},
        {"parameters": one["orbit"]["parameters"] | {"alpha": 10**400}},
    ):
        yield one | {"orbit": one["orbit"] | changes}


def test_what_is_no_branch_of_this_format_is_refused_in_one_line(file: Path, tmp_path) -> None:
    other = tmp_path / "other.json"
    for text, itineraries in (
        (damaged(file, format=1), "format = 1: must be 4"),
        ("{}", "a branch.json that"),
        ("[1", "JSON that"),
        (damaged(file, bifurcations=[{"label": "PD1"}]), "an undamaged branch.json"),
        *(
            (damaged(file, bifurcations=[one]), "an undamaged branch.json")
            for one in wrong_points(file)
        ),
    ):
        other.write_text(text)
        with pytest.raises(cs.InvalidInput, match=itineraries):
            cs.continue_from(other, "PD1", 0.1)
    with pytest.raises(cs.InvalidInput, match="readable"):
        cs.continue_from(tmp_path / "none.json", "PD1", 0.1)
    with pytest.raises(cs.InvalidInput, match=r"alpha = -1\.0: must be finite and >= 0"):
        cs.continue_from(file, "PD1", -1.0)
    with pytest.raises(cs.InvalidInput, match="one of PD1, EP1, EP2"):
        cs.continue_from(file, "GR1", 0.1)
