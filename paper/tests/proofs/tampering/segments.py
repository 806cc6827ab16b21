"""States, durations and fields changed."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from decimal import Decimal
from typing import Any

from paper.tests.proofs.tampering.kind import (
    TWO_PI,
    Certificate,
    kind,
    put,
    rounded,
)


@kind("states exchanged")
def _(given: Certificate) -> Iterator[Any]:
    n = len(given["states"])
    for i in range(n):
        if given["states"][i] != given["states"][i - 1]:
            states = [*given["states"]]
            states[i], states[i - 1] = states[i - 1], states[i]
            yield {**given, "states": states}


@kind("states turned")
def _(given: Certificate) -> Iterator[Any]:
    for k in range(1, len(given["states"])):
        yield {**given, "states": given["states"][k:] + given["states"][:k]}


@kind("numbers within a state exchanged")
def _(given: Certificate) -> Iterator[Any]:
    for i, (x, v, c) in enumerate(given["states"]):
        for row in ([v, x, c], [x, c, v], [c, v, x]):
            if row != [x, v, c]:
                yield put(given, ("states", i), row)


@kind("form: number moved to the next state")
def _(given: Certificate) -> Iterator[Any]:
    for i in range(1, len(given["states"])):
        states = copy.deepcopy(given["states"])
        states[i].insert(0, states[i - 1].pop())
        yield {**given, "states": states}


@kind("form: states in one list")
def _(given: Certificate) -> Iterator[Any]:
    yield {**given, "states": [x for state in given["states"] for x in state]}
    yield {**given, "states": [[x for state in given["states"] for x in state]]}
    yield {**given, "states": [given["states"]]}


@kind("form: number of a state missing, or one too many")
def _(given: Certificate) -> Iterator[Any]:
    for i, state in enumerate(given["states"]):
        yield put(given, ("states", i), state[:2])
        yield put(given, ("states", i), [*state, state[2]])


@kind("state missing, or one too many")
def _(given: Certificate) -> Iterator[Any]:
    yield {**given, "states": [*given["states"], given["states"][-1]]}
    if len(given["states"]) > 1:
        yield {**given, "states": given["states"][:-1]}


@kind("duration missing, or one too many")
def _(given: Certificate) -> Iterator[Any]:
    yield {**given, "durations": [*given["durations"], given["durations"][-1]]}
    if len(given["durations"]) > 1:
        yield {**given, "durations": given["durations"][:-1]}


@kind("number moved from the states to the durations")
def _(given: Certificate) -> Iterator[Any]:
    *states, (x, v, c) = given["states"]
    yield {**given, "states": [*states, [x, v]], "durations": [c, *given["durations"]]}


@kind("durations exchanged")
def _(given: Certificate) -> Iterator[Any]:
    for i in range(1, len(given["durations"])):
        durations = [*given["durations"]]
        durations[i], durations[i - 1] = durations[i - 1], durations[i]
        yield {**given, "durations": durations}


@kind("switch shifted from one duration to the next")
def _(given: Certificate) -> Iterator[Any]:
    for i in range(1, len(given["durations"])):
        for by in ("1e-30", "1e-20", "1e-3"):
            first, second = (Decimal(given["durations"][k]) for k in (i - 1, i))
            durations = [*given["durations"]]
            durations[i - 1] = rounded(abs(first + Decimal(by)))
            durations[i] = rounded(abs(second - Decimal(by)))
            yield {**given, "durations": durations}


@kind("duration of 0")
def _(given: Certificate) -> Iterator[Any]:
    for i, text in enumerate(given["durations"]):
        if Decimal(text):
            yield put(given, ("durations", i), rounded(Decimal(0)))


@kind("segment longer by a period")
def _(given: Certificate) -> Iterator[Any]:
    turn = TWO_PI / Decimal(given["parameters"]["omega"])
    for i, text in enumerate(given["durations"]):
        longer = put(given, ("durations", i), rounded(Decimal(text) + turn))
        yield longer
        yield {**longer, "periods": given["periods"] + 1}


@kind("field of another number")
def _(given: Certificate) -> Iterator[Any]:
    for i, field in enumerate(given["fields"]):
        yield from (put(given, ("fields", i), other) for other in range(1, 7) if other != field)


@kind("fields turned or reversed")
def _(given: Certificate) -> Iterator[Any]:
    fields = given["fields"]
    others = [fields[k:] + fields[:k] for k in range(1, len(fields))] + [fields[::-1]]
    yield from ({**given, "fields": other} for other in others if other != fields)


@kind("form: field out of range")
def _(given: Certificate) -> Iterator[Any]:
    for other in (0, 7, -1, 10**20, True, 2.5, "2", None, [2]):
        yield put(given, ("fields", 0), other)


@kind("field missing, or one too many")
def _(given: Certificate) -> Iterator[Any]:
    yield {**given, "fields": [*given["fields"], 2]}
    if len(given["fields"]) > 2:
        yield {**given, "fields": given["fields"][:-1]}


@kind("segment missing")
def _(given: Certificate) -> Iterator[Any]:
    n = len(given["fields"])
    for i in range(n if n > 1 else 0):
        lists = ("fields", "durations", "states")
        yield {**given, **{k: given[k][:i] + given[k][i + 1 :] for k in lists}}


@kind("segment of duration 0 inserted")
def _(given: Certificate) -> Iterator[Any]:
    for i, state in enumerate(given["states"]):
        for field in range(1, 7):
            if i == 0 and given["kind"] == "run":
                continue
            more = {"fields": field, "durations": rounded(Decimal(0)), "states": state}
            yield {**given, **{k: [*given[k][:i], v, *given[k][i:]] for k, v in more.items()}}


@kind("segment in two parts")
def _(given: Certificate) -> Iterator[Any]:
    half = rounded(Decimal(given["durations"][-1]) / 2)
    yield {
        **given,
        "fields": [*given["fields"], given["fields"][-1]],
        "durations": [*given["durations"][:-1], half, half],
        "states": [*given["states"], given["states"][-1]],
    }


@kind("form: empty list")
def _(given: Certificate) -> Iterator[Any]:
    yield from ({**given, key: []} for key in given if isinstance(given[key], list))
    lists = ("fields", "durations", "states")
    yield {**given, **{key: [] for key in lists}}


@kind("another start of the same orbit")
def _(given: Certificate) -> Iterator[Any]:
    n = len(given["fields"])
    for k in range(1, n if given["kind"] != "run" else 0):
        spent = sum((Decimal(h) for h in given["durations"][:k]), Decimal(0))
        angle = (Decimal(given["angle"]) + Decimal(given["parameters"]["omega"]) * spent) % TWO_PI
        lists = {key: given[key][k:] + given[key][:k] for key in ("fields", "durations", "states")}
        still = {"still": [(s - k) % n for s in given["still"]]} if "still" in given else {}
        yield {**given, **lists, **still, "angle": rounded(angle)}
