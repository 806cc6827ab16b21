"""Weakenings as they are listed."""

from __future__ import annotations

import tomllib
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).parent
ROOM = HERE.parents[1] / "capsule_sym" / "_enclosures"
TESTS = HERE.parent / "enclosures"


class Weakening(NamedTuple):
    """Text of a module of the room of proofs, what is put in its place, and the test that shows it.

    `file` is relative to the room, `test` relative to its tests, as pytest names it.
    """

    name: str
    file: str
    find: str
    put: str
    test: str

    @property
    def path(self) -> Path:
        """The module's file."""
        return ROOM / self.file

    @property
    def module(self) -> str:
        """Name under which the module is imported."""
        return ".".join(("capsule_sym", ROOM.name, *Path(self.file).with_suffix("").parts))

    @property
    def weakened(self) -> str:
        """Source of the module with the weakening."""
        source = self.path.read_text(encoding="utf-8")
        if source.count(self.find) != 1:
            raise ValueError(f"{self.name}: {source.count(self.find)} times in {self.file}")
        return source.replace(self.find, self.put)


def listed() -> list[Weakening]:
    """All weakenings, of the prover and of the checker."""
    return [
        Weakening(**row)
        for path in sorted(HERE.glob("*.toml"))
        for row in tomllib.loads(path.read_text(encoding="utf-8"))["weakening"]
    ]


def digest() -> str:
    """Digest of the room of proofs and of its tests, on which all results rest."""
    files = sorted([*ROOM.rglob("*.py"), *TESTS.rglob("*.py")])
    return sha256(b"".join(path.read_bytes() for path in files)).hexdigest()
