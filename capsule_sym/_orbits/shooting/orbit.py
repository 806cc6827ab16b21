"""Periodic orbit of a given itinerary, solved by Newton's method."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arguments import checked
from capsule_sym._errors import Ended, InvalidInput, Outcome, Status, check_one_of, counted
from capsule_sym._map import Instant, Segment, SteadyMotion, Trajectory
from capsule_sym._map.backend import Backend, Number, backend
from capsule_sym._map.expansion import Guard
from capsule_sym._map.labelled import Labelled
from capsule_sym._map.result import brief
from capsule_sym._map.steady import abbreviated
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import (
    Matrix,
    ShootingSystem,
    Vector,
    of_core,
    solve,
    touched,
)
from capsule_sym._orbits.shooting.itinerary import Itinerary, contact, drift, level
from capsule_sym._orbits.shooting.newton import newton, solved_to_rounding
from capsule_sym._orbits.shooting.stability import floquet_multipliers
from capsule_sym._parameters import CAPSULE, Scene, SceneParameters
from capsule_sym.generated.interface import Solving

_backend = backend  # the parameter of `solve_itinerary` has the same name


_UNSOLVED = {
    Solving.UNSOLVED: (
        Status.NOT_CONVERGED,
        "Newton's method did not converge: the residual is not small",
    ),
    Solving.SINGULAR: (Status.SINGULAR, "the Jacobian of the equations is singular"),
    Solving.IMPRECISE: (
        Status.SINGULAR,
        "the equations are too ill-conditioned for double precision",
    ),
    Solving.NOT_FINITE: (Status.NOT_FINITE, "the residual of the guess is not finite"),
}


@dataclass(frozen=True, eq=False)
class Orbit(Ended, Labelled):
    """Periodic orbit modulo drift: a solution z of its itinerary's equations.

    `values` are the parameters of the scene in their order. `z` has the state (x_r, v_r, v_c), the
    forcing angle and the durations, `system` the equations there, `iterations` the number of Newton
    steps. With the backend "mpmath" these have 50 digits; multipliers, `parameters` and columns
    have double precision. Durations below 0 are allowed: such an orbit solves the equations, but is
    not a motion. All quantities are dimensionless; columns have shape (k,), one row for each of the
    k segments.
    """

    values: tuple[Number, ...]
    itinerary: Itinerary
    z: Vector
    system: ShootingSystem
    backend: str
    iterations: int = 0

    def __repr__(self) -> str:
        return brief(self, f"{self.summary}, progression {float(self.progression):.6g}")

    @property
    def summary(self) -> str:
        """Itinerary, period number and stability, as a text."""
        itinerary, number = abbreviated(str(self.itinerary), 20), self.itinerary.period_number
        state = ("stable" if self.stable else "unstable") if self.success else str(self.status)
        return f"{itinerary}, period number {number}, {state}"

    @property
    def scene(self) -> Scene:
        """Scene of the parameters."""
        return self.itinerary.scene

    @property
    def numbers(self) -> Backend:
        """Number system of the orbit."""
        with _backend(self.backend, self.scene) as numbers:
            return numbers

    @property
    def parameters(self) -> SceneParameters:
        """Parameters, rounded to double precision."""
        return self.scene.Parameters(*(float(value) for value in self.values))

    @checked
    def value(self, name: str) -> Number:
        """Parameter by its name, in the number system of the orbit."""
        check_one_of("name", name, self.scene.facts.PARAMETERS)
        return self.values[self.scene.facts.PARAMETERS.index(name)]

    @property
    def residual(self) -> Number:
        """Largest absolute entry of the equations' residual."""
        return max(abs(self.system.residual))

    @cached_property
    def status(self) -> Status:
        """CONVERGED if the residual is within rounding, else NOT_CONVERGED."""
        solved = solved_to_rounding(self.numbers, self.system, self.z)
        return Status.CONVERGED if solved else Status.NOT_CONVERGED

    @property
    def message(self) -> str:
        """Status as a sentence."""
        solved = "the equations are solved to rounding"
        return solved if self.success else "the residual of the equations is not small"

    @property
    def durations(self) -> Vector:
        """Duration of each segment, shape (k,)."""
        return self.z[4:]

    @property
    def progression(self) -> Number:
        """Advance of x_c per excitation period; 0 for the first half of a symmetric orbit."""
        taken_back = self.system.advance * self.itinerary.mirrored  # in the second half
        return (self.system.advance - taken_back) / self.itinerary.period_number

    @property
    def average_velocity(self) -> Number:
        """Advance of x_c per unit of time."""
        return self.progression * self.value("omega") / self.numbers.full_turn

    @cached_property
    def multipliers(self) -> NDArray[np.complex128]:
        """The three Floquet multipliers, complex, shape (3,), the largest modulus first.

        For the first half of a symmetric orbit they are those of the whole orbit.
        """
        return floquet_multipliers(self)

    @property
    def stable(self) -> bool:
        """True if all Floquet multipliers are within the unit circle: a motion then attracts."""
        return bool(abs(self.multipliers[0]) < 1)

    @cached_property
    def by_parameter(self) -> Matrix:
        """Derivative dz/dp along the branch, by the implicit function theorem.

        Shape (k + 4, parameters) for k segments; 7 parameters in the paper's scene.

        Raises numpy.linalg.LinAlgError where the equations are exactly singular, as at a fold. Next
        to it, within rounding, the derivatives are very large.
        """
        return -solve(self.numbers, self.system.by_z, self.system.by_p)

    @cached_property
    def motion(self) -> SteadyMotion:
        """Orbit as a steady motion of the map: segments, global map, progression.

        Of the first half of a symmetric orbit it has the segments of that half.

        Quantities known at a switch have their exact values: x_r at the stop, v_c = 0.
        """
        segments, period_number = tuple(_segments(self)), self.itinerary.period_number
        return SteadyMotion(segments, period_number, self.progression, self.parameters)

    def trajectory(self) -> Trajectory:
        """One period of the orbit as a trajectory, which can be evaluated at times.

        It starts with the first segment: its `span` begins at that segment's phase, not at 0. Of
        the first half of a symmetric orbit it is that half. It keeps no stroboscopic states.
        """
        segments = self.motion.segments
        origin = segments[0].start, segments[0].start_state
        return Trajectory.of_segments(self.parameters, self.backend, origin, segments)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Segments of one period as columns, like those of a trajectory."""
        return self.trajectory().columns

    @checked
    def refined(self) -> Orbit:
        """The same orbit in 50 digits, or a result without one, as by `solve_itinerary`."""
        return solve_itinerary(self.values, self.itinerary, list(self.z), backend="mpmath")


class NoOrbit(Orbit):
    """Result without an orbit: `success` is False.

    `status` and `message` give the reason, `residual` the largest entry of the final residual,
    `iterations` the number of Newton steps. `values` and `parameters` are those given, `itinerary`
    is the one that was refused; without one, as after a run that does not settle, it is None, and
    the residual inf. Other properties of an orbit raise AttributeError with the message.
    """

    scene: Scene = CAPSULE
    message: str = ""
    residual: Number = float("inf")

    def __init__(
        self,
        status: Status,
        message: str,
        itinerary: Itinerary | None,
        values: tuple[Number, ...],
        residual: Number,
        iterations: int = 0,
        scene: Scene | None = None,
    ) -> None:
        self.__dict__.update(
            status=status,
            message=message,
            itinerary=itinerary,
            values=values,
            residual=residual,
            iterations=iterations,
            backend="numpy",
            scene=scene or (CAPSULE if itinerary is None else itinerary.scene),
        )

    def __repr__(self) -> str:
        return brief(self, self.message, f"({self.status})")

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        raise AttributeError(f"there is no orbit, and so no {name}: {self.message}")


def columns_of(orbits: Sequence[Orbit]) -> dict[str, NDArray[Any]]:
    """Columns with a row for each orbit: itinerary, motion, start state, residual and status."""
    starts = np.array([orbit.z[:3] for orbit in orbits], dtype=float).reshape(-1, 3)
    return {
        "itinerary": np.array([str(orbit.itinerary) for orbit in orbits], dtype=np.str_),
        "period_number": np.array([orbit.itinerary.period_number for orbit in orbits], dtype=int),
        "progression": np.array([float(orbit.progression) for orbit in orbits]),
        "average_velocity": np.array([float(orbit.average_velocity) for orbit in orbits]),
        "x_r": starts[:, 0],
        "v_r": starts[:, 1],
        "v_c": starts[:, 2],
        "residual": np.array([float(orbit.residual) for orbit in orbits]),
        "status": np.array([str(orbit.status) for orbit in orbits], dtype=np.str_),
    }


def solve_itinerary(
    parameters: SceneParameters | Sequence[Number],
    itinerary: Itinerary,
    guess: Sequence[Number] | None = None,
    *,
    backend: str = "numpy",
) -> Orbit:
    """Orbit of an itinerary near a guess z, by damped Newton steps with the exact Jacobian.

    All quantities are dimensionless. The residual of an orbit is at most 1e-13 in double precision
    and 1e-50 in 50 digits. If the largest `|z_i|` is above 1, these limits are multiplied by it. If
    the terms of an equation are large, as in a long itinerary, its residual is at most 8 of their
    roundings.

    The result solves the equations of the itinerary. It need not be a motion of the map: durations
    below 0 are allowed. `is_admissible` tests this.

    Parameters
    ----------
    parameters : Parameters or sequence of numbers
        Parameters of the capsule or of another scene, dimensionless. A sequence has all parameters
        of the itinerary's scene in their order, 7 in the paper's.
    itinerary : Itinerary
        Itinerary of the orbit, such as `orbit.itinerary` or `Itinerary.parse("F5 F2")`.
    guess : sequence of k + 4 numbers or None, default None
        Guess z for k segments, dimensionless: the state (x_r, v_r, v_c) at the start of the
        first segment, the forcing angle there in radians, and the durations. None is allowed for an
        itinerary without switches only.
    backend : {"numpy", "mpmath"}, default "numpy"
        Number system: double precision, or 50 digits.

    Returns
    -------
    Orbit
        The orbit, or a result whose `success` is False. Its `status` is then "not-converged",
        "singular" or "not-finite", and its `message` gives the reason.

    Raises
    ------
    InvalidInput
        For a guess of the wrong size, a missing one, another number of parameters or values that
        they cannot have, another backend, or an itinerary that the scene does not have.

    See Also
    --------
    is_admissible : the test of the map.
    solve_orbit : orbit and itinerary from a start.

    Notes
    -----
    The unknowns z satisfy the shooting equations. The state closes modulo drift, the durations sum
    to whole excitation periods, and at the end of each segment its event function vanishes.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> other = cs.orbits.solve_itinerary(cs.Parameters(alpha=0.85), orbit.itinerary, orbit.z)
    >>> print(other.status, f"{other.progression:.6f}", other.residual < 1e-13)
    converged 0.699852 True

    An itinerary without switches needs no guess:

    >>> stick = cs.results.Itinerary.parse("F2")
    >>> print(cs.orbits.solve_itinerary(cs.Parameters(alpha=0.005), stick).itinerary)
    F2
    """
    given: Iterable[Number]
    if isinstance(parameters, SceneParameters):
        given, itinerary = parameters.to_dict().values(), itinerary.in_scene(parameters.scene)
    else:
        given = parameters
    itinerary = itinerary.possible
    with _backend(backend, itinerary.scene) as numbers:
        values = tuple(numbers.number(value) for value in given)
        names = itinerary.scene.facts.PARAMETERS
        if len(values) != len(names):
            raise InvalidInput("parameters", values, f"the values of {', '.join(names)}")
        if not isinstance(parameters, SceneParameters):
            itinerary.scene.Parameters(*map(float, values))  # raises InvalidInput
        if guess is None:
            guess = _stick_guess(numbers, values, itinerary)
        if len(guess) != len(itinerary) + 4:
            raise InvalidInput(
                "guess",
                guess,
                f"{counted(len(itinerary) + 4, 'number')} for the itinerary {itinerary}",
            )
        z = np.array([numbers.number(value) for value in guess])
        with np.errstate(all="ignore"):
            return _found(numbers, values, itinerary, z)


def _stick_guess(numbers: Backend, values: Sequence[Number], itinerary: Itinerary) -> list[Number]:
    if itinerary.segments[0].guard is not None:
        raise InvalidInput("guess", None, "given for an itinerary with switches")
    turn = numbers.full_turn / 2 if itinerary.mirrored else numbers.full_turn
    period = (
        itinerary.period_number * turn / values[itinerary.scene.facts.PARAMETERS.index("omega")]
    )
    return [numbers.number(0)] * 4 + [period]


def _found(numbers: Backend, values: tuple[Number, ...], itinerary: Itinerary, z: Vector) -> Orbit:
    """Result of Newton's method, in the C core or in any number system."""
    by_core = ClosedForms(numbers, values).solved(itinerary, z)
    if by_core is None:
        z, system, solving, steps, norm = newton(numbers, values, itinerary, z)
    else:
        z, arrays, solving, steps, norm = by_core
        system = of_core(values, itinerary, z, arrays)
    if solving == Solving.SOLVED:
        return Orbit(values, itinerary, z, system, numbers.name, steps)
    return NoOrbit(*_UNSOLVED[solving], itinerary, values, norm, steps)


def _segments(orbit: Orbit) -> list[Segment]:
    """Segments of the orbit as segments of the map."""
    itinerary, flows, numbers = orbit.itinerary, orbit.system.flows, orbit.numbers
    omega, forms = orbit.value("omega"), ClosedForms(numbers, orbit.values)
    starts = [_exact_start(forms, itinerary, i, flow.start) for i, flow in enumerate(flows)]
    # The first half of a symmetric orbit ends in the mirror image of its start.
    x_r, v_r, v_c = starts[0]
    starts.append((-x_r, -v_r, -v_c) if itinerary.mirrored else starts[0])
    position = numbers.number(0)
    segments, first = list[Segment](), numbers.turns(flows[0].angle)[0]
    for i, flow in enumerate(flows):
        turns, angle = numbers.turns(flow.angle)
        later, end_angle = numbers.turns(flow.angle + omega * flow.h)
        segments.append(
            Segment(
                field=flow.segment.field,
                source=_plane(itinerary, i),
                target=_plane(itinerary, i + 1),
                start=Instant(turns - first, angle / omega, omega),
                end=Instant(later - first, end_angle / omega, omega),
                start_state=starts[i],
                end_state=starts[i + 1],
                duration=flow.h,
                outcome=Outcome.REGULAR if flow.segment.guard else Outcome.NEVER,
                tangencies=(),
                evaluations=0,
                position=position,
                advance=flow.moved[2],
                closed=flow.closed,
                scene=orbit.scene,
            )
        )
        position = position + flow.moved[2]
    return segments


def _exact_start(
    forms: ClosedForms, itinerary: Itinerary, i: int, state: Vector
) -> tuple[Any, Any, Any]:
    """Start of a segment, with the values that the guard before it makes exact."""
    (x_r, v_r, v_c), guard = state, itinerary.segments[i - 1].guard
    if guard in (Guard.GAP, Guard.BACK):
        x_r = touched(forms, itinerary, i - 1).own_stop()
    return x_r, v_r, 0 * v_c if guard is Guard.DRIFT else v_c


def _plane(itinerary: Itinerary, index: int) -> str:
    """Switching plane on which a segment begins, Eq. (24), and also after the last segment."""
    field, guard = itinerary.neighbour(index), itinerary.segments[index - 1].guard
    tables, way = itinerary.scene.switching, drift(field, itinerary.scene)
    if guard is Guard.EDGE:
        return f"Σ{tables.EDGE_PLANES[level(field, itinerary.scene)]}"
    if way == 0 or guard not in (Guard.GAP, Guard.BACK):
        return f"Σ{field}"
    stop = itinerary.stop(index - 1)
    # Into contact with the front stop the mass moves forward, with the other one backward.
    inward = contact(field, itinerary.scene) == stop
    return f"Σ{tables.IMPACT_PLANES[stop, way, 1 if inward == (stop == 1) else -1]}"
