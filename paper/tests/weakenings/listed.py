"""Weakenings as they are listed."""

from __future__ import annotations

import tomllib
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
CODE = "capsule_sym/_enclosures", "paper/proofs", "paper/tests/proofs", "tests/enclosures"
"""Folders of the proofs and of their tests."""


class Weakening(NamedTuple):
    """Text of a module of the proofs, what is put in its place, and the test that shows it.

    `file` and `test` are relative to the checkout, the test as pytest names it.
    """

    name: str
    file: str
    find: str
    put: str
    test: str

    @property
    def path(self) -> Path:
        """The module's file."""
        return ROOT / self.file

    @property
    def module(self) -> str:
        """Name under which the module is imported."""
        return ".".join(Path(self.file).with_suffix("").parts)

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
    """Digest of the proofs and of their tests, on which all results rest."""
    files = sorted(path for folder in CODE for path in (ROOT / folder).rglob("*.py"))
    return sha256(b"".join(path.read_bytes() for path in files)).hexdigest()
