"""Closed form of a segment with its Jacobian, by core or kernels, and gradients of guards."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.backend import Backend, Number
from capsule_sym._map.expansion import Guard
from capsule_sym._native import check_time, core_of, present
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._parameters import CAPSULE, Scene

_LONGEST = 4096  # largest number of segments of an itinerary in the C core


class ClosedForms:
    """Closed forms of all fields at one parameter set, in the numbers of a backend."""

    def __init__(self, numbers: Backend, values: Sequence[Number]) -> None:
        self.numbers, self.values, self.scene = numbers, tuple(values), numbers.scene
        native = None if numbers.name == "mpmath" else native_fields(self.values, self.scene)
        self._fields = native

    def constants(self, field: int) -> Any:
        """Constants of the segment of field F`field`."""
        if self.numbers.name == "mpmath":
            return self.numbers.kernels.constants(field, *self.values)
        return _constants(self.scene, field, self.values)

    def value(self, name: str) -> Number:
        """A parameter by its name."""
        return self.values[self.scene.facts.PARAMETERS.index(name)]

    def column(self, name: str) -> int:
        """Column of a parameter in rows and gradients, counted from the end."""
        names = self.scene.facts.PARAMETERS
        return names.index(name) - len(names)  # type: ignore[no-any-return]

    def evaluated(self, itinerary: Itinerary, z: NDArray[Any]) -> tuple[Any, ...] | None:
        """Equations of an itinerary by the C core; None without it, or for too many segments."""
        if self._fields is None or len(itinerary) > _LONGEST:
            return None
        return self._fields.evaluate_itinerary(*_spelt(itinerary), np.array(z, dtype=float))  # type: ignore[no-any-return]

    def solved(self, itinerary: Itinerary, z: NDArray[Any]) -> tuple[Any, ...] | None:
        """Final unknowns, system, status, steps and residual; None as in `evaluated`."""
        if self._fields is None or len(itinerary) > _LONGEST:
            return None
        found = self._fields.solve_itinerary(*_spelt(itinerary), z, watch=present())
        check_time()
        return found[:-1]  # type: ignore[no-any-return]

    def run(
        self, field: int, c: Any, closed: Any, h: Number
    ) -> tuple[Sequence[Number], NDArray[Any]]:
        """Values (x_r's change, v_r, v_c's change, x_c's advance) at h, and Jacobian (4, columns).

        The columns are JACOBIAN_COLUMNS of the kernels; in stick the last two rows are zero.
        """
        if self._fields is not None:
            values, matrix = self._fields.closed_form(field, np.array(closed), h)
            return values.tolist(), matrix
        kernels, number = self.numbers.kernels, self.numbers.number
        values = [number(value) for value in kernels.flow(c, closed, h, bool(c.drift))]
        if not c.drift:
            values += [number(0), number(0)]
        matrix = np.asarray(kernels.jacobian(c, closed, h))
        if not c.drift:
            matrix = np.concatenate([matrix, np.full((2, matrix.shape[1]), number(0))])
        return values, matrix


def _spelt(itinerary: Itinerary) -> tuple[NDArray[np.int32], int, bool]:
    """Itinerary in the form of the C core."""
    return np.array(itinerary.fields, np.int32), itinerary.period_number, itinerary.mirrored


def native_fields(values: tuple[float, ...], scene: Scene = CAPSULE) -> Any:
    """Fields of a scene's core at parameter values; None without the core."""
    return None if core_of(scene) is None else _made(scene, values)


@lru_cache(maxsize=8)
def _made(scene: Scene, values: tuple[float, ...]) -> Any:
    return core_of(scene).fields(values)


# Newton steps at one parameter set use the same constants.
@lru_cache(maxsize=64)
def _constants(scene: Scene, field: int, values: tuple[float, ...]) -> Any:
    fields, kernels = native_fields(values, scene), scene.kernels
    if fields is not None:
        return kernels.Constants(*fields.constants(field))
    c = kernels.constants(field, *values)
    # Plain Python numbers make the scalar path several times faster than NumPy's.
    return c._replace(**{k: v.item() for k, v in c._asdict().items() if hasattr(v, "item")})


_STATE = 3


def chained(
    gradient: Sequence[Any], by: NDArray[Any], angle_by: NDArray[Any] | None = None
) -> NDArray[Any]:
    """Gradient (n, ...) of a function of state and parameters; `by` (3, n, ...) is the state's.

    `gradient` has the derivatives by state, phase and parameters, as formulas give them; the last
    of the n are by the parameters. A function of the phase needs the gradient of the angle, (n,
    ...).
    """
    rows = by[:_STATE] if angle_by is None else [*by[:_STATE], angle_by]
    by_state = gradient[: len(rows)]
    terms = [slope * row for slope, row in zip(by_state, rows, strict=True) if _varies(slope)]
    found: NDArray[Any] = sum(terms) if terms else 0 * by[0]
    by_parameters = gradient[_STATE + 1 :]
    for column, slope in enumerate(by_parameters, -len(by_parameters)):
        if _varies(slope):
            found[column] += slope
    return found


def _varies(slope: Any) -> bool:
    """True unless a derivative is the integer 0 that formulas write for none."""
    return type(slope) is not int or slope != 0


def guard_by(
    c: Any,
    guard: Guard,
    gap: Any,
    v_r: Any,
    by: NDArray[Any],
    turned: Sequence[Any] = (None, None),
    angle_by: NDArray[Any] | None = None,
) -> NDArray[Any]:
    """Gradient (n,) of a guard that is positive in the cell of the segment with constants `c`.

    `by` (3, n) are the derivatives of the state there; the last columns are by the parameters. If
    the drive reacts, cosine and sine of the forcing angle, `turned`, and its derivatives are
    needed. The other stop of two, `BACK`, needs the constants of contact with it, and has their
    sign.
    """
    if guard in (Guard.GAP, Guard.BACK):
        sign, row = 1 if c.contact else -1, c.gap_gradient()
    elif guard is Guard.DRIFT:
        sign, row = int(c.drift), c.speed_gradient()
    else:
        way = 1 if guard is Guard.UPPER else -1
        sign, row = -way, c.limit_gradient(way, gap, v_r, *turned)
    return sign * chained(row, by, angle_by)
