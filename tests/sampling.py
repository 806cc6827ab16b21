"""A part of many cases for the quick tests, and all of them for `make test-long`.

A test that tries only a part is marked `sampled`, so that the long ones run it again, whole.
"""

import os
from collections.abc import Iterable
from typing import TypeVar

import pytest

_Case = TypeVar("_Case")

ALL = os.environ.get("CAPSULE_SYM_ALL") == "1"

sampled = pytest.mark.sampled


def many(count: int, quick: int) -> int:
    """Number of cases to try: a part of the count in quick tests."""
    return count if ALL else min(count, quick)


def some(cases: Iterable[_Case], quick: int) -> list[_Case]:
    """Cases spread evenly, so many of them in the quick tests."""
    held = list(cases)
    count = many(len(held), quick)
    return [held[i * len(held) // count] for i in range(count)]
