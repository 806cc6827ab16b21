"""Old spellings of commands and options, which are accepted until version 0.3."""

from __future__ import annotations

import re
from collections.abc import Sequence

# Regular expressions of old words by command, on a line whose words are separated by \0.
_OLD = {
    r"diagram|sweep-figure": [(r"diagram|sweep-figure", "figure")],
    r"sweep|basin": [("--store", "--out")],
}


def renewed(words: Sequence[str]) -> tuple[list[str], str]:
    """The words of a line in today's spelling, and a notice if that is another."""
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
