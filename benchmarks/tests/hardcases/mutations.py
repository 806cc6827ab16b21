"""Weakened certificates: each takes a bound away from the double-precision map, and from it alone.

Each is applied with `monkeypatch` and must make the map miss, invent or misdate a switch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from capsule_sym._map import course, isolation, location, quasistatic

Mutation = Callable[[pytest.MonkeyPatch], None]


def _expansions(change: Callable[[Any], Any]) -> Mutation:
    """Change the expansion of every guard."""

    def apply(patch: pytest.MonkeyPatch) -> None:
        expand = location.expand

        def weaker(backend: Any, c: Any, at: Any) -> Any:
            found = expand(backend, c, at)
            if backend.name != "numpy":
                return found
            return {guard: change(expansion) for guard, expansion in found.items()}

        patch.setattr(location, "expand", weaker)

    return apply


def no_monotonicity(patch: pytest.MonkeyPatch) -> None:
    """Take every bracket to hold one root, whatever the slope does in it."""
    bounds = isolation._bounds

    def weaker(expansion: Any, zeros: int, unit: Any) -> Any:
        found = bounds(expansion, zeros, unit)
        return replace(found, slope=[-1.0] * len(found.slope)) if isinstance(unit, float) else found

    patch.setattr(isolation, "_bounds", weaker)


def no_division(patch: pytest.MonkeyPatch) -> None:
    """Leave the zeros at the start in."""
    honest = course.Course.__init__

    def weaker(self: Any, backend: Any, c: Any, begin: Any) -> None:
        if backend.name == "numpy":
            begin = replace(begin, start=begin.start._replace(zeros={}))
        honest(self, backend, c, begin)

    patch.setattr(course.Course, "__init__", weaker)


def no_flow_errors(patch: pytest.MonkeyPatch) -> None:
    """Take the closed form in double precision to be exact."""
    call = course.Course.__call__

    def weaker(self: Any, h: Any) -> Any:
        point = call(self, h)
        if self.backend.name != "numpy":
            return point
        errors = {name: 0.0 for name in point._fields if name.startswith("error")}
        return point._replace(**errors)

    patch.setattr(course.Course, "__call__", weaker)


def no_free_part(patch: pytest.MonkeyPatch) -> None:
    """Forget the free part of the motion where only the forced response is expanded."""
    bounds = quasistatic._Free

    def weaker(*sizes: Any) -> Any:
        return bounds(*(0.0 if isinstance(size, float) else size for size in sizes))

    patch.setattr(quasistatic, "_Free", weaker)


def no_rivals(patch: pytest.MonkeyPatch) -> None:
    """Take the first bracket for the first switch, whatever another guard may do before."""
    first = location._first

    def weaker(flow: Any, now: Any, searches: Any, found: Any) -> Any:
        return first(flow, now, found if flow.backend.name == "numpy" else searches, found)

    patch.setattr(location, "_first", weaker)


def no_doubt_about_order(patch: pytest.MonkeyPatch) -> None:
    """Take the order of two switches to be that of their computed times."""
    error = location._time_error

    def weaker(flow: Any, guard: Any, h: Any) -> Any:
        return 0.0 if flow.backend.name == "numpy" else error(flow, guard, h)

    patch.setattr(location, "_time_error", weaker)


def no_others_at_a_tangency(patch: pytest.MonkeyPatch) -> None:
    """Step over a tangency without a look at the other guards."""
    turning = location._turning

    def weaker(expansions: Any, stuck: Any, *rest: Any) -> Any:
        if isinstance(rest[-1], float):
            expansions = {guard: expansions[guard] for guard in stuck}
        return turning(expansions, stuck, *rest)

    patch.setattr(location, "_turning", weaker)


def _never(change: Callable[[Any, Any], tuple[Any, Any]]) -> Mutation:
    """Change the constants and the point that are looked at for a proof of rest."""

    def apply(patch: pytest.MonkeyPatch) -> None:
        rest = location.at_rest_forever
        patch.setattr(
            location, "at_rest_forever", lambda backend, c, at: rest(backend, *change(c, at))
        )

    return apply


def _without_energy(c: Any, at: Any) -> tuple[Any, Any]:
    """The point put on the forced response, so that no free part is left."""
    if c.Z2 == 0 or c.drift or c.contact:
        return c, at
    real, imaginary, size = c.K - c.omega**2, 2 * c.sigma * c.omega, c.alpha / c.Z2
    x_r = size * (real * at.cos_theta + imaginary * at.sin_theta)
    v_r = size * c.omega * (imaginary * at.cos_theta - real * at.sin_theta)
    return c, at._replace(x_r=x_r, v_r=v_r)


MUTATIONS: dict[str, Mutation] = {
    "no remainder": _expansions(lambda e: replace(e, rest=0.0, growth=0.0)),
    "no rounding errors": _expansions(lambda e: replace(e, errors=[0.0] * len(e.errors))),
    "no errors of the closed form": no_flow_errors,
    "no monotonicity": no_monotonicity,
    "no division of the start's zeros": no_division,
    "no rivals": no_rivals,
    "no doubt about the order": no_doubt_about_order,
    "no others at a tangency": no_others_at_a_tangency,
    "no free part beside the forced response": no_free_part,
    "no energy in the proof of rest": _never(_without_energy),
    "no gap in the proof of rest": _never(lambda c, at: (c._replace(delta=1e9), at)),
    "no friction bound in the proof of rest": _never(lambda c, at: (c._replace(f_b=1e9), at)),
}
