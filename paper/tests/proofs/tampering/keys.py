"""Keys removed, added or renamed, and kinds exchanged."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from typing import Any

from paper.tests.proofs.tampering.kind import (
    Certificate,
    kind,
    put,
    rounded,
)


@kind("form: key removed")
def _(given: Certificate) -> Iterator[Any]:
    yield from ({k: v for k, v in given.items() if k != key} for key in given)


@kind("form: key of a parameter removed")
def _(given: Certificate) -> Iterator[Any]:
    for key in given["parameters"]:
        yield put(
            given, ("parameters",), {k: v for k, v in given["parameters"].items() if k != key}
        )


@kind("form: key added")
def _(given: Certificate) -> Iterator[Any]:
    for name, what in (("about", {}), ("note", "x"), ("", 1), ("version", 1), ("type", "grazing")):
        yield {**given, name: what}


@kind("form: claim of another kind added")
def _(given: Certificate) -> Iterator[Any]:
    more = {"stable": True, "still": [0], "free": {"alpha": given["durations"][0]}}
    more |= {"end": given["states"][0], "line": "L9", "coefficient": "1", "multipliers": []}
    yield from ({**given, k: v} for k, v in more.items() if k not in given)


@kind("form: parameter added")
def _(given: Certificate) -> Iterator[Any]:
    for name in ("f_plus", "s", "Alpha"):
        yield put(given, ("parameters", name), "1")


@kind("form: key renamed")
def _(given: Certificate) -> Iterator[Any]:
    yield from ({(k.upper() if k == key else k): v for k, v in given.items()} for key in given)


@kind("form: value of another type")
def _(given: Certificate) -> Iterator[Any]:
    for key in given:
        for other in (None, True, 0, "x", [], {}, [[]], [None], [{}]):
            if not (other is True and key == "stable"):
                yield {**given, key: other}


@kind("form: kind unknown")
def _(given: Certificate) -> Iterator[Any]:
    for other in ("", "Orbit", "orbits", "curve", ["orbit"], None, 1, {}):
        yield {**given, "kind": other}


@kind("form: kind of another certificate")
def _(given: Certificate) -> Iterator[Any]:
    yield from ({**given, "kind": k} for k in ("orbit", "bifurcation", "run") if k != given["kind"])


@kind("kind and keys of an orbit")
def _(given: Certificate) -> Iterator[Any]:
    if given["kind"] == "bifurcation":
        alpha = given["free"]["alpha"].rstrip("0").rstrip(".")
        kept = {k: v for k, v in given.items() if k not in ("free", "still")}
        kept |= {"kind": "orbit", "parameters": {**given["parameters"], "alpha": alpha}}
        yield from ({**kept, "stable": stable} for stable in (True, False))
    if given["kind"] == "run":
        kept = {k: v for k, v in given.items() if k != "end"} | {"kind": "orbit"}
        kept["angle"] = rounded(Decimal(given["angle"]))
        kept["states"] = [[rounded(Decimal(x)) for x in one] for one in given["states"]]
        yield from ({**kept, "stable": stable} for stable in (True, False))


@kind("kind and keys of a bifurcation")
def _(given: Certificate) -> Iterator[Any]:
    if given["kind"] == "orbit" and len(given["fields"]) > 1:
        free = {"alpha": rounded(Decimal(given["parameters"]["alpha"]))}
        kept = {k: v for k, v in given.items() if k != "stable"} | {"free": free}
        kept["parameters"] = {k: v for k, v in given["parameters"].items() if k != "alpha"}
        for s in range(len(given["fields"])):
            yield kept | {"kind": "bifurcation", "still": [s]}
