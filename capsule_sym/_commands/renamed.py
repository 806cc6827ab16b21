"""Old spellings of commands and options, which are accepted until version 0.3."""

from __future__ import annotations

import re
from collections.abc import Sequence

_V = r"[\0=]([^\0=]+)"
_WORD = r"\0([^\0=]+)"
# Regular expressions of old words by command, on a line whose words are separated by \0.
_OLD: dict[str, list[tuple[str, str]]] = {
    r"diagram|sweep-figure": [(r"diagram|sweep-figure", "figure")],
    r"sweep|basin": [("--store", "--out")],
    "verify": [("--write", "--out")],
    "enclose": [("--seconds", "--max-seconds")],
    "attractors": [
        ("--count", "--starts"),
        ("--threads", "--workers"),
        (rf"--along{_V}=([^\0]+)", r"--\1\0\2"),
    ],
    "orbit": [(rf"--along{_V}{_WORD}{_WORD}", r"--along\0\1=\2:\3")],
    "pulse": [("--most-periods", "--max-periods")],
    "branch": [
        (rf"--parameter{_V}\0--from{_V}\0--to{_V}", r"--along\0\1=\2:\3"),
        (rf"--parameter{_V}\0--to{_V}", r"--to\0\1=\2"),
    ],
    "design|optimise|pulse|tolerances": [
        (rf"--(tolerance|normal){_V}{_WORD}", r"--\1\0\2=\3"),
    ],
}


def renewed(words: Sequence[str]) -> tuple[list[str], str]:
    """Words of a line in the present spelling, and a notice if they have changed."""
    given, *rest = "\0".join(words).split("\0--\0", 1)
    told = []
    for names, changes in _OLD.items():
        if not re.match(rf"({names})(?=\0|$)", given):
            continue
        for old, new in changes:

            def change(found: re.Match[str], new: str = new) -> str:
                now = found.expand(new)
                told.append(f"{found[0]} is now {now}".replace("\0", " "))
                return now

            given = re.sub(rf"(?<![^\0]){old}(?=[\0=]|$)", change, given)
    line = "\0--\0".join([given, *rest])
    notice = f"{', '.join(told)}; version 0.3 drops the old spelling" if told else ""
    return line.split("\0") if words else [], notice
