"""Names of switches: by the field entered, the field left, or the guard."""

from __future__ import annotations

from capsule_sym._design.sensitivities import ending_guard
from capsule_sym._errors import InvalidInput
from capsule_sym._map import Segment
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.itinerary import level
from capsule_sym._parameters import Scene

COLUMNS = ("entered", "left", "guard")
"""Ways to say what happens at a switch: the field entered, the field left, or the guard."""


def named(scene: Scene, by: str, event: object, row: int) -> str:
    """The name of what happens at a switch, as this module writes it."""
    text = str(event).strip()
    if by == "guard":
        if text.lower() in (allowed := [guard.value for guard in Guard]):
            return text.lower()
    else:
        modes = list(map(str, scene.facts.MODES))
        allowed = [f"F{k}" for k in scene.facts.FIELDS]
        number = text.upper().removeprefix("F")
        if f"F{number}" in allowed:
            return f"F{number}"
        if text.upper() in modes:
            return f"F{modes.index(text.upper()) + 1}"
        allowed = [f"{field} or {mode}" for field, mode in zip(allowed, modes, strict=True)]
    raise InvalidInput(f"{by} in row {row}", event, f"one of {', '.join(allowed)}")


def event_between(by: str, segment: Segment, following: Segment) -> str:
    """Name of the event between two segments."""
    if by == "guard":
        scene = segment.scene
        if level(segment.field, scene) != level(following.field, scene):
            return Guard.EDGE.value
        guard = ending_guard(segment.field, following.field, scene)
        return guard.value if guard else ""
    return following.name if by == "entered" else segment.name
