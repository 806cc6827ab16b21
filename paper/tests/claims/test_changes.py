"""Types and lines of bifurcations from itineraries, against the run-time map's own."""

from __future__ import annotations

import pytest

from paper.claims.case_study import BRACKETS
from paper.claims.changes import Change, change, common, cyclic

_TOLD = (
    ("grazing", "L9"),
    ("adding-sliding", "L3"),
    ("boundary-intersection crossing", "L7"),
    ("adding-sliding", "L2"),
    ("boundary-intersection crossing", "L6"),
    ("crossing-sliding", "L3"),
    ("switching-sliding", "L2"),
    ("grazing-sliding", "L2"),
)
"""Types and lines that `orbits.bifurcations` finds on the branch of the case study."""


@pytest.mark.parametrize("gamma", BRACKETS)
def test_changes_of_the_case_study(gamma: str) -> None:
    for bracket, (kind, line) in zip(BRACKETS[gamma], _TOLD, strict=True):
        found = change(bracket.first, bracket.second)
        assert found
        assert (found.type, found.line) == (kind, line)
        back = change(bracket.second, bracket.first)
        assert back
        assert (back.type, back.line) == (kind, line)


def test_mirror_images() -> None:
    assert change((2,), (2, 1)) == Change("adding-sliding", "L1", 1, 2)
    assert change((6, 5, 6, 3), (6, 3)) == Change("grazing-sliding", "L4", 5, 6)
    assert change((3, 2, 1, 4), (3, 1, 4)) == Change("crossing-sliding", "L1", 2, 3)


def test_change_without_a_name() -> None:
    assert change((2, 5), (4, 1, 3, 6)) is None
    assert change((4, 1), (3, 6)) is None
    with pytest.raises(ValueError, match="2"):
        common((2,), (2, 5))


def test_a_cycle_has_no_first_leg() -> None:
    assert cyclic((5, 4, 1, 2)) == cyclic((1, 2, 5, 4))
    assert common((5, 4, 5, 2), (5, 4, 1, 2)) == cyclic((5, 4, 2))
