"""State at the end of a segment, with the facts known from its guards.

A guard that fired is exactly zero, whatever its rounded value. A guard that did not fire is proved
positive; if terms cancel, its computed value may still be zero or negative, which is no
information.
"""

from __future__ import annotations

from collections.abc import Iterator

from capsule_sym._errors import Outcome
from capsule_sym._map.backend import Number
from capsule_sym._map.expansion import Guard, pulsed, side_of, watched
from capsule_sym._map.location import Flow, SegmentStart, Switch
from capsule_sym._map.transitions import State
from capsule_sym._parameters import Scene


def tells(flow: Flow, switch: Switch) -> bool:
    """True if the computed state at the end of a segment has the signs that are proved."""
    return all(sign * getattr(switch.point, name) > 0 for name, sign, _ in _proved(flow, switch))


def _proved(flow: Flow, switch: Switch) -> Iterator[tuple[str, int, Number]]:
    """Quantities at a segment's end that are proved not to vanish: sign, and error of the value."""
    if switch.duration == 0 or switch.outcome is Outcome.UNDECIDED:
        return
    c, point, side = flow.c, switch.point, side_of(flow.c)
    if Guard.BACK in switch.guards and switch.outcome is Outcome.REGULAR:
        yield "v_r", -1, point.error_v
    elif Guard.BACK in watched(c) and Guard.BACK not in switch.guards:
        stays = flow.start.zeros.get(Guard.BACK, 0) == flow.backend.kernels.JET_ORDER
        if not stays:
            yield "other", 1, point.error_other
    if Guard.GAP not in switch.guards:
        # At rest on the impact surface the gap remains zero.
        if flow.start.zeros.get(Guard.GAP, 0) < flow.backend.kernels.JET_ORDER:
            yield "gap", side, point.error_x
    elif switch.outcome is Outcome.REGULAR:
        yield "v_r", -side, point.error_v
    if c.drift and Guard.DRIFT not in switch.guards:
        yield "v_c", c.drift, point.error_v_c


def reached(flow: Flow, switch: Switch, angle: Number) -> State:
    """State at the end of a segment.

    A proved sign that rounding hides is restored within the error bound.
    """
    c, point, zero = flow.c, switch.point, angle * 0
    for name, sign, error in _proved(flow, switch):
        if not sign * getattr(point, name) > 0 and error > 0:
            point = point._replace(**{name: sign * error})
            if name == "gap":
                point = point._replace(x_r=c.own_stop() + sign * error)
    v_c = point.v_c if c.drift else zero
    gap, back = (point.other, point.gap) if c.contact == 2 else (point.gap, point.other)
    state = State(point.x_r, gap, point.v_r, v_c, angle, back=back)
    if pulsed(c):
        state = state._replace(level=int(not c.high) ^ (Guard.EDGE in switch.guards))
    stops = [getattr(c, name) for name, _ in flow.backend.scene.facts.STOPS]
    for guard in switch.guards:
        if guard is Guard.BACK or (guard is Guard.GAP and c.contact == 2):
            state = state._replace(x_r=-stops[1], gap=-stops[1] - stops[0], back=zero)
        elif guard is Guard.GAP:
            state = state._replace(x_r=stops[0], gap=zero)
            if back is not None:
                state = state._replace(back=stops[0] + stops[1])
        elif guard is Guard.EDGE:
            continue
        elif guard is Guard.DRIFT:
            state = state._replace(v_c=zero)
        else:
            state = state._replace(bound=1 if guard is Guard.UPPER else -1)
    return state


def plane(scene: Scene, state: State, following: SegmentStart | None, edge: bool) -> str:
    """Switching plane of a state, Eq. (24); at rest of the capsule that of the successor field.

    At an edge of the drive it is that of the edge.
    """
    if following is None:
        return ""
    if edge:
        return f"Σ{scene.switching.EDGE_PLANES[state.level]}"
    if state.v_c == 0:
        return f"Σ{following.field}"
    signs = 1 if state.v_c > 0 else -1, 1 if state.v_r > 0 else -1
    return f"Σ{scene.switching.IMPACT_PLANES[1 if state.gap == 0 else 2, *signs]}"
