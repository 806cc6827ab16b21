"""Kinds of tampering by name, and helpers.

Each kind yields what is to be refused. A kind whose name begins with "form" breaks the schema.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from decimal import Decimal, getcontext
from typing import Any

Certificate = dict[str, Any]
Place = tuple[Any, ...]
getcontext().prec = 450
TWO_PI = Decimal("6.283185307179586476925286766559005768394338798750211641949889184615632812572418")

KINDS: dict[str, Callable[[Certificate], Iterator[Any]]] = {}


def kind(name: str) -> Callable[[Any], Any]:
    def add(function: Any) -> Any:
        KINDS[name] = function
        return function

    return add


def places(given: Any, at: Place = ()) -> Iterator[Place]:
    """Places of all numbers that are written as texts."""
    items = given.items() if isinstance(given, dict) else enumerate(given)
    for key, value in items:
        if isinstance(value, dict | list):
            yield from places(value, (*at, key))
        elif isinstance(value, str) and key != "kind":
            yield (*at, key)


def value(given: Any, at: Place) -> Any:
    for key in at:
        given = given[key]
    return given


def put(given: Certificate, at: Place, new: Any) -> Certificate:
    found = copy.deepcopy(given)
    value(found, at[:-1])[at[-1]] = new
    return found


def rounded(number: Decimal) -> str:
    text = format(number.quantize(Decimal("1e-30")), "f")
    return text if Decimal(text) else text.lstrip("-")


def short(text: str) -> str:
    found = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if found == "-0" else found
