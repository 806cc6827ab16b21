"""Checks of the segments and local maps named in Section 4, at its bifurcations and on lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from capsule_sym._symbolic.theory import SEGMENTS, leaves_of
from paper.claims.case_study import Itinerary, maps
from paper.claims.motions import Sides, changed
from paper.claims.space import crossing_sources
from paper.derived.local_maps import LocalMap

_WAYS = {1: "forward", -1: "backward", 0: "none"}


def drifts(maps: Sequence[LocalMap], way: str, table: Sequence[LocalMap]) -> bool:
    """Check that local maps, all printed in Table 3, are drifts in a direction."""
    return set(maps) <= set(table) and drift_of([one.field for one in maps], way)


def drift_of(fields: Sequence[int], way: str) -> bool:
    """Check that the capsule moves in a direction in fields."""
    return {_WAYS[SEGMENTS[field - 1].drift] for field in fields} == {way}


def impact_of(fields: Sequence[int], printed: Sequence[str]) -> bool:
    """Check that fields are, one by one, with or without contact."""
    return [("without", "with")[SEGMENTS[field - 1].contact] for field in fields] == list(printed)


def _features(itinerary: Itinerary) -> set[str]:
    """Fields, local maps, surfaces of impact and drifts of a motion, by their printed names."""
    local_maps = maps(itinerary)
    fields = [SEGMENTS[field - 1] for field in itinerary]
    return {
        *(f"F{field}" for field in itinerary),
        *map(str, local_maps),
        *(one.target.replace("Σ", "S") for one in local_maps if int(one.target[1:]) > 6),
        *(_WAYS[one.drift] for one in fields),
        *("impact" for one in fields if one.contact),
    }


def does_beyond(sides: Sides, how: str, what: str) -> bool:
    """Check that above a bifurcation a feature of the motion begins or ends."""
    below, above = _features(sides[2].first), _features(sides[2].second)
    found = {"begins": above - below, "ends": below - above}[how]
    return what in found and changed(sides) is not None


def segment_does(sides: Sides, colour: str, role: str, colours: Sequence[str]) -> bool:
    """Check what the segment in a colour does at a bifurcation.

    It meets the line, is inserted above it, or is a stick that has no duration there.
    """
    found, bracket = changed(sides), sides[2]
    if found is None:
        return False
    added = bracket.second.count(found.field) > bracket.first.count(found.field)
    stick = SEGMENTS[found.field - 1].stick
    fields = {"meets": found.hits, "inserted": found.field * added, "point": found.field * stick}
    return fields[role] > 0 and colours[fields[role] - 1] == colour


def indicates(local_map: LocalMap, pieces: Sequence[str], line: str) -> bool:
    """Check that a field reaches a plane on a line only, with a boundary-intersection crossing."""
    field = local_map.field
    reached = {name for name in pieces if any(field in f.may_arrive for f in leaves_of(name))}
    return reached == {line} and field in crossing_sources(line)


def modes(fields: Sequence[int]) -> Mapping[str, str]:
    """Modes of fields."""
    return {f"mode of F{field}": SEGMENTS[field - 1].mode for field in fields}
