"""Periods, angle, parameters, and claims of one kind alone."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from typing import Any

from paper.tests.proofs.tampering.kind import (
    KINDS,
    TWO_PI,
    Certificate,
    kind,
    put,
    rounded,
    short,
)

# Periods and the angle


@kind("other number of periods")
def _(given: Certificate) -> Iterator[Any]:
    yield from ({**given, "periods": given["periods"] + k} for k in (1, 2, 10**4))


@kind("form: periods that are no number of periods")
def _(given: Certificate) -> Iterator[Any]:
    for other in (0, -1, 10**7, 10**400, 1.5, True, "1", None, [1]):
        yield {**given, "periods": other}


@kind("orbit given twice, or three times")
def _(given: Certificate) -> Iterator[Any]:
    for times in (2, 3):
        lists = {key: times * given[key] for key in ("fields", "durations", "states")}
        yield {**given, **lists, "periods": times * given["periods"]}
        yield {**given, **lists}


@kind("form: orbit without a switch over two periods")
def _(given: Certificate) -> Iterator[Any]:
    if len(given["fields"]) == 1:
        text = rounded(2 * TWO_PI / Decimal(given["parameters"]["omega"]))
        yield {**given, "periods": 2, "durations": [text]}


@kind("angle in another turn")
def _(given: Certificate) -> Iterator[Any]:
    for turns in (1, 2, 100):
        angle = Decimal(given["angle"]) + turns * TWO_PI
        yield {**given, "angle": rounded(angle)}
        if given["kind"] == "run":
            yield {
                **given,
                "angle": short(format(angle, "f"))[:60],
                "periods": given["periods"] + 1,
            }


@kind("angle shifted")
def _(given: Certificate) -> Iterator[Any]:
    for by in ("1e-29", "1e-10", "0.1", "3.141592653589793238462643383280"):
        angle = Decimal(given["angle"]) + Decimal(by)
        yield {**given, "angle": rounded(angle)}
        yield {**given, "angle": short(format(angle, "f"))}


@kind("angle of 0")
def _(given: Certificate) -> Iterator[Any]:
    if Decimal(given["angle"]):
        yield {**given, "angle": "0"}
        yield {**given, "angle": rounded(Decimal(0))}


@kind("form: half a turn away, with the opposite excitation")
def _(given: Certificate) -> Iterator[Any]:
    angle = rounded((Decimal(given["angle"]) + TWO_PI / 2) % TWO_PI)
    if given["kind"] == "orbit":
        yield put(
            {**given, "angle": angle}, ("parameters", "alpha"), f"-{given['parameters']['alpha']}"
        )
    if given["kind"] == "bifurcation":
        yield {**given, "angle": angle, "free": {"alpha": f"-{given['free']['alpha']}"}}


# Parameters


for parameter in ("alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b"):

    def other(given: Certificate, name: str = parameter) -> Iterator[Any]:
        if name in given["parameters"]:
            old = Decimal(given["parameters"][name])
            for new in (old + Decimal("1e-25"), old * 2, old / 2, Decimal(0), old + 10**30):
                if new != old:
                    yield put(given, ("parameters", name), short(format(new, "f")))

    KINDS[f"other {parameter}"] = other


@kind("parameters exchanged")
def _(given: Certificate) -> Iterator[Any]:
    p = given["parameters"]
    for a in p:
        for b in p:
            if a < b and p[a] != p[b]:
                yield {**given, "parameters": {**p, a: p[b], b: p[a]}}


# Claims of one kind alone


@kind("stability denied or claimed")
def _(given: Certificate) -> Iterator[Any]:
    if given["kind"] == "orbit":
        yield {**given, "stable": not given["stable"]}


@kind("form: stability in other words")
def _(given: Certificate) -> Iterator[Any]:
    if given["kind"] == "orbit":
        for other in (int(given["stable"]), str(given["stable"]).lower(), None, []):
            yield {**given, "stable": other}


@kind("another segment of duration 0")
def _(given: Certificate) -> Iterator[Any]:
    if given["kind"] == "bifurcation":
        n = len(given["fields"])
        yield from ({**given, "still": [s]} for s in range(n + 1) if [s] != given["still"])


@kind("form: segments of duration 0 in another form")
def _(given: Certificate) -> Iterator[Any]:
    if given["kind"] == "bifurcation":
        (s,) = given["still"]
        for other in ([], [s, s], [s, s + 1], [-1], [float(s)], [bool(s)], [[s]], s, str(s), None):
            yield {**given, "still": other}


@kind("form: another free parameter, none, or two")
def _(given: Certificate) -> Iterator[Any]:
    if given["kind"] == "bifurcation":
        text = given["free"]["alpha"]
        yield {**given, "free": {}}
        yield {**given, "free": {"omega": text}}
        yield {**given, "free": {"alpha": text, "omega": text}}
        yield put(given, ("parameters", "alpha"), short(text))


@kind("another end, or start, of a run")
def _(given: Certificate) -> Iterator[Any]:
    if given["kind"] == "run":
        start = [rounded(Decimal(x)) for x in given["states"][0]]
        yield {**given, "end": start}
        for k in range(3):
            yield put(
                given, ("states", 0, k), short(format(Decimal(start[k]) + Decimal("1e-28"), "f"))
            )
            yield put(given, ("end", k), rounded(Decimal(given["end"][k]) + Decimal("1e-29")))


@kind("form: start of a run rounded, or what follows exact")
def _(given: Certificate) -> Iterator[Any]:
    if given["kind"] == "run":
        yield put(given, ("states", 0), [rounded(Decimal(x)) for x in given["states"][0]])
        yield put(given, ("angle",), rounded(Decimal(given["angle"])))
        yield put(given, ("end",), [*given["end"], "0"])


@kind("run cut off")
def _(given: Certificate) -> Iterator[Any]:
    if given["kind"] == "run":
        lists = {key: given[key][:-1] for key in ("fields", "durations", "states")}
        yield {**given, **lists, "end": given["states"][-1]}
