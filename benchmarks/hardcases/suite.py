"""Generator of the neutral suite of hard events: benchmarks/events/events.json.

Times are those of the map with 50 digits. A proof in ball arithmetic encloses them: every switch is
there, is the first event, and no other follows up to the end. `proved` is false without a proof.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import pairwise
from typing import Any

from benchmarks.hardcases import cases
from benchmarks.hardcases.cases import Case
from benchmarks.hardcases.reference import Start
from capsule_sym import simulate
from capsule_sym._enclosures.interface import (
    TIME,
    Ball,
    Known,
    Leg,
    Passage,
    Unproved,
    arb,
    hull,
    matrix,
    precision,
)
from capsule_sym._orbits.interface import guard_between
from capsule_sym.generated.capsule.facts import FIELDS
from capsule_sym.results import Segment

VERSION = "1.0.0"
_BITS, _DIGITS = 256, 45
_KINDS: dict[str, tuple[Callable[[], Iterator[Case]], ...]] = {
    "tangency": (cases._grazes, cases._sliding_tangencies),
    "exact tangency": (cases._exact_tangencies,),
    "double root at the start": (cases._onsets,),
    "short segment": (cases._short,),
    "corner": (cases._corners, cases._slow_corners),
    "twin crossings": (cases._twins,),
    "start on a surface": (cases._places,),
}
_SIZE = re.compile(r"\d(?:\.\d)?e-\d+")


def text() -> str:
    """The whole file, a case a line."""
    head: dict[str, Any] = {"suite": "hard events of a piecewise-linear capsule"}
    head |= {"version": VERSION, "numbers": _NUMBERS, "system": _system()}
    lines = [
        json.dumps(record(case, kind))
        for kind, groups in _KINDS.items()
        for group in groups
        for case in group()
    ]
    body = json.dumps(head, indent=1)[:-2]
    return body + ',\n "cases": [\n' + ",\n".join(lines) + "\n]}\n"


_NUMBERS = (
    "Parameters, states, start and end times are binary64 numbers, taken exactly; times of "
    "switches are decimals, off by at most their radius."
)


def record(case: Case, kind: str) -> dict[str, Any]:
    """One case with its answer."""
    start = case.build()
    count = start.max_segments
    run = simulate(
        start.parameters,
        start.state,
        start.phase,
        start.periods,
        backend="mpmath",
        max_segments=count + 1,
    )
    segments = list(run.segments)
    switched = [one for one in segments[:count] if one.target]
    end = _end(start, segments, len(switched))
    size = _SIZE.search(case.name)
    found: dict[str, Any] = {
        "name": case.name,
        "kind": kind,
        "why": case.hard,
        "distance": float(size.group()) if size else None,
        "parameters": start.parameters.to_dict(),
        "start": {"t": start.phase, "state": list(start.state), "field": segments[0].name},
        "end": end,
    }
    times = [start.phase + sum(s.duration for s in switched[: k + 1]) for k in range(len(switched))]
    try:
        enclosed: list[Ball] | None = _enclosed(start, segments, len(switched), end)
        reason = None
    except Unproved as unproved:
        enclosed, reason = None, str(unproved)
    found["switches"] = [
        {"t": _digits(times[k]), "radius": None, "from": before.name, "to": after.name}
        if enclosed is None
        else {
            "t": enclosed[k].mid().str(_DIGITS, radius=False),
            "radius": f"{_radius(enclosed[k]):.1e}",
            "from": before.name,
            "to": after.name,
        }
        for k, (before, after) in enumerate(list(pairwise(segments))[: len(switched)])
    ]
    found["proved"] = enclosed is not None
    if reason is not None:
        found["not proved"] = reason
    return found


def _digits(value: Any) -> str:
    import mpmath

    return str(mpmath.nstr(value, _DIGITS, strip_zeros=False))


def _radius(found: Ball) -> float:
    """Bound of a ball's radius and of the loss by its decimals, which are rounded once."""
    lost = abs(float(found.mid())) * 10.0 ** (1 - _DIGITS)
    return 1.1 * (float(found.rad()) + lost)  # so that one digit may be rounded down


def _end(start: Start, segments: list[Segment], count: int) -> float:
    """A time between the last switch of the answer and what follows, or the end of the run."""
    last = float(sum((one.duration for one in segments[:count]), 0))
    rest = float(segments[count].duration)
    return start.phase + last + (min(0.5, rest / 2) if segments[count].target else 0.999 * rest)


def _enclosed(start: Start, segments: list[Segment], count: int, end: float) -> list[Ball]:
    """Times of the switches in balls; raises Unproved."""
    with precision(_BITS):
        values = {name: arb(value) for name, value in start.parameters.to_dict().items()}
        states = matrix(3, 1, ((i, 0, arb(x)) for i, x in enumerate(start.state)))
        steps = [
            Leg(one.field, float(one.duration), guard_between(one.field, after.field))
            for one, after in list(pairwise(segments))[:count]
        ]
        steps.append(Leg(segments[count].field, end - start.phase, None))
        passage = Passage(values)
        begun = passage.start(states, values["omega"] * arb(start.phase))
        total = arb(end) - arb(start.phase)
        passed = passage.segments(begun, steps, total, _known(start))
        ended = [hull(one.ended) for one in passed]
        return [arb(start.phase) + one[TIME, 0] for one in ended[:-1]]


def _known(start: Start) -> Known:
    """Guards and derivatives that vanish exactly at the start, by rational numbers."""
    p = {name: Fraction(value) for name, value in start.parameters.to_dict().items()}
    beyond: Fraction = max(Fraction(0), Fraction(start.state[0]) - p["delta"])
    x_r, v_r, v_c = map(Fraction, start.state)
    gap = 0 if x_r != p["delta"] else 1 + (v_r == 0)
    force = x_r + 2 * p["zeta"] * v_r + p["beta"] * beyond
    if v_c:
        return Known(gap=gap)
    side = (force == p["f_b"]) - (force == -p["f_b"])
    level = bool(side) and start.phase == 0 and p["zeta"] == 0 and v_r == 0  # P' = v_r there
    return Known(gap=gap, rest=True, side=side, level=level)


def _system() -> dict[str, Any]:
    """The equations as expressions and as matrices."""
    fields = {f"F{index}": _field(contact, drift) for index, (contact, drift) in FIELDS.items()}
    return {
        "state": ["x_r", "v_r", "v_c"],
        "parameters": ["alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b"],
        "extended": ["x_r", "v_r", "v_c", "cos(omega*t)", "sin(omega*t)", "1"],
        "fields": fields,
    }


def _field(contact: int, drift: int) -> dict[str, Any]:
    """One field: rates, guards, what follows each guard, and the same as rows of a matrix."""
    number = {(c, d): f"F{index}" for index, (c, d) in FIELDS.items()}
    pull = "x_r + 2*zeta*v_r" + (" + beta*(x_r - delta)" if contact else "")
    row = ["1 + beta" if contact else "1", "2*zeta", "0", "0", "0"]
    row.append("-beta*delta" if contact else "0")
    slip = f"(({pull}) - ({drift})*f_b)/gamma" if drift else "0"
    of_slip = [f"({one})/gamma" for one in row] if drift else ["0"] * 6
    if drift:
        of_slip[5] = f"(({row[5]}) - ({drift})*f_b)/gamma"
    of_mass = [f"-({one}) - ({two})" for one, two in zip(row, of_slip, strict=True)]
    of_mass[3] = "alpha"
    gap = ("x_r - delta", ["1", "0", "0", "0", "0", "-delta"])
    if not contact:
        gap = ("delta - x_r", ["-1", "0", "0", "0", "0", "delta"])
    guards = [{"name": "gap", "positive": gap[0], "row": gap[1]}]
    following: dict[str, Any] = {"gap": number[1 - contact, drift]}
    if drift:
        speed = "v_c" if drift > 0 else "-v_c"
        guards.append(
            {"name": "drift", "positive": speed, "row": ["0", "0", str(drift), "0", "0", "0"]}
        )
        following["drift"] = {
            "pull": pull,
            "pull > f_b": number[contact, 1],
            "pull < -f_b": number[contact, -1],
            "else": number[contact, 0],
        }
    else:
        for name, sign, way in (("upper", "-", 1), ("lower", "+", -1)):
            of_guard = [f"{sign}({one})" for one in row]
            of_guard[5] = f"f_b {sign} ({row[5]})"
            positive = f"f_b {sign} ({pull})"
            guards.append({"name": name, "positive": positive, "row": of_guard})
            following[name] = number[contact, way]
    still = ["0"] * 6
    return {
        "contact": contact,
        "drift": drift,
        "rates": ["v_r", f"alpha*cos(omega*t) - ({pull}) - {slip}", slip],
        "matrix": [
            ["0", "1", "0", "0", "0", "0"],
            of_mass,
            of_slip,
            ["0", "0", "0", "0", "-omega", "0"],
            ["0", "0", "0", "omega", "0", "0"],
            still,
        ],
        "guards": guards,
        "next": following,
    }
