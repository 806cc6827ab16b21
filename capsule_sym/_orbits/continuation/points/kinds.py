"""Types of bifurcations, and the place in state space of a border collision."""

from __future__ import annotations

from typing import NamedTuple

from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.changes import around
from capsule_sym._orbits.shooting.equations import STATES, SegmentFlow
from capsule_sym._orbits.shooting.itinerary import contact, drift, level
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import Scene

#: Index in z of the first segment's duration; state and forcing angle precede it.
DURATIONS = STATES + 1

GRAZING = "grazing"
ADDING = "adding-sliding"
GRAZING_SLIDING = "grazing-sliding"
CROSSING = "crossing-sliding"
SWITCHING = "switching-sliding"
CORNER = "boundary-intersection crossing"
EDGE = "edge"
FOLD = "fold"
PERIOD_DOUBLING = "period doubling"
NEIMARK_SACKER = "Neimark-Sacker"
SYMMETRY_BREAKING = "symmetry breaking"
RESONANCE_1_1, RESONANCE_1_2 = "1:1 resonance", "1:2 resonance"
CUSP = "cusp"
GENERALIZED_DOUBLING = "generalized period doubling"
DEGENERATE = "degenerate"

SMOOTH = (FOLD, PERIOD_DOUBLING, NEIMARK_SACKER)
#: Resonance on a Neimark-Sacker curve where both multipliers are those of this type.
RESONANCES = {FOLD: RESONANCE_1_1, PERIOD_DOUBLING: RESONANCE_1_2}


class EventType(NamedTuple):
    """Type of an event, its line, and the surfaces that meet there."""

    type: str
    line: str = ""
    surfaces: tuple[str, ...] = ()


HIGHER = EventType("corner of higher codimension")
#: Initials of each type, for the labels on a branch.
INITIALS = {
    FOLD: "FO",
    PERIOD_DOUBLING: "PD",
    NEIMARK_SACKER: "NS",
    SYMMETRY_BREAKING: "SB",
    GRAZING: "GR",
    ADDING: "AS",
    GRAZING_SLIDING: "GS",
    CROSSING: "CS",
    SWITCHING: "SS",
    CORNER: "BI",
    EDGE: "ED",
    HIGHER.type: "HC",
}
_SURFACES = {
    "L1": ("S1", "S2"),
    "L2": ("S2", "S3"),
    "L3": ("S4", "S5"),
    "L4": ("S5", "S6"),
    "L5": ("S1", "S4", "S7", "S9"),
    "L6": ("S2", "S5", "S7", "S9"),
    "L7": ("S2", "S5", "S8", "S10"),
    "L8": ("S3", "S6", "S8", "S10"),
    "L10": ("S1", "S4", "S8", "S10"),
    "O1": ("S1", "S2", "S4", "S5", "S7", "S9"),
    "O2": ("S2", "S3", "S5", "S6", "S8", "S10"),
}


def place(orbit: Orbit, segment: int) -> EventType:
    """Event at an orbit's segment of duration 0.

    Lines L1 to L4 have their part too, such as L3^(2); see `symbolic.appendices`.
    """
    itinerary, flow = orbit.itinerary, orbit.system.flows[segment]
    scene = itinerary.scene
    fields = around(itinerary, segment)
    if len({level(field, scene) for field in fields}) > 1:
        # A switch that meets an edge of the drive, or a slip that begins at one.
        guards = {itinerary.guard_before(segment), itinerary.segments[segment].guard}
        met = sorted(
            _met(one, contact(fields[0], scene), scene) for one in guards - {Guard.EDGE, None}
        )
        line = f"at {' and '.join(met)}" if met else ""
        return EventType(EDGE, line, tuple(sorted({f"S{field}" for field in fields})))
    (before, during, after) = ((contact(field, scene), drift(field, scene)) for field in fields)
    if before[0] != after[0]:
        if before[1] == after[1]:
            return HIGHER
        guards = {itinerary.guard_before(segment), itinerary.segments[segment].guard}
        line = _corner(guards, flow)
        return EventType(CORNER, line, _SURFACES[line])
    if during[0] != before[0]:
        if before != after:
            return HIGHER
        sign = before[1]
        surfaces = ("S2", "S5") if sign == 0 else ("S7", "S8") if sign > 0 else ("S9", "S10")
        return EventType(GRAZING, "L9", surfaces)
    kind = sliding(before[1], during[1], after[1])
    if kind is None:
        return HIGHER
    line = _edge(flow, during[0])
    return EventType(kind, f"{line}^({_part(flow, line)})", _SURFACES[line])


def _met(guard: Guard | None, side: int, scene: Scene) -> str:
    """Label of the quantity in a guard beside contact at a side, as in the declaration."""
    facts = scene.facts
    if guard in (Guard.GAP, Guard.BACK):
        behind = (guard is Guard.BACK) != (side == 2)
        return str(facts.LABELS[facts.STOPS[behind][0]])
    if guard is Guard.DRIFT:
        return f"{facts.LABELS[facts.STATE[2]]} 0"
    way = 1 if guard is Guard.UPPER else -1
    alike = "" if len({*facts.BOUNDS.values()}) > 1 else (" forward" if way > 0 else " backward")
    return f"{facts.LABELS[facts.BOUNDS[way]]}{alike}"


def sliding(before: int, during: int, after: int) -> str | None:
    """The bifurcation of a segment of duration 0 between drifts, None where these have no name."""
    if before == after:
        return GRAZING_SLIDING if before else ADDING
    if during == 0 and after == -before:
        return CROSSING
    return SWITCHING if during == -before and after == 0 else None


def _edge(flow: SegmentFlow, contact: int) -> str:
    """Edge of stick, L1 to L4, on which a segment begins."""
    force = flow.closed.margin + flow.c.friction
    return f"L{(1 if force > 0 else 2) + 2 * contact}"


def _part(flow: SegmentFlow, line: str) -> int:
    """Part number of L1 to L4, from the range of the force's rate under the forcing."""
    c, (_, v_r, _) = flow.c, flow.start
    side = 1 if line in ("L1", "L3") else -1
    turn, reach = -c.force_change(0, -c.friction_at(side)), c.force_change(0, c.alpha)
    speed = c.force_change(v_r, 0)
    return 1 if speed < turn - reach else 3 if speed > turn + reach else 2


def _corner(guards: set[Guard | None], flow: SegmentFlow) -> str:
    """Line or corner point on P1 = 0, P2 = delta where a segment between two guards begins."""
    if Guard.UPPER in guards:
        return "O1"
    if Guard.LOWER in guards:
        return "O2"
    c, (x_r, v_r, _) = flow.c, flow.start
    force = c.force(x_r, 0, v_r)
    if all(c.friction_guard(sign, force) > 0 for sign in (1, -1)):
        return "L6" if v_r > 0 else "L7"
    if v_r > 0:
        return "L5"
    return "L8" if force < 0 else "L10"
