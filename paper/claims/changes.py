"""Bifurcation between two motions, its type and line, from their itineraries.

By the definitions of Figs. 4 and 5: adding-sliding inserts a drift into stick; grazing-sliding
takes the stick out of one drift, crossing-sliding out of two opposite ones; switching-sliding lets
a drift end in the opposite one in place of stick; a boundary-intersection crossing replaces the
field between a drift and a stick of the other contact; grazing adds a contact.
"""

from __future__ import annotations

from dataclasses import dataclass

from capsule_sym._symbolic.theory import (
    SEGMENTS,
    Linear,
)

Itinerary = tuple[int, ...]
"""Fields of one period in order of time."""


@dataclass(frozen=True)
class Change:
    """A bifurcation by its type and line; `field` is the one inserted, removed or replaced.

    `hits` is the field of the segment that meets the line.
    """

    type: str
    line: str
    field: int
    hits: int


def cyclic(itinerary: Itinerary) -> Itinerary:
    """Least rotation of a cycle."""
    return min(itinerary[i:] + itinerary[:i] for i in range(len(itinerary)))


def _edge(contact: int, drift: int) -> str:
    """Line on which stick ends in a drift."""
    return f"L{(1 if drift > 0 else 2) + 2 * contact}"


def _fields(*indices: int) -> tuple[Linear, ...]:
    return tuple(SEGMENTS[index - 1] for index in indices)


def _shortened(longer: Itinerary, shorter: Itinerary) -> Change | None:
    """Bifurcation that removes one or two segments from an itinerary."""
    n = len(longer)
    for i in range(n):
        turned = longer[i:] + longer[:i]
        before, gone, after = _fields(turned[-1], turned[0], turned[1 % n])
        if turned[-1] == turned[1 % n]:  # x gone x becomes x
            rest = turned[2:]
            if cyclic(rest or (turned[-1],)) != cyclic(shorter):
                continue
            if gone.contact != before.contact:
                return Change("grazing", "L9", gone.index, before.index)
            if before.stick:
                line = _edge(gone.contact, gone.drift)
                return Change("adding-sliding", line, gone.index, before.index)
            if gone.stick:
                line = _edge(gone.contact, before.drift)
                return Change("grazing-sliding", line, gone.index, before.index)
        elif (
            cyclic(turned[1:]) == cyclic(shorter)
            and before.contact == gone.contact == after.contact
        ):
            if gone.stick and before.drift == -after.drift:
                line = _edge(gone.contact, after.drift)
                return Change("crossing-sliding", line, gone.index, before.index)
            if after.stick and before.drift == -gone.drift:
                line = _edge(gone.contact, gone.drift)
                return Change("switching-sliding", line, gone.index, before.index)
    return None


def _replaced(first: Itinerary, second: Itinerary) -> Change | None:
    """Bifurcation that replaces one segment between a drift and stick of the other contact."""
    if len(first) != len(second):
        return None
    n = len(first)
    turns = [first[i:] + first[:i] for i in range(n)]
    for turn in (second[i:] + second[:i] for i in range(n)):
        for mine in turns:
            if mine[1:] != turn[1:] or mine[0] == turn[0]:
                continue
            before, after, one, other = _fields(mine[-1], mine[1], mine[0], turn[0])
            crossing = before.contact != after.contact and one.contact != other.contact
            if crossing and after.stick:
                line = "L6" if after.contact else "L7"
                return Change("boundary-intersection crossing", line, other.index, before.index)
    return None


def change(first: Itinerary, second: Itinerary) -> Change | None:
    """Bifurcation between two itineraries; None if it has no name."""
    if len(first) == len(second):
        return _replaced(first, second)
    longer, shorter = sorted((first, second), key=len, reverse=True)
    return _shortened(longer, shorter)


def common(first: Itinerary, second: Itinerary) -> Itinerary:
    """Itinerary at a boundary-intersection crossing: the replaced segment has no duration."""
    found = change(first, second)
    if found is None or found.type != "boundary-intersection crossing":
        raise ValueError((first, second))
    n = len(second)
    itineraries = {
        cyclic(second[:i] + second[i + 1 :]) for i in range(n) if second[i] == found.field
    }
    others = {cyclic(first[:i] + first[i + 1 :]) for i in range(len(first))}
    (itinerary,) = itineraries & others
    return itinerary
