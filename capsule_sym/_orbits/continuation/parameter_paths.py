"""Paths of parameters: one varies, others are functions of it, such as alpha = a omega^2."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._map.backend import Number
from capsule_sym._map.checks import check_scales
from capsule_sym._map.result import brief
from capsule_sym._orbits.shooting.equations import Matrix, Vector
from capsule_sym._parameters import CAPSULE, Scene, SceneParameters

if TYPE_CHECKING:
    from capsule_sym._parameters import SceneDevice

Function = Callable[[Any], Any]
Evaluated = Callable[[Mapping[str, Any]], Any]
_LONGEST = 200  # characters of a function
_SAMPLES = 65  # places of a path at which its values are checked before a continuation
_ON_PATH = 1e-12  # relative distance of an orbit's parameters from its path
_OPERATIONS: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}


class NoNumber(ArithmeticError):
    """Raised if a function of a path has no value."""


class Slope:
    """A number with its derivative: arithmetic with it differentiates exactly."""

    def __init__(self, value: Any, slope: Any) -> None:
        self.value, self.slope = value, slope

    def __add__(self, other: Any) -> Slope:
        other = _lifted(other)
        return Slope(self.value + other.value, self.slope + other.slope)

    def __mul__(self, other: Any) -> Slope:
        other = _lifted(other)
        return Slope(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __pow__(self, power: Any) -> Slope:
        if isinstance(power, Slope):
            raise TypeError("an exponent that varies")
        if power == 0:
            return Slope(self.value**0, 0 * self.slope)
        return Slope(self.value**power, power * self.value ** (power - 1) * self.slope)

    __radd__ = __add__
    __rmul__ = __mul__

    def __neg__(self) -> Slope:
        return self * -1

    def __sub__(self, other: Any) -> Slope:
        return self + -_lifted(other)

    def __rsub__(self, other: Any) -> Slope:
        return -self + _lifted(other)

    def __truediv__(self, other: Any) -> Slope:
        return self * _lifted(other) ** -1

    def __rtruediv__(self, other: Any) -> Slope:
        return self**-1 * _lifted(other)


def _lifted(value: Any) -> Slope:
    return value if isinstance(value, Slope) else Slope(value, 0)


@dataclass(frozen=True)
class ParameterPath:
    """Path of parameters: `name` varies, and with it the parameters tied to it by functions.

    `parameter_path` makes it, and checks the names.
    The name is a parameter, or a new name of which a tied parameter is an affine function. The
    functions consist of arithmetic, so that their derivatives are exact. `texts` has the functions
    given as text, and None for Python functions. Parameters are those of the scene, dimensionless;
    derivatives by them have shape (many, parameters). A new name has the units of its ties.
    """

    name: str
    ties: tuple[tuple[str, Function], ...] = ()
    texts: tuple[tuple[str, str | None], ...] = ()
    scene: Scene = CAPSULE

    def __repr__(self) -> str:
        tied = (f"{name} = {text or 'a function'}" for name, text in self.texts)
        return brief(self, "; ".join([self.name, *tied]))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the scene's parameters."""
        return self.scene.facts.PARAMETERS  # type: ignore[no-any-return]

    def value(self, values: Sequence[Number]) -> Number:
        """Value of the varied parameter, at parameters on the path.

        Raises InvalidInput for a new name of which no tied parameter is an affine function.
        """
        if self.name in self.names:
            return values[self.names.index(self.name)]
        name, function = self._affine()
        at = function(Slope(0 * values[0], 1))
        return (values[self.names.index(name)] - at.value) / at.slope

    def placed(self, values: Sequence[Number], value: Number) -> list[Number]:
        """All parameters at a value of the varied one; those not tied are unchanged.

        Raises ArithmeticError if a tie has no value there.
        """
        placed = list(values)
        if self.name in self.names:
            placed[self.names.index(self.name)] = value
        for name, function in self.ties:
            placed[self.names.index(name)] = _number(function, value)
        return placed

    def along(self, by_p: Matrix, value: Number) -> Vector:
        """Total derivative by the varied parameter at `value`, (n,), by the chain rule.

        `by_p` has the derivatives by all parameters, (n, parameters). Raises ArithmeticError if a
        tie has no value or no derivative there.
        """
        result = 0 * by_p[:, 0]
        if self.name in self.names:
            result = result + by_p[:, self.names.index(self.name)]
        for name, function in self.ties:
            slope = _lifted(_number(function, Slope(value, 1))).slope
            result = result + by_p[:, self.names.index(name)] * slope
        return result

    share = value  # a path is a coordinate like an axis, given by its value

    def by(self, by_p: Matrix, values: Sequence[Number]) -> Vector:
        """Derivative along the path, as `along`; `values` are all parameters at the point."""
        return self.along(by_p, self.value(values))

    def _affine(self) -> tuple[str, Function]:
        """Tied parameter that is an affine function of the varied one; raises InvalidInput."""
        for name, function in self.ties:
            try:
                ends = (0.0, 0.7, 1.9)
                slopes = [_lifted(_number(function, Slope(at, 1.0))).slope for at in ends]
            except NoNumber:
                continue
            if slopes[0] != 0 and slopes[0] == slopes[1] == slopes[2]:
                return name, function
        allowed = f"a parameter ({', '.join(self.names)}) or a name on which one depends affinely"
        raise InvalidInput("parameter", self.name, allowed)

    def check(self, base: SceneParameters, first: float, last: float) -> None:
        """Raises InvalidInput if the path from one value to another leaves the allowed parameters.

        65 evenly spaced values are tried, both ends among them. The error names the parameter that
        is not allowed, the varied one if an end is not finite, `ties` that have no value, or
        `parameter` for a new name without an affine tie. Parameters not on the path are those of
        `base`.
        """
        for at in (first, last):
            if not math.isfinite(at):
                raise InvalidInput(self.name, at, "finite")
        if self.name not in self.names:
            self._affine()
        values = tuple(base.to_dict().values())
        for at in np.linspace(first, last, _SAMPLES).tolist():
            try:
                self.along(np.ones((1, len(self.names))), at)
                placed = [float(value) for value in self.placed(values, at)]
            except (NoNumber, TypeError, ValueError) as error:
                where = f"arithmetic of {self.name} with a value at {at:g} ({error})"
                raise InvalidInput("ties", [name for name, _ in self.ties], where) from None
            check_scales(type(base)(*placed))


class PathAxis(NamedTuple):
    """Path of parameters, and its range, mapped to the coordinate q in [0, 1]."""

    path: ParameterPath
    begin: float
    end: float

    @property
    def name(self) -> str:
        """Name of the varied parameter."""
        return self.path.name

    @property
    def width(self) -> float:
        """Width end - begin of the range, below 0 if it descends."""
        return self.end - self.begin

    def value(self, values: Sequence[Number]) -> float:
        """Value of the varied parameter, at these parameters."""
        return float(self.path.value(values))

    def share(self, values: Sequence[Number]) -> float:
        """Coordinate q of these parameters."""
        return (self.value(values) - self.begin) / self.width

    def placed(self, values: Sequence[float], q: float) -> list[float]:
        """All parameters at q; q = 0 and q = 1 give the ends of the range to the last bit."""
        near, share = (self.end, q - 1) if q > 0.5 else (self.begin, q)
        return self.path.placed(values, float(near + share * self.width))

    def by(self, by_p: Matrix, values: Sequence[float]) -> Vector:
        """Derivative by q, from those by the parameters, (many, parameters)."""
        return self.path.by(by_p, values) * self.width

    def check(self, base: SceneParameters, values: Sequence[Number]) -> None:
        """Raises InvalidInput for values off the path, or a path with parameters not allowed."""
        self.path.check(base, self.begin, self.end)
        value = self.value(values)
        for given, placed in zip(values, self.path.placed(values, value), strict=True):
            if abs(given - placed) > _ON_PATH * (abs(given) + abs(placed)):
                tied = [name for name, _ in self.path.ties]
                raise InvalidInput("ties", tied, f"functions that hold for the orbit at {value!r}")


def parameter_path(
    name: str, ties: Mapping[str, Function | str] | None = None, scene: Scene = CAPSULE
) -> ParameterPath:
    """Path on which a parameter varies, with others tied to it by functions or texts.

    A tie is a function of the varied parameter. It consists of arithmetic, so that its derivative
    is exact.

    Parameters
    ----------
    name : str
        Name of the varied parameter: one of the scene's, or with `ties` a new name. A continuation
        needs a tied parameter that is an affine function of a new name.
    ties : mapping of str to callable or str, default None
        Tied parameters of the scene, other than `name`, each with a function or a text. A function
        takes one number and returns one, by + - * / and powers with constant exponents. A text,
        such as "0.5*omega**2", has numbers, the name of the varied parameter, + - * / ** and
        parentheses, no name in an exponent, and 200 characters at most. Parameters are
        dimensionless; a new name has the units of its ties.
    scene : Scene, default the paper's
        Scene of the parameters, as `scenes.load` gives.

    Returns
    -------
    ParameterPath
        The path, for which continuations evaluate parameters and derivatives.

    Raises
    ------
    InvalidInput
        For other texts, for ties of an unknown parameter or of `name`, and for an unknown `name`
        without ties. Continuations check functions.

    See Also
    --------
    device_path : tie of a quantity in SI units.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> path = cs.inputs.parameter_path("omega", {"alpha": "0.9*(omega/0.8)**2"})
    >>> print(path)
    <ParameterPath: omega; alpha = 0.9*(omega/0.8)**2>
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> alpha, omega, *_ = path.placed(orbit.values, 0.9)
    >>> print(f"{alpha:.6f}", omega)
    1.139063 0.9
    """
    functions, texts, known = [], [], scene.facts.PARAMETERS
    for tied, given in (ties or {}).items():
        check_one_of("ties", tied, [one for one in known if one != name])
        functions.append((tied, _function(given, name) if isinstance(given, str) else given))
        texts.append((tied, given if isinstance(given, str) else None))
    if not functions:
        check_one_of("parameter", name, known)
    return ParameterPath(name, tuple(functions), tuple(texts), scene)


def chosen_path(
    name: str,
    known: Callable[[], ParameterPath],
    parameter: str | None,
    ties: Mapping[str, Function | str] | None,
    scene: Scene = CAPSULE,
) -> ParameterPath:
    """Path of the given parameter and ties; without them the known path, on which `name` varies."""
    if parameter is None and ties is None:
        return known()
    return parameter_path(parameter or name, ties, scene)


def device_path(device: SceneDevice, name: str) -> dict[str, str]:
    """Tie of one quantity of a device in SI units, for `parameter_path`.

    The quantity is proportional to one dimensionless parameter. It does not change the units of
    force, length and time.

    Parameters
    ----------
    device : PhysicalParameters, or the device of another scene
        The device, in SI units. Its other quantities stay as they are.
    name : str
        Name of the quantity. In the paper's scene it is P_d, Omega, G, c or k2.

    Returns
    -------
    dict of str to str
        The dimensionless parameter that varies, and its formula with `name` in SI units: the `ties`
        of a path in `name`.

    Raises
    ------
    InvalidInput
        For another name.

    See Also
    --------
    parameter_path : path with these ties.
    continue_orbit : branch along such a path.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> device = cs.PhysicalParameters(
    ...     M_m=0.5, M_c=1.65, k1=50, k2=75, c=0.5, G=0.0017, P_d=3.0, Omega=8.0, mu=0.2
    ... )
    >>> cs.inputs.device_path(device, "Omega")
    {'omega': '0.1*Omega'}

    A branch over the amplitude of the drive, in N:

    >>> orbit = cs.solve_orbit(device.dimensionless())
    >>> ties = cs.inputs.device_path(device, "P_d")
    >>> branch = cs.continue_orbit(orbit, "P_d", 3.2, points=4, ties=ties)
    >>> print(round(branch.points[0].value, 9), round(branch.points[-1].value, 9))
    3.0 3.2
    """
    tied, factor = device.tie(name)
    return {tied: f"{factor!r}*{name}"}


def _number(function: Function, value: Any) -> Any:
    try:
        result = function(value)
    except (ArithmeticError, TypeError, ValueError) as error:
        raise NoNumber(str(error)) from error
    if isinstance(_lifted(result).value, complex) and not isinstance(_lifted(value).value, complex):
        raise NoNumber("a complex number")
    return result


def _function(text: str, name: str) -> Function:
    """Function of the parameter `name`, from a text of arithmetic; raises InvalidInput."""
    body = arithmetic("ties", text, (name,))
    return lambda value: body({name: value})


def arithmetic(field: str, text: str, names: Collection[str]) -> Evaluated:
    """Function of values by name, from a text of arithmetic; raises InvalidInput."""
    try:
        if len(text) > _LONGEST:
            raise ValueError(text)
        return _evaluated(ast.parse(text.strip(), mode="eval").body, names)
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        known = ", ".join(names)
        allowed = f"numbers, {known}, + - * / ** and parentheses, {_LONGEST} characters at most"
        raise InvalidInput(field, text, allowed) from None


def _evaluated(node: ast.expr, names: Collection[str]) -> Evaluated:
    """Function of an expression; raises ValueError if it is not arithmetic of these names."""
    match node:
        case ast.BinOp(left, op, right) if type(op) in _OPERATIONS:
            # An exponent has no names: a power is differentiated by its base.
            apply, first = _OPERATIONS[type(op)], _evaluated(left, names)
            second = _evaluated(right, () if isinstance(op, ast.Pow) else names)
            return lambda values: apply(first(values), second(values))
        case ast.UnaryOp(ast.USub(), operand):
            negated = _evaluated(operand, names)
            return lambda values: -negated(values)
        case ast.Constant(value) if type(value) in (int, float):
            # Powers of integers could have too many digits.
            number = float(ast.literal_eval(node))
            return lambda values: number
        case ast.Name(name) if name in names:
            return lambda values: values[name]
    raise ValueError(ast.dump(node))
