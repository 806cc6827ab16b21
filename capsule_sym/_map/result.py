"""Base of results: status, message, and named content."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from capsule_sym._errors import Ended


class Result(Ended):
    """A result with a status and a message.

    A class of results declares its fields, and names those of its record in `_recorded`.
    """

    __slots__ = ()
    _recorded: ClassVar[str] = ""
    """Names in the record besides status and message, separated by spaces."""

    if TYPE_CHECKING:  # a field or a property of each result

        @property
        def message(self) -> str: ...

    def to_dict(self) -> dict[str, Any]:
        """Result by name, as JSON has it: None stands for a number that is not finite."""
        return record(self, f"success status message {self._recorded}")

    def __repr__(self) -> str:
        return brief(self, self.message)


def brief(result: object, text: str, of: str = "") -> str:
    """A result in one line of a terminal, the most important text first, cut where it is long."""
    line = f"{type(result).__name__}{of and ' '}{of}: {text}"
    return f"<{line}>" if len(line) < _LINE else f"<{line[: _LINE - 5].rstrip()} ...>"


def by_fields(result: Any) -> str:
    """A small result in one line, by its fields."""
    names = getattr(result, "_fields", None) or [one.name for one in fields(result)]
    return brief(result, ", ".join(f"{name} {_short(getattr(result, name))}" for name in names))


_LINE = 78  # characters of a line of a terminal, without < and >


def _short(value: Any) -> str:
    """A value in few words: numbers with six digits, arrays by their shapes, dicts by names."""
    if isinstance(value, np.ndarray) and value.size > 3:
        return f"{value.shape} array"
    if isinstance(value, Mapping):
        return f"({', '.join(map(str, value))})"
    if isinstance(value, list | tuple | np.ndarray) and not hasattr(value, "_fields"):
        return f"({', '.join(map(_short, value))})"
    if isinstance(value, Enum):
        return str(value.value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def record(result: object, names: str) -> dict[str, Any]:
    """Attributes of a result by names with spaces between, as numbers, texts, lists and dicts."""
    return {name: plain(getattr(result, name)) for name in names.split()}


def plain(value: Any) -> Any:
    """A value as JSON has it: a complex number is a pair, a number that is not finite None."""
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Enum):
        return str(value)
    if isinstance(value, complex):
        return plain([value.real, value.imag])
    if isinstance(value, float) and not np.isfinite(value):
        return None
    if is_dataclass(value):
        return {one.name: plain(getattr(value, one.name)) for one in fields(value)}
    if hasattr(value, "_asdict"):
        return {name: plain(one) for name, one in value._asdict().items()}
    if isinstance(value, Mapping):
        return {name: plain(one) for name, one in value.items()}
    return [plain(one) for one in value] if isinstance(value, list | tuple) else value
