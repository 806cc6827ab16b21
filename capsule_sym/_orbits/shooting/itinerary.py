"""Itinerary of a periodic motion: its fields in order, and the guard that ends each segment."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

from capsule_sym._arguments import checked
from capsule_sym._errors import InvalidInput
from capsule_sym._map.expansion import Guard
from capsule_sym._map.itinerary import cyclic_start
from capsule_sym._map.steady import SteadyMotion, abbreviated
from capsule_sym._parameters import CAPSULE, Scene, as_scene

_OPPOSITE = {Guard.UPPER: Guard.LOWER, Guard.LOWER: Guard.UPPER}
_OTHER_STOP = {Guard.GAP: Guard.BACK, Guard.BACK: Guard.GAP}
_BEHIND = 2  # contact at the second stop


def contact(field: int, scene: Scene = CAPSULE) -> int:
    """1 in contact with the front stop (F4, F5, F6), 2 with the one behind, else 0."""
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
    """Field of the mirror image (-x_r, -v_r, -v_c), half a period later.

    With one stop it is without contact; two stops exchange places, as do high and low pulses.
    """
    facts = scene.facts
    opposite = (0, 2, 1)[contact(field, scene)] if len(facts.STOPS) > 1 else 0
    turned = 1 - level(field, scene) if facts.PULSED else 0
    return field_of(scene, opposite, -drift(field, scene), turned)


def guard_between(field: int, following: int, scene: Scene = CAPSULE) -> Guard:
    """Guard whose zero switches from field F`field` to F`following`.

    An edge of the drive may also end rest. Raises InvalidInput if no single guard does.
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
    raise InvalidInput("itinerary", f"F{field} F{following}", "two fields that one guard connects")


@dataclass(frozen=True)
class ItinerarySegment:
    """One segment of an itinerary: its field, such as F5, and the guard that ends it.

    There is no guard in an itinerary without switches.
    """

    field: int
    guard: Guard | None


@checked
@dataclass(frozen=True)
class Itinerary:
    """Segments of a motion's period in cyclic order, over `period_number` excitation periods.

    Each segment has its `field`, and the `guard` that ends it, None without switches.

    With `mirrored` they are those of the first half of a motion that is its own mirror image: the
    images of the segments follow them, a single stop is not in contact, and `period_number` is odd.
    Fields are those of the scene.

    The constructor raises InvalidInput for a period number that is below 1, even with `mirrored`,
    or not half the number of edges of pulses. `of` and `parse` also check that fields and guards
    fit each other, the constructor does not.
    """

    segments: tuple[ItinerarySegment, ...]
    period_number: int = 1
    mirrored: bool = False
    scene: Scene = CAPSULE

    def __post_init__(self) -> None:
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
    @checked
    def of(
        cls,
        fields: Iterable[int],
        period_number: int = 1,
        mirrored: bool = False,
        scene: Scene = CAPSULE,
    ) -> Itinerary:
        """Itinerary of these fields; each guard follows from a field and the next one.

        Raises InvalidInput for no field or one that does not exist, for two fields that no single
        guard connects, for one field alone unless it sticks without pulses or is `mirrored`, for
        contact with a single stop if `mirrored`, and for a period number as the constructor does.
        """
        order = tuple(fields)
        for field in order:
            if field not in scene.facts.FIELDS:
                raise InvalidInput(
                    "itinerary", order, f"fields from 1 to {len(scene.facts.FIELDS)}"
                )
            if mirrored and len(scene.facts.STOPS) == 1 and contact(field, scene):
                raise InvalidInput("itinerary", order, "without contact, in halves with one stop")
        if len(order) == 1 and drift(order[0], scene) == 0 and not scene.facts.PULSED:
            return cls((ItinerarySegment(order[0], None),), period_number, mirrored, scene)
        if len(order) < 2 - mirrored:
            raise InvalidInput("itinerary", order, "one sticking field, or at least two fields")
        following = (*order[1:], mirror(order[0], scene) if mirrored else order[0])
        segments = (
            ItinerarySegment(a, guard_between(a, b, scene))
            for a, b in zip(order, following, strict=True)
        )
        return cls(tuple(segments), period_number, mirrored, scene)

    @classmethod
    @checked
    def parse(cls, text: str, period_number: int = 1, scene: Scene | str = CAPSULE) -> Itinerary:
        """Itinerary from a text such as "52", "F5 F2" or "F5,F2"; raises InvalidInput as `of` does.

        In a scene with more than nine fields they are separated by F, blanks or commas.
        """
        scene = as_scene(scene)
        few = len(scene.facts.FIELDS) < 10
        number = r"[1-9]" if few else r"[1-9]\d?+(?!\d)"  # all digits, of which none is given back
        if not re.fullmatch(rf"\s*(F?{number}[\s,]*)+", text):
            raise InvalidInput("itinerary", text, 'fields such as "F5 F2" or "52"')
        fields = (int(digits) for digits in re.findall(number, text))
        return cls.of(fields, period_number, scene=scene)

    @classmethod
    @checked
    def of_motion(cls, motion: SteadyMotion) -> Itinerary:
        """Itinerary of a steady motion, not of the first half of a symmetric orbit.

        Raises InvalidInput as `of` does.
        """
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
        """Text of the cycle from its standard first field."""
        return " ".join(self.whole.cyclic.names)

    @cached_property
    def fields(self) -> tuple[int, ...]:
        """Numbers of the fields, such as (5, 2); those of the first half with `mirrored`."""
        return tuple(segment.field for segment in self.segments)

    @cached_property
    def possible(self) -> Itinerary:
        """This itinerary; raises InvalidInput as `of` unless it has fields that a motion can have.

        The guards are not compared.
        """
        Itinerary.of(self.fields, self.period_number, self.mirrored, self.scene)
        return self

    @property
    def whole(self) -> Itinerary:
        """Itinerary of the whole motion, if this one is of its first half."""
        if not self.mirrored:
            return self
        segments = self.segments
        # Stick without end is one segment.
        images = tuple(map(self.image, segments)) if segments[0].guard else ()
        return Itinerary(segments + images, self.period_number, scene=self.scene)

    def image(self, segment: ItinerarySegment) -> ItinerarySegment:
        """Mirror image of a segment; one in contact with a single stop has none."""
        guard = segment.guard
        # A segment in contact ends at its own stop; so does its image.
        pairs = _OPPOSITE if contact(segment.field, self.scene) else _OPPOSITE | _OTHER_STOP
        opposite = None if guard is None else pairs.get(guard, guard)
        return ItinerarySegment(mirror(segment.field, self.scene), opposite)

    def neighbour(self, index: int) -> int:
        """Field of a segment, also at -1 (before the first one) and at the number of segments.

        The itinerary is cyclic: these two are the last and the first field, with `mirrored` their
        mirror images.
        """
        n = len(self.segments)
        field = self.segments[index % n].field
        return field if 0 <= index < n or not self.mirrored else mirror(field, self.scene)

    def guard_before(self, index: int) -> Guard | None:
        """Guard that ends the segment before an index from 0."""
        before = self.segments[index - 1]
        return self.image(before).guard if self.mirrored and index == 0 else before.guard

    def turns(self, index: int) -> int:
        """Number of rises of a pulsed drive before a segment; each begins an excitation period."""
        before = (one for one in self.segments[:index] if one.guard is Guard.EDGE)
        return sum(level(one.field, self.scene) for one in before)

    def stop(self, index: int) -> int:
        """Stop touched or left where a segment ends: 1 in front, 2 behind, 0 for none.

        Index -1 is the segment before the first.
        """
        fields = self.scene.facts.FIELDS
        first, second = fields[self.neighbour(index)][0], fields[self.neighbour(index + 1)][0]
        return 0 if first == second else first or second

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fields, such as ("F5", "F2"); with `mirrored` of the first half."""
        return tuple(f"F{segment.field}" for segment in self.segments)

    @property
    def first(self) -> int:
        """Index of the paper's first segment: in contact, and at rest if there is such a one."""
        return cyclic_start(self.fields, self.scene)

    @property
    def cyclic(self) -> Itinerary:
        """The same cycle from its standard first segment."""
        return self.rotated(self.first)

    def rotated(self, start: int) -> Itinerary:
        """The same cycle from segment `start` on."""
        start %= len(self.segments)
        first = self.segments[:start]
        rest = tuple(map(self.image, first)) if self.mirrored else first
        return replace(self, segments=self.segments[start:] + rest)

    def vanishing(self, index: int) -> dict[Guard, int]:
        """Guards that vanish at a segment's start, from the guard that ended the segment before.

        Each has the number of derivatives, from itself on, that vanish. It is 1 for a gap that
        begins at 0, and for v_c after a landing or after a rest that an edge ends. It is 2 for v_c
        after any other rest, where v_c' is 0 too.
        """
        before, stop = self.guard_before(index), self.stop(index - 1)
        field = self.fields[index]
        if stop:
            free = not contact(field, self.scene)
            return {Guard.BACK if free and stop == _BEHIND else Guard.GAP: 1}
        if before is Guard.EDGE:
            starts = drift(field, self.scene) and not drift(self.neighbour(index - 1), self.scene)
            return {Guard.DRIFT: 1} if starts else {}
        if before is Guard.DRIFT:
            return {Guard.DRIFT: 1}
        return {Guard.DRIFT: 2} if before else {}

    def zeros(self, index: int) -> int:
        """Number of derivatives of a segment's guard, itself included, that vanish at its start."""
        guard = self.segments[index].guard
        return self.vanishing(index).get(guard, 0) if guard else 0
