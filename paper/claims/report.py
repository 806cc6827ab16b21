"""Report of `python -m paper claims --out`: Markdown, in the order of the paper.

Errata and the printed statements that hold are written one by one, and Tables 1, 2 and 3 beside
the derived ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby

from capsule_sym._symbolic.theory import (
    SEGMENTS,
    Finding,
    Report,
    counts,
    leaves_of,
    marked,
    math,
    point,
    surface_transitions,
    table,
    theorems,
)
from paper.claims.case_study import BRACKETS
from paper.claims.formulas import with_formulas
from paper.claims.tables import printed_maps
from paper.derived.local_maps import SCENARIOS, local_maps
from paper.derived.reachability import witnesses
from paper.derived.tables import mechanism
from paper.printed import events, read

_HEAD = """\
# The printed statements beside their derivation

Written by `python -m paper claims --out`. Equation, table, figure and section numbers are those of
B. Guo and Y. Liu, *Three-dimensional map for a piecewise-linear capsule system with bidirectional
drifts*, Physica D (2019), doi 10.1016/j.physd.2019.04.008, and so is the notation:
P1 = v<sub>c</sub>, P2 = x<sub>r</sub>, P3 = x<sub>r</sub> + 2ζ v<sub>r</sub>,
P4 = P3 + β (x<sub>r</sub> − δ). A prime is a derivative in time.

- **proved**: the statement holds for all parameters, states and times in its scope;
- **refuted**: a statement of the paper that fails; its witness is an exact point where it does;
- **conditional**: it holds under the condition it names, and the condition is proved.

Names that the paper does not have: **n** is the inner product on L1-L4 of the normal that points
out of stick with the field of stick, positive where stick ends; **L10** is the part of P1 = 0,
P2 = δ with v<sub>r</sub> < 0 and P3 > f<sub>b</sub>, present for δ > f<sub>b</sub>; **O3** is the
point (δ, 0, 0), where L9 crosses P1 = 0.

Every proof below is a computation that the command repeats. Signs and inclusions are decided by
*eliminating the variables* (Fourier-Motzkin elimination: exact for relations linear in the state,
the force, α, δ and f<sub>b</sub> whose coefficients have a known sign); at a witness the printed
relation is evaluated in rational numbers. The sentence after "Proof" is the same argument by hand.
"""


def _alike(result: Finding) -> tuple[str, ...]:
    """Key of printed statements that are shown together."""
    item = result.statement
    return item.equation, result.status, item.derived, item.proof, item.consequence


def _beside(results: Sequence[Finding], number: int) -> Iterator[str]:
    """Printed statements that are alike, with the derivation, the proof, and the witnesses."""
    item, last = results[0].statement, number + len(results) - 1
    numbers = f"{number}" if len(results) == 1 else f"{number}–{last}"
    yield f"### {numbers}. {item.equation}: {results[0].status}\n"
    once = len({one.statement.printed for one in results}) == 1
    if once:
        yield f"- **Printed:** {with_formulas(item.printed)}"
    yield f"- **Derived:** {with_formulas(item.derived)}"
    if item.proof:
        yield f"- **Proof:** {marked(item.proof)}"
    if item.consequence:
        yield f"- **Consequence:** {marked(item.consequence)}"
    for one in results:
        own = one.statement.says if once else one.statement.printed
        label = "" if len(results) == 1 else f": {with_formulas(own)}"
        yield f"- `{one.statement.name}`, settled in {one.seconds:.2f} s{label}"
        if one.witness:
            yield f"  - **Witness:** {point(one)}"
        if one.statement.latex:
            yield f"  - **In formulas:**\n\n    $${math(one.statement.latex)}$$\n"
    yield ""


_SECTION_4 = """\
Bifurcations of Section 4, each between two values of α at which the attracting motions are proved
to differ: each orbit is enclosed by Krawczyk's method in ball arithmetic, its guards are proved
positive along every segment, and its multipliers inside the unit circle. `python -m paper enclose`
encloses the values themselves.
"""


def _values() -> Iterator[str]:
    """Printed bifurcation values with the proved brackets."""
    yield _SECTION_4
    yield from table(
        ("Event", "Line", "Printed α", *(f"α at γ = {ratio}" for ratio in BRACKETS)),
        (
            (
                event.type,
                event.line,
                event.alpha,
                *(f"{b[number].below} to {b[number].above}" for b in BRACKETS.values()),
            )
            for number, event in enumerate(events(read()))
        ),
    )


_HEADS = ("Source space", "Target space", "Source vector", "Target vector", "Operation mode")


def _passage(source: int, target: int) -> tuple[str, ...]:
    modes = f"{SEGMENTS[source - 1].mode} → {SEGMENTS[target - 1].mode}"
    return f"Ω{source}", f"Ω{target}", f"F{source}", f"F{target}", modes


def _mark(holds: bool) -> str:
    return "yes" if holds else "—"


def _table_1() -> Iterator[str]:
    derived = {(t.surface, t.source, t.target) for t in surface_transitions()}
    shown = {tuple(row[:3]) for row in read()["table.1"]["rows"]}
    rows = sorted(derived | shown, key=lambda row: (int(row[0][1:]), row[1:]))
    yield "Each row: printed, and derived from the signs of the inner products.\n"
    yield from table(
        ("Surface", *_HEADS, "Printed", "Derived"),
        ((row[0], *_passage(*row[1:]), _mark(row in shown), _mark(row in derived)) for row in rows),
    )


_WHEN = {"+": "n > 0", "-": "n < 0", "0-": "n = 0 > n′", "0+": "n = 0 < n′"}


def _passages(line: str) -> dict[tuple[int, int], str]:
    """Sources and targets of a line with the condition under which they occur."""
    if line in ("L1", "L2", "L3", "L4"):
        found: dict[tuple[int, int], list[str]] = {}
        for sign, (sources, targets) in mechanism(line).items():
            for source in sources:
                for target in targets:
                    found.setdefault((source, target), []).append(_WHEN[sign])
        return {pair: " or ".join(signs) for pair, signs in found.items()}
    return {
        (source, target): "always"
        for leaf in leaves_of(line)
        for source in leaf.arrives
        for target in leaf.departs
    }


def _table_2() -> Iterator[str]:
    yield "Each row: whether it is printed, and when it occurs as derived (off the corners).\n"
    shown = {tuple(row[:3]) for row in read()["table.2"]["rows"]}
    lines = [f"L{i}" for i in (*range(1, 9), 10)]
    rows = []
    for line in lines:
        derived = _passages(line)
        pairs = {(s, t) for place, s, t in shown if place == line} | set(derived)
        rows += [
            (line, *_passage(*pair), _mark((line, *pair) in shown), derived.get(pair, "never"))
            for pair in sorted(pairs, key=lambda pair: pair[::-1])
        ]
    yield from table(("Line", *_HEADS, "Printed", "Derived: occurs"), rows)


def _table_3() -> Iterator[str]:
    yield "Each local map: whether it is printed, and the cases in which it occurs as derived."
    yield "A map occurs where a witness is proved (`table3.*` above) and is excluded elsewhere.\n"
    regimes = [(name, damped) for damped in (True, False) for name in SCENARIOS]
    occurs = {(witness.local_map, *witness.regime) for witness in witnesses()}
    shown = printed_maps(read())
    heads = [f"{name}, {'ζ > 0' if damped else 'ζ = 0'}" for name, damped in regimes]
    yield from table(
        ("Map", "Vector", "Operation", "Printed", *heads),
        (
            (
                str(one),
                f"F{one.field}",
                SEGMENTS[one.field - 1].mode,
                _mark(one in shown),
                *(_mark((one, *regime) in occurs) for regime in regimes),
            )
            for one in local_maps()
        ),
    )


def _tables_1_2() -> Iterator[str]:
    yield "### Table 1\n"
    yield from _table_1()
    yield "\n### Table 2\n"
    yield from _table_2()


_TABLES: dict[str, Callable[[], Iterator[str]]] = {
    "Printed statements that hold": _values,
    "Tables 1 and 2": _tables_1_2,
    "Table 3": _table_3,
}
"""Tables at the beginning of a section, by its title."""


def markdown(report: Report) -> str:
    """Report with every statement in the order of the sections, then the derived tables."""
    lines, number = [_HEAD, counts(report)], 1
    for title, section in {**report, **dict.fromkeys(("Tables 1 and 2", "Table 3"), ())}.items():
        lines += [f"## {title}\n"]
        if title in _TABLES:
            lines += [*_TABLES[title](), ""]
        if section and not section[0].statement.printed:
            lines += theorems(section)
            continue
        for _, alike in groupby(section, _alike):
            together = list(alike)
            lines += _beside(together, number)
            number += len(together)
    return "\n".join(lines).rstrip() + "\n"
