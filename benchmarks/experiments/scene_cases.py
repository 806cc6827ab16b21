"""Hard cases of any scene by name, at chosen distances from what is degenerate."""

from __future__ import annotations

import math
from collections.abc import Iterator

from benchmarks.experiments.scene_starts import Field, HardStart
from tests.scenes import GENERAL, Form, Start

DISTANCES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 1e-16)
_PLAIN = {
    **{"alpha": 0.6, "omega": 0.5, "zeta": 0.05, "gamma": 2.0, "f_b": 1.0, "s": 0.1},
    **{"f_plus": 1.0, "f_minus": 0.8, "alpha_low": -0.4, "D": 0.375},
    **{"delta": 0.5, "delta_1": 0.5, "delta_2": 0.75, "beta": 3.0, "beta_1": 3.0, "beta_2": 5.0},
}


def _start(
    form: Form, state: tuple[float, float, float], phase: float = 0, **given: float
) -> Start:
    values = {**_PLAIN, **given}
    return Start({name: values[name] for name in form.names}, state, phase)


def cases(form: Form) -> Iterator[HardStart]:
    """Cases by name, with their distance from degenerate, infinite for none."""
    drive = _drive(form) if form.pulsed else _momentum(form) if form.reacts else ()
    for name, start in (*_plain(form), *drive):
        yield HardStart(name, math.inf, start)
    for contact in range(form.stops + 1):
        for way in (-1, 0, 1):
            yield from _tangencies(form, contact, way)
            if form.pulsed:
                for level in (0, 1):
                    yield from _at_edges(form, level, contact, way)


def _plain(form: Form) -> Iterator[tuple[str, Start]]:
    stiff = {"beta": 900.0, "beta_1": 900.0, "beta_2": 900.0, "omega": 0.3}
    for speed in (2.0, 1e-3):
        yield "contact of stiffness 900", _start(form, (0.4, speed, 0.0), **stiff)
        if form.stops == 2:
            yield "contact of stiffness 900", _start(form, (-0.7, -speed, 0.0), **stiff)
    if form.stops == 2:
        for gap in (1e-2, 1e-8, 0.0):
            near = {**stiff, "delta_1": gap, "delta_2": max(gap, 1e-9)}
            yield "stops next to each other", _start(form, (0.0, 0.7, 0.1), **near)
    if form.biased:
        for bounds in ((1.0, 0.01), (0.01, 1.0)):
            f = dict(zip(("f_plus", "f_minus"), bounds, strict=True))
            yield "bounds that differ by 100", _start(form, (0.1, 0.3, 0.2), **f)
            yield "bounds that differ by 100", _start(form, (-0.2, -0.3, 0.0), **f)
        # tan(theta) = 1.2 mu with gamma = 2: s = 0.4, and both bodies' weight is above friction.
        steep = {"s": 0.4, "f_plus": 1.8, "f_minus": 0.2}
        yield "slip down a slope without rest", _start(form, (-0.4, 0.0, -0.1), alpha=0.0, **steep)
        yield "slip down a slope without rest", _start(form, (0.2, 0.5, 0.3), **steep)
    for zeta in (0.0, 1e-12, 1.0, math.nextafter(1.0, 0.0), 30.0):
        yield "undamped, critical and stiff", _start(form, (0.3, 0.4, 0.5), zeta=zeta)
    for omega in (1e-3, 1.0, math.sqrt(1.5), 2.0, 1e3):
        yield "resonance, slow and fast drive", _start(form, (0.3, 0.4, 0.5), omega=omega, zeta=0.0)
    yield "no drive", _start(form, (0.3, 0.4, 0.5), alpha=0.0, alpha_low=0.0)


_LATE = {
    **{"alpha": 2.5690680253186993, "omega": 4.968637311923812, "zeta": 0.01067593670579402},
    **{"gamma": 20.58988684047667, "delta": 0.08042827041060885, "beta": 26.844088107909606},
}


def _momentum(form: Form) -> Iterator[tuple[str, Start]]:
    """v_c vanishes late on the first expansion, where it follows from v_r by momentum."""
    state = (0.12525556609188354, 0.752842463625753, -0.05984500776465882)
    if form.stops == 1:
        yield "landing late on an expansion", _start(form, state, 0.7281818707513663, **_LATE)


def _drive(form: Form) -> Iterator[tuple[str, Start]]:
    state = (0.1, 0.5, 0.2)
    for share in (1e-9, 1e-6, 1e-3):
        for D in (share, 1 - share):
            yield "D near 0 and 1", _start(form, state, D=D)
            period = 2 * math.pi / _PLAIN["omega"]
            yield "D near 0 and 1", _start(form, state, period * (1 - 2e-9), D=D)
    yield "low level as high", _start(form, state, alpha_low=_PLAIN["alpha"])
    yield "low level as high", _start(form, (0.0, 0.0, 0.0), alpha_low=_PLAIN["alpha"])
    edge = 2 * math.pi / _PLAIN["omega"] * _PLAIN["D"]
    for beside in (0, 1, -1):
        phase = math.nextafter(edge, edge + beside)
        yield "start on an edge", _start(form, state, phase)
        yield "start on an edge", _start(form, (0.5, 0.5, 0.2), phase)


def _field(form: Form, level: int, contact: int, way: int) -> tuple[Field, Start]:
    """A field and a start with its parameters; a bound is far for a field at rest in contact."""
    start = _start(form, (0.0, 0.0, 0.0))
    p = dict(zip(GENERAL, form.general(start.parameters), strict=True))
    return Field(p, form, level, contact, way), start


def _surfaces(f: Field) -> list[float]:
    if f.contact:
        return [f.stop]
    return [f.p["delta_1"], -f.p["delta_2"]][: f.form.stops]


def _met(
    f: Field, start: Start, name: str, state: tuple[float, float, float], t: float, distance: float
) -> Iterator[HardStart]:
    """A start from which a field comes to a state at a time, if it lies in the field."""
    for h in (0.4, 0.1):
        before = f.before(state, t, h)
        if f.holds(before, t - h):
            yield HardStart(name, abs(distance), start._replace(state=before, phase=t - h))
            return


def _signed() -> Iterator[float]:
    yield 0.0
    for distance in DISTANCES:
        yield distance
        yield -distance


def _tangencies(form: Form, contact: int, way: int) -> Iterator[HardStart]:
    """Grazes of either stop and slides along either bound, past it and short of it."""
    f, start = _field(form, 0, contact, way)
    t = 3.0
    for off in _signed():
        for surface in _surfaces(f):
            yield from _met(f, start, "graze", (surface + off, 0.0, 0.7 * way), t, off)
        if not way:
            for bound in (f.p["f_plus"], -f.p["f_minus"]):
                drive, rate = f.push(0, t)
                force = bound + off + form.reacts * drive
                turning = form.reacts * rate - 2 * f.p["zeta"] * (drive - f.p["s"] - force)
                v_r = turning / (1 + f.kappa)
                state = (f.position(force, v_r), v_r, 0.0)
                yield from _met(f, start, "sliding tangency", state, t, off)
        else:
            for surface in _surfaces(f):
                yield from _met(f, start, "corner", (surface + off, 0.8, 0.0), t, off)
                yield from _met(f, start, "corner", (surface + off, -0.8, 0.0), t, off)


def _at_edges(form: Form, level: int, contact: int, way: int) -> Iterator[HardStart]:
    """A switch, a tangency and rest at an edge, a little before and after it."""
    f, start = _field(form, level, contact, way)
    t = 2 * math.pi / f.p["omega"] * (1.0 if level else f.p["D"])
    out = 1.0 if contact == 0 else -1.0
    for off in _signed():
        for surface in _surfaces(f):
            side = out if surface >= 0 else -out
            crossing = (surface + off, 0.63 * side, 0.7 * way)  # no friction bound is met too
            yield from _met(f, start, "edge at a switch", crossing, t, off)
            yield from _met(f, start, "edge at a tangency", (surface + off, 0.0, 0.7 * way), t, off)
        if way:
            for x_r in (0.2, -0.4) if contact == 0 else (f.stop * 1.2,):
                yield from _met(f, start, "edge at a switch", (x_r, 0.3, off), t, off)
            continue
        for after in (level, 1 - level):  # Q before and after the edge
            drive = f.push(after, t)[0]
            for bound in (f.p["f_plus"], -f.p["f_minus"]):
                force = bound + off + form.reacts * drive
                for v_r in (0.5, -0.5, 0.0):
                    state = (f.position(force, v_r), v_r, 0.0)
                    yield from _met(f, start, "edge at rest", state, t, off)
