"""Other tools on the same task, each as its documentation advises, and in its most careful form."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from math import cos, inf, pi
from typing import Any

import numpy as np

from capsule_sym.bench.model import CONTACT, DRIFT, Result, following, force
from capsule_sym.parameters import Parameters

MOST = 400  # segments; a tool that locks up in switching ends there

Run = Callable[[Parameters, int], Result]


def scipy_run(method: Any, tolerance: float) -> Run:
    """SciPy's solve_ivp with terminal events, restarted 1e-16 off the surface at each switch."""
    from scipy.integrate import solve_ivp

    def run(p: Parameters, periods: int) -> Result:
        z, t, end, field, word = np.zeros(3), 0.0, periods * 2 * pi / p.omega, 2, ""
        while t < end and len(word) < MOST:
            word += str(field)
            solution: Any = solve_ivp(
                partial(_rate, p, field),
                (t, end),
                z,
                method=method,
                rtol=tolerance,
                atol=tolerance,
                events=_events(p, field),
            )
            hits = [float(e[0]) if len(e) else inf for e in solution.t_events or []]
            fired = int(np.argmin(hits))
            if hits[fired] == inf:
                return Result(word, tuple(solution.y[:, -1].tolist()))
            t, z = hits[fired], solution.y_events[fired][0].copy()
            field = following(p, field, fired, *z)
            z[0 if fired == 0 else 2] = p.delta if fired == 0 else 0.0
        return Result(word, tuple(z.tolist()))

    return run


def _rate(p: Parameters, field: int, t: float, z: Any) -> tuple[float, float, float]:
    pull, drift = force(p, CONTACT[field], z[0], z[1]), DRIFT[field]
    capsule = (pull - drift * p.f_b) / p.gamma if drift else 0.0
    return z[1], p.alpha * cos(p.omega * t) - pull - capsule, capsule


def _events(p: Parameters, field: int) -> list[Any]:
    side, drift, contact = (1 if CONTACT[field] else -1), DRIFT[field], CONTACT[field]
    events: list[Any] = [lambda t, z: side * (z[0] - p.delta) + 1e-16]
    if drift:
        events.append(lambda t, z: drift * z[2] + 1e-16)
    else:
        events.append(lambda t, z: p.f_b - force(p, contact, z[0], z[1]) + 1e-16)
        events.append(lambda t, z: p.f_b + force(p, contact, z[0], z[1]) + 1e-16)
    for event in events:
        event.terminal, event.direction = True, -1
    return events


def heyoka_run(tolerance: float, nudged: bool) -> Run:
    """heyoka.py, scalar; nudged: restarted one unit off the surface, where its guards need it."""

    def run(p: Parameters, periods: int) -> Result:
        import heyoka as hy  # type: ignore[import-not-found,import-untyped,unused-ignore]

        z, t, end, field, word = np.zeros(3), 0.0, periods * 2 * pi / p.omega, 2, ""
        while t < end and len(word) < MOST:
            word += str(field)
            solver = _taylor(field, tolerance)
            solver.pars[:] = list(p.to_dict().values())
            solver.time = t
            solver.state[:] = z
            solver.reset_cooldowns()
            outcome = solver.propagate_until(end)[0]
            t, z = solver.time, solver.state.copy()
            if outcome == hy.taylor_outcome.time_limit:
                return Result(word, tuple(z.tolist()))
            fired = -int(outcome) - 1
            field = following(p, field, fired, *z)
            if fired == 0:
                toward = 8.0 if CONTACT[field] else -8.0
                z[0] = np.nextafter(p.delta, toward) if nudged else p.delta
            else:
                z[2] = DRIFT[field] * 1e-16 if nudged else 0.0
        return Result(word, tuple(z.tolist()))

    return run


@cache
def _taylor(field: int, tolerance: float) -> Any:
    import heyoka as hy  # type: ignore[import-not-found,import-untyped,unused-ignore]

    x, v, w = hy.make_vars("x", "v", "w")
    alpha, omega, delta, zeta, beta, gamma, f_b = (hy.par[i] for i in range(7))
    pull = x + 2.0 * zeta * v
    if CONTACT[field]:
        pull += beta * (x - delta)
    drift = float(DRIFT[field])
    capsule = (pull - drift * f_b) / gamma if drift else hy.expression(0.0)
    guards = [x - delta if CONTACT[field] else delta - x]
    guards += [drift * w] if drift else [f_b - pull, f_b + pull]
    events = [hy.t_event(g, direction=hy.event_direction.negative) for g in guards]
    return hy.taylor_adaptive(
        [(x, v), (v, alpha * hy.cos(omega * hy.time) - pull - capsule), (w, capsule)],
        state=[0.0] * 3,
        pars=[0.0] * 7,
        tol=tolerance,
        t_events=events,
    )


def rk4_run(steps: int) -> Run:
    """Fixed-step RK4 with naive switching at the ends of steps, as most papers use."""

    def run(p: Parameters, periods: int) -> Result:
        z, h, field, word = np.zeros(3), 2 * pi / p.omega / steps, 2, "2"
        for i in range(steps * periods):
            t = i * h
            a = np.array(_rate(p, field, t, z))
            b = np.array(_rate(p, field, t + h / 2, z + h / 2 * a))
            c = np.array(_rate(p, field, t + h / 2, z + h / 2 * b))
            d = np.array(_rate(p, field, t + h, z + h * c))
            z = z + h / 6 * (a + 2 * b + 2 * c + d)
            fired = next((k for k, e in enumerate(_events(p, field)) if e(t, z) < 0), None)
            if fired is not None:
                field = following(p, field, fired, *z.tolist())
                word += str(field)
                if fired and not DRIFT[field]:
                    z[2] = 0.0
        return Result(word, tuple(z.tolist()))

    return run
