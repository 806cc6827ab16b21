"""Tampered certificates, without those that state something else that is true."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from typing import Any

from capsule_sym._enclosures.certificates import checker
from paper.tests.proofs.tampering import claims, files, keys, numbers, segments
from paper.tests.proofs.tampering.kind import KINDS
from tests.enclosures.certified import produced

ADDED = claims, files, keys, numbers, segments  # modules that add their kinds
EACH = ("orbit 0.003", "orbit 0.7", "bifurcation 1", "run")


def tampered(kind: str, names: tuple[str, ...], count: int) -> Iterator[Any]:
    """Tampered certificates of a kind, so many of each certificate at most."""
    for name in names:
        given = produced()[name]
        found = [
            one
            for one in KINDS[kind](given)
            if one != given and not (as_true(given, one) or same_corner(given, one))
        ]
        yield from random.Random(kind + name).sample(found, min(count, len(found)))


UNFELT = {
    (2,): ("delta", "beta", "gamma", "f_b"),
    (2, 5): ("gamma", "f_b"),
    (5, 2): ("beta", "gamma", "f_b"),
    (4, 5, 2, 5): ("gamma",),
}
"""Parameters that a capsule that always sticks does not feel: with others it is the same orbit."""


def same_corner(given: Any, other: Any) -> bool:
    """True if the segment of duration 0 is that of the other order of contact and drift there.

    At a corner either may come first: from F4 to F2 by F5 or by F1.
    """
    if given["kind"] != "bifurcation" or given.keys() != other.keys():
        return False
    if {**other, "fields": given["fields"]} != given:
        return False
    (i,), fields = given["still"], given["fields"]
    before, after = fields[i - 1], fields[(i + 1) % len(fields)]
    (one, way), (two, then) = divmod(before - 1, 3), divmod(after - 1, 3)
    either = {3 * one + then + 1, 3 * two + way + 1}
    changed = [*fields[:i], *(either - {fields[i]}), *fields[i + 1 :]]
    return one != two and way != then and other["fields"] == changed


def as_true(given: Any, other: Any) -> bool:
    """True if only parameters are changed that a motion does not feel, in the same form."""
    names = UNFELT.get(tuple(given["fields"]), ())
    if given["kind"] == "run" or given.keys() != other.keys():
        return False
    p, q = given["parameters"], other["parameters"]
    if not isinstance(q, dict) or p.keys() != q.keys():
        return False
    changed = {name for name in p if p[name] != q[name]}
    return changed <= {*names} and {**other, "parameters": p} == given and written(q)


def written(parameters: dict[str, Any]) -> bool:
    return all(
        isinstance(text, str) and re.fullmatch(checker.GIVEN, text) and len(text) <= 400
        for text in parameters.values()
    )
