"""Checks of the arguments of a run: ranges of parameters, states, phases and counts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from numbers import Integral
from typing import Any

from capsule_sym._arguments import is_real as is_real
from capsule_sym._errors import InvalidInput
from capsule_sym._parameters import SceneParameters

_LARGEST_COUNT = 10**12
LARGEST_STATE = 1e20
_TINY = 1e-9  # a least value below it stands for 0, which is not allowed
SEARCH_SECONDS = 600.0
"""Limit of time of a search, if none is given."""


def checked_state(state: Sequence[float], field: str = "state") -> tuple[float, float, float]:
    """State as three floats; raises InvalidInput for any other."""
    try:
        x_r, v_r, v_c = state
        if not type(x_r) is type(v_r) is type(v_c) is float:
            if any(isinstance(value, str | bytes | bool) for value in (x_r, v_r, v_c)):
                raise TypeError
            x_r, v_r, v_c = float(x_r), float(v_r), float(v_c)
        # NaN fails the comparisons, so it is refused here as well.
        if abs(x_r) <= LARGEST_STATE and abs(v_r) <= LARGEST_STATE and abs(v_c) <= LARGEST_STATE:
            return x_r, v_r, v_c
    except (TypeError, ValueError, OverflowError):
        pass
    allowed = f"three numbers (x_r, v_r, v_c) of size at most {LARGEST_STATE:g}"
    raise InvalidInput(field, state, allowed)


def checked_seconds(value: float, field: str = "max_seconds") -> float:
    """Limit of time in seconds; raises InvalidInput unless it is a number > 0."""
    if not is_real(value) or not value > 0:
        raise InvalidInput(field, value, "a number > 0")
    return value


def real(value: object) -> bool:
    """True for a finite real number, of Python or of NumPy."""
    return is_real(value) and math.isfinite(value)


def checked_ends(
    field: str, given: Any, least: float = -math.inf, most: float = math.inf
) -> tuple[float, float]:
    """Two ascending finite numbers within a range; raises InvalidInput for anything else."""
    ends = tuple(given) if isinstance(given, Sequence) or getattr(given, "ndim", 0) == 1 else ()
    pair = len(ends) == 2 and all(map(real, ends))
    if pair and least <= ends[0] < ends[1] <= most:
        return float(ends[0]), float(ends[1])
    told = ", above 0" if 0 < least < _TINY else f", from {least:g}" if least > -math.inf else ""
    told += f" to {most:g}" if most < math.inf else " on" * told.startswith(", from")
    raise InvalidInput(field, given, f"two ascending finite numbers{told}")


@lru_cache
def check_scales(parameters: SceneParameters) -> None:
    """Raise InvalidInput for a parameter outside the range of a run.

    Beyond the ranges powers and quotients may overflow or underflow double precision.
    """
    for field, (low, high) in parameters.scene.facts.RANGES.items():
        value = getattr(parameters, field)
        if not low <= value <= high:
            ends = (f"{end:g}" if float(f"{end:g}") == end else repr(end) for end in (low, high))
            raise InvalidInput(field, value, f"in [{', '.join(ends)}] for a run")


def check_start(
    parameters: SceneParameters, state: Sequence[float], phase: float, periods: int
) -> tuple[float, float, float]:
    """State as three floats; raises InvalidInput for any argument that is not allowed."""
    values = checked_state(state)
    check_scales(parameters)
    check_phase(phase, parameters.period)
    check_count("periods", periods)
    return values


def check_count(field: str, value: object, least: int = 1, most: int = _LARGEST_COUNT) -> None:
    """Raise InvalidInput unless the value is a whole number from `least` to `most`."""
    whole = type(value) is int or (isinstance(value, Integral) and not isinstance(value, bool))
    if not (whole and least <= value <= most):  # type: ignore[operator]
        raise InvalidInput(field, value, f"a whole number from {least} to {most}")


def check_phase(phase: float, period: float) -> None:
    """Raise InvalidInput unless the phase is a time in [0, period)."""
    if not (is_real(phase) and 0.0 <= phase < period):
        allowed = f"a time in [0, 2 pi/omega) = [0, {period!r})"
        raise InvalidInput("phase", phase, allowed)
