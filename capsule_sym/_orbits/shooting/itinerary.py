"""The itinerary of a periodic motion: which fields in which order, and which guard ends each."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from capsule_sym._errors import InvalidInput
from capsule_sym._map.expansion import Guard
from capsule_sym._map.itinerary import cyclic_start
from capsule_sym._map.steady import SteadyMotion, abbreviated
from capsule_sym.generated.capsule.facts import FIELD_OF, FIELDS

_FRICTION = (Guard.DRIFT, Guard.UPPER, Guard.LOWER)
_OPPOSITE = {Guard.UPPER: Guard.LOWER, Guard.LOWER: Guard.UPPER}


def contact(field: int) -> int:
    """1 where the second spring is in contact (F4, F5, F6), else 0."""
    return FIELDS[field][0]


def drift(field: int) -> int:
    """Direction in which the capsule drifts: 1, 0 (it sticks) or -1."""
    return FIELDS[field][1]


def mirror(field: int) -> int:
    """The field of the mirror image (-x_r, -v_r, -v_c), without contact of the second spring."""
    return FIELD_OF[0, -drift(field)]


def guard_between(field: int, following: int) -> Guard:
    """The guard whose zero takes field F`field` over to F`following`.

    Raises InvalidInput where no single guard does.
    """
    if contact(field) != contact(following) and drift(field) == drift(following):
        return Guard.GAP
    if contact(field) == contact(following) and drift(field) != drift(following):
        if drift(field):
            return Guard.DRIFT
        return Guard.UPPER if drift(following) > 0 else Guard.LOWER
    raise InvalidInput(
        "itinerary", f"F{field} F{following}", "a succession that one guard brings about"
    )


@dataclass(frozen=True)
class ItinerarySegment:
    """One segment of an itinerary: its field F1 to F6, and the guard that ends it.

    There is no guard in an itinerary without switches.
    """

    field: int
    guard: Guard | None

    @property
    def image(self) -> ItinerarySegment:
        """The segment of the mirror image; it has no contact."""
        guard = self.guard and _OPPOSITE.get(self.guard, self.guard)
        return ItinerarySegment(mirror(self.field), guard)


@dataclass(frozen=True)
class Itinerary:
    """The segments of a motion's period in cyclic order, over `period_number` excitation periods.

    With `mirrored` they are those of the first half of a motion that is its own mirror image: the
    images of the segments follow them, the second spring is not in contact, `period_number` is odd.
    """

    segments: tuple[ItinerarySegment, ...]
    period_number: int = 1
    mirrored: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.period_number, bool) or not isinstance(self.period_number, int):
            raise InvalidInput("period_number", self.period_number, "a whole number >= 1")
        if self.period_number < 1:
            raise InvalidInput("period_number", self.period_number, "a whole number >= 1")
        if self.mirrored and self.period_number % 2 == 0:
            allowed = "odd for a motion that is its own mirror image"
            raise InvalidInput("period_number", self.period_number, allowed)

    @classmethod
    def of(cls, fields: Iterable[int], period_number: int = 1, mirrored: bool = False) -> Itinerary:
        """The itinerary of these fields; the guards follow from each field and the next one.

        Raises InvalidInput for a field that does not exist, a succession that no single guard
        brings about, and a single field other than stick.
        """
        order = tuple(fields)
        for field in order:
            if field not in FIELDS:
                raise InvalidInput("itinerary", order, "fields from 1 to 6")
        if len(order) == 1 and drift(order[0]) == 0:
            return cls((ItinerarySegment(order[0], None),), period_number, mirrored)
        if len(order) < 2 and not mirrored:
            raise InvalidInput("itinerary", order, "one sticking field, or two fields and more")
        following = (*order[1:], mirror(order[0]) if mirrored else order[0])
        segments = (
            ItinerarySegment(a, guard_between(a, b)) for a, b in zip(order, following, strict=True)
        )
        return cls(tuple(segments), period_number, mirrored)

    @classmethod
    def parse(cls, text: str, period_number: int = 1) -> Itinerary:
        """The itinerary written as "52", "F5 F2" or "F5,F2"; raises InvalidInput as `of` does."""
        if not re.fullmatch(r"\s*(F?[1-6][\s,]*)+", text):
            raise InvalidInput("itinerary", text, 'fields such as "F5 F2" or "52"')
        return cls.of((int(digit) for digit in re.findall(r"[1-6]", text)), period_number)

    @classmethod
    def of_motion(cls, motion: SteadyMotion) -> Itinerary:
        """The itinerary of a motion that the map has settled on."""
        return cls.of((segment.field for segment in motion.segments), motion.period_number)

    def __repr__(self) -> str:
        times = f", {self.period_number}" if self.period_number != 1 else ""
        return f"Itinerary({abbreviated(str(self))}{times})"

    def __len__(self) -> int:
        return len(self.segments)

    def __str__(self) -> str:
        """The cycle as it is written, wherever this itinerary begins."""
        return " ".join(self.whole.cyclic.names)

    @property
    def fields(self) -> tuple[int, ...]:
        """Numbers of the fields, such as (5, 2)."""
        return tuple(segment.field for segment in self.segments)

    @property
    def whole(self) -> Itinerary:
        """The itinerary of the whole motion, where this one is of its first half."""
        if not self.mirrored:
            return self
        segments = self.segments
        # Stick without an end is one segment.
        images = tuple(segment.image for segment in segments) if segments[0].guard else ()
        return Itinerary(segments + images, self.period_number)

    def neighbour(self, index: int) -> int:
        """The field at an index from -1, the segment before the first, to their number."""
        n = len(self.segments)
        field = self.segments[index % n].field
        return field if 0 <= index < n or not self.mirrored else mirror(field)

    def guard_before(self, index: int) -> Guard | None:
        """The guard that ends the segment before an index from 0."""
        before = self.segments[index - 1]
        return before.image.guard if self.mirrored and index == 0 else before.guard

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fields, such as ("F5", "F2")."""
        return tuple(f"F{segment.field}" for segment in self.segments)

    @property
    def first(self) -> int:
        """The segment at which the paper begins: in contact, at rest if there is such a segment."""
        return cyclic_start(self.fields)

    @property
    def cyclic(self) -> Itinerary:
        """The same cycle begun where the paper begins it, as it is written."""
        return self.rotated(self.first)

    def rotated(self, start: int) -> Itinerary:
        """The same cycle begun at segment `start`."""
        start %= len(self.segments)
        first = self.segments[:start]
        rest = tuple(segment.image for segment in first) if self.mirrored else first
        return replace(self, segments=self.segments[start:] + rest)

    def zeros(self, index: int) -> int:
        """How many derivatives of a segment's guard, from itself on, vanish at the segment's start.

        They do by the guard that ended the segment before: a gap that begins at 0, a capsule that
        begins at rest, and, after stick, with no acceleration either.
        """
        guard, before = self.segments[index].guard, self.segments[index - 1].guard
        if guard is Guard.GAP:
            return int(before is Guard.GAP)
        if guard is Guard.DRIFT and before in _FRICTION:
            return 1 if before is Guard.DRIFT else 2
        return 0
