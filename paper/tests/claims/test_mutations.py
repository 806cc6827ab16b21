"""No change of the transcription of the paper goes unnoticed."""

from __future__ import annotations

import json
import os
from collections import Counter
from functools import cache
from itertools import groupby
from pathlib import Path

import pytest

from paper.claims.frozen import expected
from paper.printed import read
from paper.tests.claims.mutations import Baseline, Mutation, mutations, noticed
from tests.sampling import sampled, some

LEAST = 150  # changes, as a floor: what is transcribed may grow


@cache
def baseline() -> Baseline:
    """The statements of the unchanged transcription."""
    return Baseline.of(read())


def _rows_of(line: str, target: int) -> Mutation:
    """Table 2 with another target for all rows of a line."""
    rows = read()["table.2"]["rows"]
    changed = [[on, s, target if on == line else t, *rest] for on, s, t, *rest in rows]
    return Mutation("table.2", ("rows",), rows, changed)


def _more(line: str, target: int) -> Mutation:
    """Table 2 with a second target for a line."""
    rows = read()["table.2"]["rows"]
    extra = [[on, s, target, *rest] for on, s, t, *rest in rows if on == line]
    return Mutation("table.2", ("rows",), rows, [*rows, *extra])


def _fewer(line: str, target: int) -> Mutation:
    """Table 2 without the rows of a line that lead to a target."""
    rows = read()["table.2"]["rows"]
    return Mutation("table.2", ("rows",), rows, [r for r in rows if (r[0], r[2]) != (line, target)])


def _moved(name: str, source: int, target: int) -> Mutation:
    """Eq. (15) with a surface or line in another subspace."""
    members = [list(names) for names in read()["equation.15"]["members"]]
    members[source - 1].remove(name)
    members[target - 1].append(name)
    return Mutation("equation.15", ("members",), None, members)


def _reversed_planes() -> Mutation:
    planes = read()["equation.24"]["planes"]
    return Mutation("equation.24", ("planes",), planes, [*planes[:6], *planes[:5:-1]])


NAMED = {
    "Table 2, L1 to 1 and 2": _more("L1", 2),
    "Table 2, L2 to 2 only": _fewer("L2", 3),
    "Table 2, L4 to 6": _rows_of("L4", 6),
    "Eq. (15), L7 in Ω5": _moved("L7", 2, 5),
    "Eq. (15), S1 in Ω3": _moved("S1", 1, 3),
    "Eq. (24), S7-S10 reversed": _reversed_planes(),
    "L2^(1)": Mutation(
        "appendix.B.L2",
        ("L2^(1)", 1),
        "",
        "v_r < -2*zeta*f_b - 2*zeta*alpha",
    ),
    "L3^(3)": Mutation("appendix.B.L3", ("L3^(3)", 0), "", "v_r > 2*zeta*(f_b - alpha)/(1 + beta)"),
    "another misprint as Eq. (23)": Mutation(
        "equation.23", ("value",), "", "-v_r + 2*zeta*f_b - 2*zeta*alpha*cos(omega*tau)"
    ),
    "Section 4, F4 to Σ2": Mutation(
        "section.4.5",
        ("map",),
        "",
        "P_{Σ5,F2,Σ2} ∘ P_{Σ2,F4,Σ4} ∘ P_{Σ4,F5,Σ5}",
    ),
    "Section 4, an identity of F5": Mutation("section.4.1", ("map",), "", "Id_{Σ2,F5,Σ2}"),
    "grazing on L9 as adding-sliding": Mutation("section.4.1", ("event",), "", "adding-sliding"),
    "0.0074 as 0.00745": Mutation("section.4.1", ("high",), "0.0074", "0.00745"),
}


@sampled
@pytest.mark.parametrize("name", some(NAMED, 7))
def test_named_mistyping_is_noticed(name: str) -> None:
    assert noticed(NAMED[name], baseline(), expected())


def test_unchanged_entry_is_not_noticed() -> None:
    """The run can fail: a change that is none is not noticed."""
    value = read()["equation.23"]["value"]
    assert not noticed(Mutation("equation.23", ("value",), value, value), baseline(), expected())


def test_every_entry_is_read_and_changed() -> None:
    entries = {entry.id for entry in read()}
    assert {mutation.entry for mutation in mutations(read())} == entries
    assert len(list(mutations(read()))) >= LEAST


_QUICK = ("equation.16", "equation.23", "section.3.3.b", "appendix.A")


@pytest.mark.parametrize("prefix", _QUICK)
def test_changes_are_noticed(prefix: str) -> None:
    chosen = [m for m in mutations(read()) if m.entry.startswith(prefix)][::6]
    assert chosen
    assert [str(m) for m in chosen if not noticed(m, baseline(), expected())] == []


@pytest.mark.long
def test_no_change_survives() -> None:
    """Every change of every entry; prints, for each entry, how many are noticed and how."""
    total: Counter[str] = Counter()
    survivors = []
    for entry, group in groupby(mutations(read()), lambda mutation: mutation.entry):
        how = {str(m): noticed(m, baseline(), expected()) for m in group}
        counts = Counter(by or "survived" for by in how.values())
        told = ", ".join(f"{count} {by}" for by, count in counts.most_common())
        print(f"{entry:<28} {len(how):4} changed: {told}", flush=True)
        survivors += [change for change, by in how.items() if not by]
        total += counts
    print(f"{'all':<28} {total.total():4} changed: {dict(total)}")
    if record := os.environ.get("CAPSULE_SYM_RECORD"):
        told = {"changes": total.total(), "survive": len(survivors), "noticed": dict(total)}
        Path(record).write_text(json.dumps(told) + "\n", encoding="utf-8")
    assert survivors == []
    assert total.total() >= LEAST
    # Most are noticed by a verdict, not only by the words that are frozen beside it.
    assert total["words"] < total.total() / 4
