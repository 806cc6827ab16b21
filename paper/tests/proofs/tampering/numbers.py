"""Numbers changed, or written in another way."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from decimal import Decimal
from typing import Any

from paper.tests.proofs.tampering.kind import (
    KINDS,
    Certificate,
    places,
    put,
    rounded,
    value,
)


def moved(text: str, by: int, digit: int) -> str | None:
    """Text with a digit moved, counted from the end."""
    where = [k for k, c in enumerate(text) if c.isdigit()]
    if digit >= len(where):
        return None
    at = where[-1 - digit]
    return f"{text[:at]}{(int(text[at]) + by) % 10}{text[at + 1 :]}"


def each_number(change: Callable[[str], Any]) -> Callable[[Certificate], Iterator[Certificate]]:
    def changed(given: Certificate) -> Iterator[Certificate]:
        for at in places(given):
            old = value(given, at)
            new = change(old)
            if new is not None and new != old:
                yield put(given, at, new)

    return changed


for by in (1, 9, 5):
    for digit in (0, 1, 3, 9, 20, 29):
        KINDS[f"digit {digit} from the end moved by {by}"] = each_number(
            lambda text, by=by, digit=digit: moved(text, by, digit)
        )
KINDS["sign changed"] = each_number(
    lambda text: text[1:] if text[0] == "-" else f"-{text}" if Decimal(text) else None
)
KINDS["ten times"] = each_number(
    lambda text: rounded(10 * Decimal(text)) if len(text) > 30 and Decimal(text) else None
)
KINDS["to the next integer"] = each_number(
    lambda text: rounded(Decimal(math.ceil(Decimal(text)))) if len(text) > 30 else None
)
NUMBERS: dict[str, Callable[[str], Any]] = {
    "digit dropped": lambda text: text[:-1] if len(text) > 30 else None,
    "15 digits dropped": lambda text: text[:-15] if len(text) > 30 else None,
    "zero added": lambda text: f"{text}0" if "." in text else f"{text}.0",
    "zero before": lambda text: f"-0{text[1:]}" if text[0] == "-" else f"0{text}",
    "plus sign": lambda text: f"+{text}",
    "minus zero": lambda text: f"-{text}" if not Decimal(text) else None,
    "exponent": lambda text: f"{text}e0",
    "exponent of a million": lambda text: f"{text}e1000000",
    "space before": lambda text: f" {text}",
    "line after": lambda text: f"{text}\t",
    "comma": lambda text: text.replace(".", ",") if "." in text else f"{text},0",
    "point at its end": lambda text: f"{text}." if "." not in text else None,
    "point at its start": lambda text: text.replace("0.", ".") if text[:2] == "0." else None,
    "radius": lambda text: f"{text} +/- 1",
    "ball": lambda text: f"[{text} +/- 1e-40]",
    "fraction": lambda text: f"{text}/1",
    "underscore": lambda text: f"0_{text}",
    "other digits": lambda text: text.translate({48 + k: 0x660 + k for k in range(10)}),
    "nan": lambda text: "nan",
    "infinity": lambda text: "inf",
    "empty text": lambda text: "",
    "word": lambda text: "pi",
    "400 digits": lambda text: "9" * 400 + text,
    "integer": lambda text: int(Decimal(text)),
    "null": lambda text: None if text == "0" else [],
    "list": lambda text: [text],
    "object": lambda text: {"value": text},
    "truth value": lambda text: True,
}
for name, change in NUMBERS.items():
    KINDS[f"form: number with {name}"] = each_number(change)
