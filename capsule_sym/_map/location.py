"""Location of the first switch of a segment, certified: a bound excludes every earlier time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from capsule_sym._errors import Outcome
from capsule_sym._map import quasistatic
from capsule_sym._map.backend import Backend, Number
from capsule_sym._map.course import Course
from capsule_sym._map.expansion import (
    Expansion,
    Guard,
    Point,
    amplitude_of,
    expand,
    pulsed,
    reaction_of,
    watched,
)
from capsule_sym._map.isolation import Search, polish, positive_at, search
from capsule_sym._native import Watch

_REACH = 3  # longest trial step of an expansion, over the fastest rate of the segment
_SHRINK = 8
_SHORTEST = 1e-250  # shortest duration considered, over the fastest rate
_MOST_EVALUATIONS = 200_000
# A step shorter than this, relative to the time passed and to the segment's own time scale, hardly
# advances. Steps towards a close miss and away from it are short, but at least double or halve.
_SHORT = 2.0**-20
_LONG_REST = 8  # periods of rest from which on its energy is of use


Tangency = tuple[Outcome, Number]
"""Guard that came within its error bound of zero and turned back, some time after the start.

GRAZE for the gap (line L9), SLIDING_TANGENCY for friction's guards (lines L1 to L4). This precision
cannot decide if it touched, missed, or crossed twice.
"""


@dataclass(frozen=True)
class End:
    """End of a segment: time, guards that fired, state, and outcome.

    `guards` is empty where none fired (END, NEVER, STALLED, UNDECIDED). `duration` is the time from
    the segment's start. `evaluations` counts evaluations of the closed form.
    """

    outcome: Outcome
    guards: tuple[Guard, ...]
    duration: Number
    point: Point
    evaluations: int
    tangencies: tuple[Tangency, ...] = ()

    @property
    def certain(self) -> bool:
        """True if nothing about it is undecided at its precision."""
        return self.outcome in _CERTAIN and not self.tangencies


_CERTAIN = (Outcome.REGULAR, Outcome.END, Outcome.NEVER)


def locate(flow: Course, limit: Number, watch: Watch | None = None) -> End:
    """First switch of the segment within (0, limit]; for pulses, up to the next edge instead.

    A switch that cannot be distinguished from the edge is a CORNER with it. Otherwise it is that of
    `_locate_guard`, or REGULAR at the time of the edge.
    """
    if not pulsed(flow.c):
        return _locate_guard(flow, limit, watch)
    edge, error = flow.to_edge()
    at_edge = End(Outcome.REGULAR, (Guard.EDGE,), edge, flow.origin, flow.evaluations)
    if edge == 0:
        return at_edge
    # The edge may lie anywhere within its error: positive up to here covers all cases.
    found = _locate_guard(flow, edge + error, watch)
    on_the_way = tuple(one for one in found.tangencies if one[1] < edge)
    if found.outcome in (Outcome.END, Outcome.NEVER):
        point = flow(edge)
        return replace(at_edge, point=point, evaluations=flow.evaluations, tangencies=on_the_way)
    off = max((_time_error(flow, guard, found.duration) for guard in found.guards), default=error)
    if found.duration + off < edge - error:
        return found
    guards = (*found.guards, Guard.EDGE)
    return replace(found, outcome=Outcome.CORNER, guards=guards, tangencies=on_the_way)


def _locate_guard(flow: Course, limit: Number, watch: Watch | None = None) -> End:
    """First time within (0, limit] at which a guard of the segment vanishes.

    The outcome is REGULAR (one guard crosses zero), CORNER (two cross and cannot be distinguished),
    GRAZE or SLIDING_TANGENCY (a guard is zero within its error bound, as is its slope, and is not
    seen to turn back; touches that turn back are passed and listed in `tangencies`),
    NEVER (proved: no guard fires at any later time), END (proved: none fires up to the limit),
    STALLED (given up since steps do not advance), or UNDECIDED (given up after very many
    evaluations, or stopped by the watch).
    """
    backend, c = flow.backend, flow.c
    unit = backend.unit
    now, at = limit * 0, flow.origin
    zeros: Mapping[Guard, int] = flow.start.zeros
    tangencies: list[Tangency] = []
    reach = _REACH / c.rate
    short, most_short = 0, -2 * math.log2(unit)
    # A guard that vanishes with all its derivatives stays zero: rest on the impact surface.
    guards = [g for g in watched(c) if zeros.get(g, 0) < backend.kernels.JET_ORDER]
    while True:
        if flow.evaluations > _MOST_EVALUATIONS or (watch and watch.over):
            return End(Outcome.UNDECIDED, (), now, at, flow.evaluations, tuple(tangencies))
        if short > most_short:
            return End(Outcome.STALLED, (), now, at, flow.evaluations, tuple(tangencies))
        if at_rest_forever(backend, c, at):
            return End(Outcome.NEVER, (), limit, flow(limit), flow.evaluations, tuple(tangencies))
        expansions = expand(backend, c, at)
        smallest = 4 * unit * max(now, _SHORTEST / c.rate)
        ahead = min(max(reach, smallest), limit - now)
        searches: dict[Guard, Search] = {}
        blocked = guards
        while True:
            for guard in blocked:
                searches[guard] = search(expansions[guard], zeros.get(guard, 0), ahead, unit)
            found = {g: s for g, s in searches.items() if s.bracket is not None}
            blocked = [g for g in guards if searches[g].clear < ahead and g not in found]
            horizon = min(s.clear for s in searches.values())
            # A guard within its error of zero now remains so on every shorter interval.
            if (
                horizon > 0
                or ahead <= smallest
                or any(_hidden(expansions[g], zeros.get(g, 0)) for g in blocked)
            ):
                break
            ahead = max(ahead / _SHRINK, smallest)
        if found:
            switch = _first(flow, now, searches, found)
            if switch is not None:
                return replace(switch, tangencies=tuple(tangencies))
        further = horizon
        if 0 < horizon < limit - now and not (zeros and now == 0):
            further = max(horizon, _further(flow, guards, at, limit - now))
        if further > horizon:
            horizon = further
        elif horizon < ahead and horizon <= 4 * unit * now:
            stuck = [guard for guard in guards if searches[guard].clear < ahead]
            turned = None
            if not found.keys() & stuck:
                stuck = [guard for guard in stuck if searches[guard].clear <= 4 * unit * now]
                most = min(1 / c.rate, limit - now)
                turned = _turning(expansions, stuck, smallest, most, unit)
            if turned is None:
                outcome = Outcome.CORNER if len(stuck) > 1 else _tangency(stuck[0])
                return End(outcome, tuple(stuck), now, at, flow.evaluations, tuple(tangencies))
            tangencies += [(_tangency(guard), now) for guard in stuck]
            horizon = turned
        if now + horizon >= limit:
            # A state that rests forever does so at the end too, whatever the instant of the
            # expansions.
            last = flow(limit)
            outcome = Outcome.NEVER if at_rest_forever(backend, c, last) else Outcome.END
            return End(outcome, (), limit, last, flow.evaluations, tuple(tangencies))
        # Double the next step if the whole of the last was cleared, else the cleared length.
        reach = 2 * ahead if horizon >= ahead else 2 * horizon
        short = short + 1 if horizon < _SHORT * min(now, 1 / c.rate) else 0
        now, zeros = now + horizon, {}
        at = flow(now)


def _hidden(expansion: Expansion, zeros: int) -> bool:
    """True if the rest after division by the zeros is not above its error at the start."""
    return bool(expansion.values[zeros] <= expansion.errors[zeros])


def _further(flow: Course, guards: list[Guard], at: Point, most: Number) -> Number:
    """Duration, up to `most`, in which other bounds than an expansion exclude a switch.

    Of the forced response alone, with an overdamped segment's slow mode while that is large and
    without it once it has decayed; and of a long rest by its energy.
    """
    backend, c = flow.backend, flow.c
    longest = min(_resting(backend, c, at), most)
    for with_slow in (True, False) if c.q < 0 else (True,):
        rate = quasistatic.rate(c, with_slow)
        if rate is None:
            continue
        expansions = quasistatic.expand_forced(backend, c, at, with_slow=with_slow)
        ahead = min(_REACH / rate, most)
        # Below the segment's own reach the expansion of the whole motion does as well.
        while ahead > max(longest, _REACH / c.rate):
            clear = min(search(expansions[g], 0, ahead, backend.unit).clear for g in guards)
            if clear > 0:
                longest = max(longest, clear)
                break
            ahead = ahead / _SHRINK
    return longest


def _tangency(guard: Guard) -> Outcome:
    return Outcome.GRAZE if guard in (Guard.GAP, Guard.BACK) else Outcome.SLIDING_TANGENCY


def _turning(
    expansions: Mapping[Guard, Expansion],
    stuck: list[Guard],
    least: Number,
    most: Number,
    unit: Number,
) -> Number | None:
    """Duration after which guards that are zero within their error are certainly positive again.

    Meanwhile each of them stays above minus a few times its error, and every other guard is proved
    positive. None if there is no such duration: a guard crosses.
    """
    lifted = dict(expansions)
    for guard in stuck:
        e = expansions[guard]
        lifted[guard] = replace(e, values=[e.values[0] + 4 * e.errors[0], *e.values[1:]])
    step = most
    while step > least:
        if all(positive_at(expansions[guard], step, unit) for guard in stuck) and all(
            search(e, 0, step, unit).clear >= step for e in lifted.values()
        ):
            return step
        step = step / _SHRINK
    return None


def _first(
    flow: Course, now: Number, searches: Mapping[Guard, Search], found: Mapping[Guard, Search]
) -> End | None:
    """Switch, if one bracket precedes all other candidates; None if that is undecided."""
    brackets = {guard: s.bracket for guard, s in found.items() if s.bracket is not None}
    first = min(brackets, key=lambda guard: brackets[guard][1])
    end = brackets[first][1]
    rivals = [g for g, s in searches.items() if g is not first and s.clear < end]
    if any(rival not in brackets for rival in rivals):
        return None
    roots = {}
    for guard in (first, *rivals):
        low, high = brackets[guard]
        about = partial(_about, flow, guard)
        roots[guard] = polish(about, (now + low, now + high), flow.backend.unit)
    first = min(roots, key=lambda guard: roots[guard])
    point = flow(roots[first])
    errors = {guard: _time_error(flow, guard, roots[guard]) for guard in roots if rivals}
    together = tuple(
        guard
        for guard in roots
        if guard is first or roots[guard] - roots[first] <= errors[guard] + errors[first]
    )
    outcome = Outcome.CORNER if len(together) > 1 else Outcome.REGULAR
    if outcome is Outcome.REGULAR and now + brackets[first][0] == 0:
        # At the start itself the guard is within its error of one more zero than is divided out.
        outcome = _tangency(first)
    return End(outcome, together, roots[first], point, flow.evaluations)


def _about(flow: Course, guard: Guard, h: Number) -> Expansion:
    return expand(flow.backend, flow.c, flow(h))[guard]


def _time_error(flow: Course, guard: Guard, h: Number) -> Number:
    """Bound on the error of a switching time: that of the guard over its slope, and rounding."""
    expansion = _about(flow, guard, h)
    slope = abs(expansion.values[1])
    # Terms may cancel in the slope, though it is proved not to vanish.
    return expansion.errors[0] / slope + 4 * flow.backend.unit * h if slope else math.inf


def at_rest_forever(backend: Backend, c: Any, at: Point) -> bool:
    """True if a sticking segment without contact is proved to last forever.

    x_r is the forced response plus a free part whose energy never grows, so its future is bounded;
    so is that of the interaction force. Rounding is covered by the inflation of each bound.
    """
    if c.drift or c.contact or pulsed(c):
        return False
    # Forced response alpha Re(e^(i angle) / Q(i omega)) and its rate. Near resonance it magnifies
    # the rounding of K - omega^2; the proof is not tried there.
    distance = backend.sqrt(c.Z2)
    rounded = 4 * backend.unit * (c.K + c.omega * c.omega)
    if distance <= 64 * rounded:
        return bool(_resting(backend, c, at) == math.inf)
    forced, rate = c.forced(at.cos_theta, at.sin_theta)
    relative = 4 * rounded / distance
    inflation = 1 + 64 * backend.unit + relative
    amplitude = amplitude_of(c) / distance * (1 + relative)
    rounding = 32 * backend.unit + relative + at.error_angle
    low = abs(at.x_r - c.rest_centre() - forced) + at.error_x + rounding * (abs(at.x_r) + amplitude)
    high = abs(at.v_r - rate) + at.error_v + rounding * (abs(at.v_r) + c.omega * amplitude)
    energy = inflation * backend.hypot(high, backend.sqrt(c.K) * low)
    reach = inflation * (amplitude + energy / backend.sqrt(c.K))
    gain = backend.sqrt(c.force_gain2())
    free = c.force_per_energy(backend.sqrt(c.K))
    force = inflation * (amplitude * gain + free * energy)
    within, room = _bounds_of_rest(backend, c)
    return bool(reach < room and force < within)


def _bounds_of_rest(backend: Backend, c: Any) -> tuple[Number, Number]:
    """Largest deviations from the load's force and from the centre at which a capsule rests."""
    within = min(c.friction_guard(sign, c.load_force()) for sign in (-1, 1))
    room = c.own_stop() - c.rest_centre()
    if len(backend.scene.facts.STOPS) == 2:
        room = min(room, getattr(c, backend.scene.facts.STOPS[1][0]) + c.rest_centre())
    return within, room


def _resting(backend: Backend, c: Any, at: Point) -> Number:
    """Duration for which rest without contact is proved, though it may end later; 0 if it is short.

    The energy of the motion about its centre grows by the drive's amplitude per unit of time at
    most. So a slow growth near resonance takes a few steps. Rounding is less than the share of the
    bounds that is left out.
    """
    if c.drift or c.contact or pulsed(c):
        return at.x_r * 0
    within, room = _bounds_of_rest(backend, c)
    root = backend.sqrt(c.K)
    low = abs(at.x_r - c.rest_centre()) + at.error_x + _SHORT * _SHORT * abs(c.rest_centre())
    energy = backend.hypot(abs(at.v_r) + at.error_v, root * low)
    most = min(root * room, (within - reaction_of(c)) / c.force_per_energy(root))
    spare, drive = 0.999 * most - energy, amplitude_of(c)
    if spare <= _LONG_REST * 2 * math.pi / c.omega * drive:
        return at.x_r * 0
    return spare / drive if drive else math.inf
