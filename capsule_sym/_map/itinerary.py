"""Order in which a cyclic itinerary is written."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from capsule_sym._parameters import CAPSULE, Scene


@cache
def _ranks(scene: Scene) -> dict[int, int]:
    """Ranks of the fields by number.

    The order is contact in front, contact behind, none; in each rest, forward, backward drift; of
    these first the high level of pulses.
    """
    facts = scene.facts

    def rank(field: int) -> tuple[int, ...]:
        contact, drift = facts.FIELDS[field]
        return not contact, contact, abs(drift), -drift, facts.LEVELS[field]

    return {field: place for place, field in enumerate(sorted(facts.FIELDS, key=rank))}


def cyclic_start(fields: Sequence[int], scene: Scene = CAPSULE) -> int:
    """Index of the segment with which the paper starts a cycle of a scene's fields.

    Its field is first in the order of contact in front, contact behind, none, and in each of rest,
    forward, backward drift. The next segments decide ties.
    """
    ranks = [_ranks(scene)[field] for field in fields]
    return min(range(len(ranks)), key=lambda i: ranks[i:] + ranks[:i])


def begun(fields: Sequence[int], scene: Scene = CAPSULE) -> list[int]:
    """The same cycle of fields, starting where the paper starts it."""
    first = cyclic_start(fields, scene)
    return [*fields[first:], *fields[:first]]
