"""A printed statement beside what is derived: the item that holds both."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from capsule_sym._paper import Entry
from capsule_sym._symbolic.proofs.items import AS_PRINTED, Item, Verdict

_READ = {
    "clear": "",
    "doubtful": " (doubtful scan: {})",
    "illegible": " (illegible in the scan: {})",
}


def as_read(entry: Entry, text: str) -> str:
    """A printed text with the doubt about its reading, if there is one."""
    return text + _READ[entry.reading].format(entry.note)


def comparison(
    entry: Entry,
    name: str,
    statement: str,
    printed: str,
    claim: Any,
    check: Callable[[Any], bool],
    mutant: Any,
    *,
    derived: str = AS_PRINTED,
    verdict: Verdict = "proved",
    proof: str,
    consequence: str = "",
    formula: str = "",
    witness: Callable[[], Mapping[str, str]] | None = None,
) -> Item:
    """The item named `printed.`name, or `erratum.`name where the printed statement is refuted.

    Whatever of the paper `check` needs is in the claim.
    """
    return Item(
        id=f"{'erratum' if verdict == 'refuted' else 'printed'}.{name}",
        equation=entry.place,
        statement=statement,
        claim=claim,
        check=check,
        mutant=mutant,
        formula=formula,
        verdict=verdict,
        printed=as_read(entry, printed),
        derived=derived,
        proof=proof,
        consequence=consequence,
        witness=witness,
    )


def listed(names: Any) -> str:
    """Names as a list in words."""
    return ", ".join(map(str, names)) or "none"
