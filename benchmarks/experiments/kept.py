"""Results kept in a file, one line each, so that stopped work resumes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

Record = dict[str, Any]


def kept(
    path: Path, judged: Callable[[int], Record], enough: Callable[[list[Record]], bool]
) -> list[Record]:
    """The records in a file, and those of further numbers, which join it until there are enough."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    known = [json.loads(line) for line in lines]
    with path.open("a", encoding="utf-8") as file:
        while not enough(known):
            known.append(judged(len(known)))
            file.write(json.dumps(known[-1]) + "\n")
            file.flush()
    return known
