"""Check of the arguments of public functions, methods and constructors, by their annotations.

An annotation is read as text, so that a check imports no other module: a class is known by its name
among the bases of a value's type. Lengths, ranges and names are checked where they are used.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache, wraps
from numbers import Integral, Real
from os import PathLike
from typing import Any, NamedTuple, TypeGuard, TypeVar

from capsule_sym._errors import InvalidInput, check_one_of

_Target = TypeVar("_Target", bound=Callable[..., Any])
_ALIASES = {
    "System": "SceneParameters | SceneDevice",
    "Motion": "Trajectory | Orbit",
    "OrbitLike": "Orbit",
    "Starts": "Mapping[str, Any] | ArrayLike",
    "Ranges": "tuple[Sequence[float], Sequence[float]]",
    "Function": "Callable",
    "Progress": "Callable",
    "Vector": "Sequence[Number]",
}
"""Meanings of other names of types."""
_SOURCES = {
    "SceneParameters": "Parameters(alpha=0.7), or .dimensionless() of a device,",
    "Trajectory": "simulate(parameters)",
    "Orbit": "solve_orbit(parameters)",
    "Branch": "continue_orbit(orbit, name, to)",
    "Bifurcation": "branch.bifurcations[0]",
    "Sweep": "read_plan(file)",
    "Axis": "Axis.linear(name, low, high, count)",
    "Dataset": "open_results(store)",
    "Scene": "scenes.load(folder)",
}
"""Classes whose objects are frequent arguments, with an expression that gives one."""


class _Kind(NamedTuple):
    """Test of a value, and a description of the values that pass it."""

    allows: Callable[[Any], bool]
    words: str
    by_type: bool = False
    """True if all values of a type are alike."""


def is_real(value: object) -> TypeGuard[float]:
    """True for an int or a float, also of NumPy, nan and inf included; not for bool or text.

    An int beyond the range of doubles is refused.
    """
    if type(value) is float:
        return True
    if isinstance(value, int | float):
        try:
            return not isinstance(value, bool) and float(value) is not None
        except OverflowError:
            return False
    import numpy as np

    return isinstance(value, np.integer | np.floating)


def _numeric(value: Any) -> bool:
    """True for real numbers in an array of any shape, or in what makes one."""
    import numpy as np

    if isinstance(value, _NO_LISTS) or value is None:
        return False
    try:
        made = np.asarray(value.dropna() if hasattr(value, "isna") else value)
        # Numbers of other libraries, such as mpmath, and bool in an array, as of a mask.
        return made.dtype.kind in "iuf" or (
            made.ndim > 0 and made.dtype.kind in "bO" and made.astype(float) is not None
        )
    except (TypeError, ValueError, OverflowError):
        return False


def _items(value: Any) -> Any:
    """Items of a list, a tuple, an array or a column; None for anything else."""
    if (
        isinstance(value, _NO_LISTS)
        or hasattr(value, "columns")  # its items are the names of its columns
        or not hasattr(value, "__len__")
        or not getattr(value, "ndim", 1)
    ):
        return None
    value = value.tolist() if hasattr(value, "tolist") else value
    return value if hasattr(value, "__iter__") and not isinstance(value, str) else None


def _rows(value: Any) -> bool:
    """True for a list, a tuple, a column or an array with an axis; copies no array."""
    array = type(value).__name__ == "ndarray"
    return value.ndim > 0 if array else _items(value) is not None


def _axes(value: Any) -> bool:
    """True for axes of Matplotlib, and for any list, table or array of them."""
    every = value.values() if isinstance(value, Mapping) else _items(value)
    some = every is not None and len(every) > 0
    return _AXES.allows(value) or (some and all(map(_axes, every)))


def _instance(name: str, words: str) -> _Kind:
    """Objects of a class and of those derived from it, by its name, but no `NoOrbit`."""

    def allows(value: Any) -> bool:
        every = [one.__name__ for one in type(value).__mro__]
        return name in every and every[0] != "NoOrbit"

    return _Kind(allows, words, True)


_AXES = _instance("Axes", "")
_NO_LISTS = (str, bytes, Mapping, set, frozenset, type)
_LEAVES = {
    "int": _Kind(
        lambda v: isinstance(v, Integral) and not isinstance(v, bool), "a whole number", True
    ),
    "float": _Kind(lambda v: is_real(v) and v == v, "a number"),
    "str": _Kind(lambda v: isinstance(v, str), "a text", True),
    "bool": _Kind(lambda v: type(v).__name__ in ("bool", "bool_"), "True or False", True),
    "None": _Kind(lambda v: v is None, "", True),
    "Number": _Kind(
        lambda v: is_real(v) or (isinstance(v, Real) and not isinstance(v, int)), "a number"
    ),
    "Constants": _Kind(lambda v: hasattr(v, "own_stop"), "orbit.system.flows[0].c or alike"),
    "Any": _Kind(lambda v: True, "values"),
    "PathLike": _Kind(lambda v: isinstance(v, str | PathLike), "a file name", True),
    "Callable": _Kind(lambda v: callable(v) and not isinstance(v, type), "a function"),
    "ArrayLike": _Kind(_numeric, "numbers"),
    "AnyAxes": _Kind(_axes, "axes of Matplotlib, as figure.subplots() gives"),
    "NDArray": _Kind(lambda v: _rows(v) and _numeric(v), "rows of numbers"),
    "Record": _Kind(
        lambda v: isinstance(v, Mapping) and bool({"points", "itinerary"} & v.keys()),
        "a record, as read_branch(file) gives",
    ),
}
_LEAVES |= {"Path": _LEAVES["PathLike"]}
_ITEMS = _LEAVES | {"float": _Kind(is_real, "a number")}  # NaN is refused with the range


@cache
def _named(name: str, leaves: str = "") -> _Kind | None:
    if name in _ALIASES:
        return _kind(ast.parse(_ALIASES[name], mode="eval").body)
    if (known := (_ITEMS if leaves else _LEAVES).get(name)) or not name[0].isupper():
        return known
    article = "an" if name[0] in "AEIO" else "a"
    words = f"{article} {name.removeprefix('Scene') or name}"
    words += f", as {_SOURCES[name]} gives" if name in _SOURCES else ""
    return _instance(name, words)


def _kind(node: Any, item: str = "") -> _Kind | None:
    """Kind of an annotation, of an argument or an item; None if any value is allowed.

    A name that begins with a capital is that of a class, unless it has a meaning here.
    """
    if isinstance(node, ast.Constant):
        return _named(str(node.value), item)
    if isinstance(node, ast.Name | ast.Attribute):
        return _named(node.id if isinstance(node, ast.Name) else node.attr, item)
    if isinstance(node, ast.BinOp):
        first, second = _kind(node.left, item), _kind(node.right, item)
        return _union(first, second) if first and second else None
    of = ast.unparse(node.value).rpartition(".")[2]
    parts: list[Any] = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    if of == "Literal":
        names = [part.value for part in parts]
        return _Kind(lambda v: isinstance(v, str) and v in names, f"one of {', '.join(names)}")
    if of not in ("Mapping", "Sequence", "Iterable", "tuple"):
        return _named(of, item)
    mixed = of == "tuple" and len({ast.unparse(one) for one in parts} - {"..."}) > 1
    known = None if mixed else _kind(parts[of == "Mapping"], "item")
    part = known or _Kind(lambda _: True, "values")
    several = re.sub(r"^an? (.*?)s?( of .*|, .*)?$", r"\1s\2", part.words)
    if of == "Mapping":
        columns = part is _ITEMS["ArrayLike"]
        several += " by name" + ", as read_measured(file) gives" * columns

        def allows(value: Any) -> bool:
            return (isinstance(value, Mapping) or (columns and hasattr(value, "keys"))) and all(
                isinstance(name, str) and part.allows(value[name])
                for name in value.keys()  # noqa: SIM118
            )

        return _Kind(allows, several)

    def each(value: Any) -> bool:
        if of == "Iterable" and isinstance(value, Iterator):
            return True
        items = _items(value)
        return items is not None and all(map(part.allows, items))

    return _Kind(each, f"a list of {several}")


def _union(first: _Kind, second: _Kind) -> _Kind:
    words = [one.words for one in (first, second) if one.words]
    if "a file name" in words and "a text" in words:
        words.remove("a text")
    by_type = first.by_type and second.by_type
    either = " or ".join(dict.fromkeys(words))
    return _Kind(lambda v: first.allows(v) or second.allows(v), either, by_type)


def checked(target: _Target) -> _Target:
    """The function with a check of its arguments; a class gets it for its constructor.

    Calls raise InvalidInput for an argument of a wrong type, a name that is not one of the
    arguments, and too few or too many of them.
    """
    if isinstance(target, type):
        target.__init__ = _checked(target.__init__, target.__name__)  # type: ignore[misc]
        return target
    made: _Target = _checked(target, target.__name__)
    return made


def _checked(function: Any, name: str) -> Any:
    signature = inspect.signature(function)
    names, kinds = [*signature.parameters], {}
    for one, about in signature.parameters.items():
        if isinstance(text := about.annotation, str):
            # Axes are of any layout; the figure checks their number.
            text = text.replace("Sequence[Axes]", "Axes").replace("Axes |", "AnyAxes |")
            kinds[one] = _kind(ast.parse(text, mode="eval").body)
    # The type of an argument that was allowed last, if all of its values are.
    usual: dict[str, type] = {}

    def check(one: str, value: Any) -> None:
        kind = kinds.get(one)
        if kind is not None and not kind.allows(value):
            raise InvalidInput(one, value, kind.words)
        if kind is None or kind.by_type:
            usual[one] = type(value)

    @wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        for place, value in enumerate(args[: len(names)]):
            if type(value) is not usual.get(one := names[place]):
                check(one, value)
        for one in named:
            if type(named[one]) is not usual.get(one):
                check(one, named[one])
        try:
            return function(*args, **named)
        except TypeError:
            _check_names(signature, name, args, named)
            raise

    return call


def _check_names(signature: inspect.Signature, name: str, args: Any, named: Any) -> None:
    """Raise InvalidInput for arguments that a signature does not take."""
    try:
        signature.bind(*args, **named)
    except TypeError as error:
        every = (str(one).partition(":")[0] for one in signature.parameters.values())
        names = [one.partition("=")[0] for one in every if one != "self"]
        if not any(one.startswith("**") for one in names):
            for one in named:
                check_one_of(f"argument of {name}", one, names)
        given = (*[one for one in [*signature.parameters][: len(args)] if one != "self"], *named)
        allowed = f"{', '.join(names)} ({error})"
        raise InvalidInput(f"arguments of {name}", given, allowed) from error
