"""The itinerary of a periodic motion: which fields in which order, and which guard ends each."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

from capsule_sym._errors import InvalidInput
from capsule_sym._map.expansion import Guard
from capsule_sym._map.itinerary import cyclic_start
from capsule_sym._map.steady import SteadyMotion, abbreviated
from capsule_sym._parameters import CAPSULE, Scene, as_scene

_FRICTION = (Guard.DRIFT, Guard.UPPER, Guard.LOWER)
_OPPOSITE = {Guard.UPPER: Guard.LOWER, Guard.LOWER: Guard.UPPER}
_OTHER_STOP = {Guard.GAP: Guard.BACK, Guard.BACK: Guard.GAP}
_BEHIND = 2  # contact at the second stop


def contact(field: int, scene: Scene = CAPSULE) -> int:
    """1 where the stop in front is in contact (F4, F5, F6), 2 where that behind is, else 0."""
    return scene.facts.FIELDS[field][0]  # type: ignore[no-any-return]


def drift(field: int, scene: Scene = CAPSULE) -> int:
    """Direction in which the capsule drifts: 1, 0 (it sticks) or -1."""
    return scene.facts.FIELDS[field][1]  # type: ignore[no-any-return]


def level(field: int, scene: Scene = CAPSULE) -> int:
    """Level of the drive: 1 at the low one of pulses, else 0."""
    return scene.facts.LEVELS[field]  # type: ignore[no-any-return]


def field_of(scene: Scene, contact: int, drift: int, level: int = 0) -> int:
    """Number of a field."""
    known = scene.facts.FIELD_OF
    return known[contact, drift] + level * len(known)  # type: ignore[no-any-return]


def mirror(field: int, scene: Scene = CAPSULE) -> int:
    """The field of the mirror image (-x_r, -v_r, -v_c), half a period later.

    Of one stop it is without contact; two change places, as high and low levels of pulses do.
    """
    facts = scene.facts
    opposite = (0, 2, 1)[contact(field, scene)] if len(facts.STOPS) > 1 else 0
    turned = 1 - level(field, scene) if facts.PULSED else 0
    return field_of(scene, opposite, -drift(field, scene), turned)


def guard_between(field: int, following: int, scene: Scene = CAPSULE) -> Guard:
    """The guard whose zero takes field F`field` over to F`following`.

    An edge of the drive may end rest, too. Raises InvalidInput where no single guard does.
    """
    touches, slides = (
        (contact(field, scene), contact(following, scene)),
        (drift(field, scene), drift(following, scene)),
    )
    kept, same_way = touches[0] == touches[1], slides[0] == slides[1]
    if level(field, scene) != level(following, scene):
        if kept and (same_way or not slides[0]):
            return Guard.EDGE
    elif not kept and same_way and 0 in touches:
        return Guard.BACK if touches[1] == _BEHIND else Guard.GAP
    elif kept and not same_way:
        if slides[0]:
            return Guard.DRIFT
        return Guard.UPPER if slides[1] > 0 else Guard.LOWER
    raise InvalidInput(
        "itinerary", f"F{field} F{following}", "a succession that one guard brings about"
    )


@dataclass(frozen=True)
class ItinerarySegment:
    """One segment of an itinerary: its field, such as F5, and the guard that ends it.

    There is no guard in an itinerary without switches.
    """

    field: int
    guard: Guard | None


@dataclass(frozen=True)
class Itinerary:
    """The segments of a motion's period in cyclic order, over `period_number` excitation periods.

    With `mirrored` they are those of the first half of a motion that is its own mirror image: the
    images of the segments follow them, a single stop is not in contact, `period_number` is odd.
    Fields are those of the scene.
    """

    segments: tuple[ItinerarySegment, ...]
    period_number: int = 1
    mirrored: bool = False
    scene: Scene = CAPSULE

    def __post_init__(self) -> None:
        if isinstance(self.period_number, bool) or not isinstance(self.period_number, int):
            raise InvalidInput("period_number", self.period_number, "a whole number >= 1")
        if self.period_number < 1:
            raise InvalidInput("period_number", self.period_number, "a whole number >= 1")
        if self.mirrored and self.period_number % 2 == 0:
            allowed = "odd for a motion that is its own mirror image"
            raise InvalidInput("period_number", self.period_number, allowed)
        edges = [one.guard for one in self.segments].count(Guard.EDGE) * (1 + self.mirrored)
        if edges != 2 * self.period_number and self.scene.facts.PULSED:
            allowed = f"half the number of edges of the drive, here {edges}"
            raise InvalidInput("period_number", self.period_number, allowed)

    @classmethod
    def of(
        cls,
        fields: Iterable[int],
        period_number: int = 1,
        mirrored: bool = False,
        scene: Scene = CAPSULE,
    ) -> Itinerary:
        """The itinerary of these fields; the guards follow from each field and the next one.

        Raises InvalidInput for a field that does not exist, a succession that no single guard
        brings about, and a single field other than stick.
        """
        order = tuple(fields)
        for field in order:
            if field not in scene.facts.FIELDS:
                raise InvalidInput(
                    "itinerary", order, f"fields from 1 to {len(scene.facts.FIELDS)}"
                )
        if len(order) == 1 and drift(order[0], scene) == 0 and not scene.facts.PULSED:
            return cls((ItinerarySegment(order[0], None),), period_number, mirrored, scene)
        if len(order) < 2 and not mirrored:
            raise InvalidInput("itinerary", order, "one sticking field, or two fields and more")
        following = (*order[1:], mirror(order[0], scene) if mirrored else order[0])
        segments = (
            ItinerarySegment(a, guard_between(a, b, scene))
            for a, b in zip(order, following, strict=True)
        )
        return cls(tuple(segments), period_number, mirrored, scene)

    @classmethod
    def parse(cls, text: str, period_number: int = 1, scene: Scene | str = CAPSULE) -> Itinerary:
        """The itinerary written as "52", "F5 F2" or "F5,F2"; raises InvalidInput as `of` does.

        Where a scene has more than nine fields, they are told apart by F, blanks or commas.
        """
        scene = as_scene(scene)
        few = len(scene.facts.FIELDS) < 10
        number = r"[1-9]" if few else r"[1-9]\d*"
        if not re.fullmatch(rf"\s*(F?{number}[\s,]*)+", text):
            raise InvalidInput("itinerary", text, 'fields such as "F5 F2" or "52"')
        fields = (int(digits) for digits in re.findall(number, text))
        return cls.of(fields, period_number, scene=scene)

    @classmethod
    def of_motion(cls, motion: SteadyMotion) -> Itinerary:
        """The itinerary of a motion that the map has settled on."""
        fields = (segment.field for segment in motion.segments)
        return cls.of(fields, motion.period_number, scene=motion.parameters.scene)

    def in_scene(self, scene: Scene) -> Itinerary:
        """The same itinerary in a scene with the same fields; raises InvalidInput for others."""
        if scene is self.scene:
            return self
        of, to = self.scene.facts, scene.facts
        if (of.FIELDS, of.LEVELS) != (to.FIELDS, to.LEVELS):
            raise InvalidInput("itinerary", str(self), f"one of the fields of {scene.shown}")
        return replace(self, scene=scene)

    def __repr__(self) -> str:
        times = f", {self.period_number}" if self.period_number != 1 else ""
        return f"Itinerary({abbreviated(str(self))}{times})"

    def __len__(self) -> int:
        return len(self.segments)

    def __str__(self) -> str:
        """The cycle as it is written, wherever this itinerary begins."""
        return " ".join(self.whole.cyclic.names)

    @cached_property
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
        images = tuple(map(self.image, segments)) if segments[0].guard else ()
        return Itinerary(segments + images, self.period_number, scene=self.scene)

    def image(self, segment: ItinerarySegment) -> ItinerarySegment:
        """The segment of the mirror image."""
        guard = segment.guard
        # A segment in contact ends at its own stop, which its image has too.
        pairs = _OPPOSITE if contact(segment.field, self.scene) else _OPPOSITE | _OTHER_STOP
        opposite = None if guard is None else pairs.get(guard, guard)
        return ItinerarySegment(mirror(segment.field, self.scene), opposite)

    def neighbour(self, index: int) -> int:
        """The field at an index from -1, the segment before the first, to their number."""
        n = len(self.segments)
        field = self.segments[index % n].field
        return field if 0 <= index < n or not self.mirrored else mirror(field, self.scene)

    def guard_before(self, index: int) -> Guard | None:
        """The guard that ends the segment before an index from 0."""
        before = self.segments[index - 1]
        return self.image(before).guard if self.mirrored and index == 0 else before.guard

    def turns(self, index: int) -> int:
        """Rises of the drive before a segment, each of which begins a turn of the forcing angle."""
        before = (one for one in self.segments[:index] if one.guard is Guard.EDGE)
        return sum(level(one.field, self.scene) for one in before)

    def stop(self, index: int) -> int:
        """The stop at which a segment of an index from -1 ends: 1 in front, 2 behind, 0 at none."""
        fields = self.scene.facts.FIELDS
        first, second = fields[self.neighbour(index)][0], fields[self.neighbour(index + 1)][0]
        return 0 if first == second else first or second

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fields, such as ("F5", "F2")."""
        return tuple(f"F{segment.field}" for segment in self.segments)

    @property
    def first(self) -> int:
        """The segment at which the paper begins: in contact, at rest if there is such a segment."""
        return cyclic_start(self.fields, self.scene)

    @property
    def cyclic(self) -> Itinerary:
        """The same cycle begun where the paper begins it, as it is written."""
        return self.rotated(self.first)

    def rotated(self, start: int) -> Itinerary:
        """The same cycle begun at segment `start`."""
        start %= len(self.segments)
        first = self.segments[:start]
        rest = tuple(map(self.image, first)) if self.mirrored else first
        return replace(self, segments=self.segments[start:] + rest)

    def zeros(self, index: int) -> int:
        """How many derivatives of a segment's guard, from itself on, vanish at the segment's start.

        They do by the guard that ended the segment before: a gap that begins at 0, a capsule that
        begins at rest, and, after stick, with no acceleration either, unless an edge breaks it.
        """
        guard, before = self.segments[index].guard, self.segments[index - 1].guard
        if guard in (Guard.GAP, Guard.BACK):
            return int(self.stop(index - 1) == self.stop(index))
        if guard is Guard.DRIFT and before is Guard.EDGE:
            return int(not drift(self.neighbour(index - 1), self.scene))
        if guard is Guard.DRIFT and before in _FRICTION:
            return 1 if before is Guard.DRIFT else 2
        return 0
