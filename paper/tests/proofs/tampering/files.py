"""Files of certificates in another form, and files that are no JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

from paper.tests.proofs.tampering.kind import Certificate


def file_of(*held: Any, **more: Any) -> dict[str, Any]:
    return {"version": 1, "certificates": [*held], **more}


FILES: dict[str, Callable[[Certificate], Iterator[Any]]] = {
    "form: no file": lambda given: iter([given, [given], None, 1, "x", [], {}]),
    "form: no version": lambda given: iter([{"certificates": [given]}]),
    "form: other version": lambda given: iter(
        {**file_of(given), "version": v} for v in (0, 2, "1", True, None, [1])
    ),
    "form: no certificate": lambda given: iter([file_of(), {"version": 1}]),
    "form: certificates in another form": lambda given: iter(
        {"version": 1, "certificates": v}
        for v in (given, {"0": given}, [[given]], [None], [1], [True], "x", 1)
    ),
    "form: certificate twice": lambda given: iter(
        [file_of(given, given), file_of(given, dict(reversed(given.items())))]
    ),
    "form: key beside the certificates": lambda given: iter(
        [file_of(given, note="x"), file_of(given, Version=1)]
    ),
    "form: second certificate broken": lambda given: iter([file_of(given, {}), file_of({}, given)]),
}


def texts(given: Certificate) -> Iterator[tuple[str, bytes]]:
    """Files that cannot be read as such JSON, by kind."""
    text = json.dumps(file_of(given))
    yield "empty", b""
    yield "blank", b" \n"
    yield "cut", text[: len(text) // 2].encode()
    yield "two documents", (text + text).encode()
    yield "comma at the end", (text[:-1] + ",}").encode()
    yield "comment", ("// note\n" + text).encode()
    yield "single quotes", text.replace('"', "'").encode()
    yield "not UTF-8", text.replace("orbit", "\xfc").encode("latin-1") + b"\xff"
    yield "UTF-16", text.encode("utf-16")
    yield "byte order mark", b"\xef\xbb\xbf" + text.encode()
    yield "null bytes", bytes(40)
    yield "deep", 100_000 * b"["
    yield "deep objects", 100_000 * b'{"a":'
    for number in ("NaN", "Infinity", "-Infinity", "1e5", "1e400", "1.0", "0x1", "01", "9" * 5000):
        yield f"number {number[:9]}", text.replace('"version": 1', f'"version": {number}').encode()
        fields = f'"fields": [{number}, '
        yield f"field {number[:9]}", text.replace('"fields": [', fields).encode()
    for key in ("version", "kind", "fields", "angle", "alpha", "states", "certificates"):
        yield f"{key} twice", text.replace(f'"{key}":', f'"{key}": 1, "{key}":', 1).encode()
