"""Number systems of the map: double precision and mpmath.

A backend gives the generated kernels of its number system and the few operations that differ
between them. Everything else in this package is written once for both.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from typing import Any

from capsule_sym._errors import InvalidInput
from capsule_sym._map.promised import GUARD_DIGITS, MOST_DIGITS
from capsule_sym._parameters import CAPSULE, SHIPPED, Scene, SceneParameters

Number = Any  # float, or a number of the mpmath kernels


class Backend:
    """Operations that the map needs from a number system, by mpmath's functions or replacements."""

    name: str
    scene: Scene
    """Scene of the kernels."""
    kernels: Any
    unit: Number
    """Unit roundoff."""
    full_turn: Number
    """2 pi."""
    closed_form_units: int
    """Rounding of the closed form, in units of its largest terms."""

    def __init__(self, functions: Any, kernels: Any, scene: Scene = CAPSULE) -> None:
        self.kernels, self._functions, self.scene = kernels, functions, scene
        self.unit, self.full_turn = functions.eps / 2, 2 * functions.pi

    def number(self, value: object) -> Number:
        """Value in this number system, exact for a float."""
        return self._functions.mpf(value)

    def sqrt(self, value: Number) -> Number:
        """Square root."""
        return self._functions.sqrt(value)

    def hypot(self, x: Number, y: Number) -> Number:
        """Square root of the sum of both squares, which do not underflow."""
        return self._functions.sqrt(x * x + y * y)

    def angle(self, phase: Number, omega: Number) -> tuple[Number, Number]:
        """Forcing angle at a time, and its rounding error, exact less rounded."""
        return phase * omega, phase * 0

    def edge(self, share: Number) -> tuple[Number, Number]:
        """Forcing angle after a share of a period, and its rounding error."""
        return share * self.full_turn, share * 0

    def cos_sin(self, angle: Number, rest: Number = 0) -> tuple[Number, Number]:
        """Cosine and sine of an angle plus its rounding error."""
        return self._functions.cos_sin(angle + rest)  # type: ignore[no-any-return]

    def turns(self, angle: Number) -> tuple[int, Number]:
        """Whole turns in an angle >= 0, and the remainder in [0, 2 pi)."""
        whole = int(self._functions.floor(angle / self.full_turn))
        return whole, angle - whole * self.full_turn

    def constants(self, field: int, parameters: SceneParameters) -> Any:
        """Constants of the segments of a field, by its number."""
        values = [self.number(value) for value in parameters.to_dict().values()]
        return self.kernels.constants(field, *values)


class NumpyBackend(Backend):
    """Double precision on the NumPy kernels."""

    name = "numpy"
    unit = 2.0**-53
    closed_form_units = 8  # measured: below 4
    full_turn = 2.0 * math.pi
    # 2 pi in two parts, so that subtracting it k times commits no error that grows with k.
    _TURN = (2.0 * math.pi, 2.4492935982947064e-16)

    def __init__(self, scene: Scene = CAPSULE) -> None:
        self.kernels, self.scene = scene.kernels, scene

    def number(self, value: object) -> float:
        return float(value)  # type: ignore[arg-type]

    def sqrt(self, value: float) -> float:
        return math.sqrt(value)

    def hypot(self, x: float, y: float) -> float:
        return math.hypot(x, y)

    def angle(self, phase: float, omega: float) -> tuple[float, float]:
        angle = phase * omega
        # Exactly, in integers, whose quotient Python rounds once.
        (a, b), (c, d), (e, f) = (x.as_integer_ratio() for x in (phase, omega, angle))
        return angle, (a * c * f - e * b * d) / (b * d * f)

    def edge(self, share: float) -> tuple[float, float]:
        angle, rest = self.angle(share, self._TURN[0])
        return angle, rest + share * self._TURN[1]

    def cos_sin(self, angle: float, rest: float = 0.0) -> tuple[float, float]:
        cosine, sine = math.cos(angle), math.sin(angle)
        return cosine - rest * sine, sine + rest * cosine

    def turns(self, angle: float) -> tuple[int, float]:
        high, low = self._TURN
        whole = math.floor(angle / high)
        rest = (angle - whole * high) - whole * low
        if rest < 0.0:
            whole -= 1
            rest = (angle - whole * high) - whole * low
        return (whole + 1, 0.0) if rest >= high else (whole, rest)


class MpmathBackend(Backend):
    """Numbers with a fixed count of decimal digits, independent of `mpmath.mp`."""

    name = "mpmath"
    # Some hundred operations round far less: the reference's bounds rest on no measurement.
    closed_form_units = 10**GUARD_DIGITS

    def __init__(self, digits: int = MOST_DIGITS, scene: Scene = CAPSULE) -> None:
        from capsule_sym._map.precision import mpmath_kernels, of_mpmath

        super().__init__(of_mpmath(digits), mpmath_kernels(digits, scene), scene)


def default_backend(scene: Scene = CAPSULE) -> str:
    """Fastest backend: "c" if the scene's core is compiled, else "numpy", with a warning once."""
    return "c" if _is_compiled(scene) else "numpy"


@cache
def _is_compiled(scene: Scene) -> bool:
    """True if the scene's core is there; warns once if it is not."""
    from capsule_sym._native import core_of

    if core_of(scene) is not None:
        return True
    warnings.warn(
        f"no compiled core of scene {scene.shown}: the NumPy backend runs, slower by far; "
        f"to have the core, {how_compiled(scene)}",
        RuntimeWarning,
        stacklevel=4,
    )
    return False


def how_compiled(scene: Scene) -> str:
    """Command or advice to compile the core of a scene."""
    if scene.source in SHIPPED or find_spec("capsule_sym._native._binding") is None:
        return (
            "in a clone run make core, or start Python outside of it if capsule-sym is installed; "
            "else install it where there is a C compiler"
        )
    return f"run python -m capsule_sym.codegen --scene FILE --out {scene.source} --core"


@contextmanager
def backend(name: str, scene: Scene = CAPSULE) -> Iterator[Backend]:
    """Context with the backend `numpy`, or `mpmath` with 50 digits and 10 guard digits.

    Its kernels are those of the scene. Raises InvalidInput for another name.
    """
    if name == "numpy":
        yield NumpyBackend(scene)
    elif name == "mpmath":
        yield MpmathBackend(scene=scene)
    else:
        raise InvalidInput("backend", name, "c, numpy or mpmath")
