"""The command `case-study`."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING

import click

from capsule_sym._commands import options
from capsule_sym._commands.signature import command
from capsule_sym._records import dumps
from capsule_sym._texts import bars, tables

if TYPE_CHECKING:
    from paper.study.casestudy import Case
    from paper.study.thresholds import Threshold


@command()
def case_study(*, out: options.Folder = None, as_json: options.Json = False) -> None:
    """Compute the case study of Section 4 and compare it with the printed one.

    Runs the sixteen α of Fig. 7 from rest until the motion is steady, at the printed γ = 3.3 and at
    γ = 3.0, and shows each exact global map beside the printed one. Two maps agree if they are the
    same cyclic sequence of local maps. Then continues the orbit from α = 0.005 to 2 at both γ and
    shows each exact bifurcation value beside the printed one. --out writes casestudy.json (the same
    as --json), cases.csv, segments.csv, thresholds.csv, and curves.csv with the bifurcations'
    curves in the plane of α and γ.

    Parameters
    ----------
    out
        Write casestudy.json and the tables to this directory.
    """
    from paper.study import casestudy, thresholds

    total = len(casestudy.GAMMAS) * len(casestudy.PANELS)
    cases = [*bars.track(casestudy.run(), "Running the case study", total)]
    total = len(casestudy.GAMMAS) * len(thresholds.PRINTED)
    done = count(1)
    with bars.reporting("Locating the bifurcations") as report:
        found = thresholds.compute(lambda: report(next(done), total))
    record = casestudy.record(cases) | {"bifurcations": thresholds.record(found)}
    paths = [] if out is None else casestudy.write(record, out) + thresholds.save(found, out)
    if as_json:
        click.echo(dumps(record))
    else:
        _print(cases, found)
    if paths:
        click.echo(f"wrote {', '.join(map(str, paths))}", err=True)


def _print(cases: list[Case], found: list[Threshold]) -> None:
    from paper.study import casestudy

    for gamma in casestudy.GAMMAS:
        _print_cases([case for case in cases if case.parameters.gamma == gamma], gamma)
    _print_thresholds(found)


def _print_thresholds(found: list[Threshold]) -> None:
    from paper.study.thresholds import conclusion

    numbers = ("exact α", "printed α", "place")
    rows = (
        (
            f"{one.gamma}",
            one.bifurcation.type,
            one.bifurcation.line,
            f"{float(one.bifurcation.value):.12f}",
            f"{one.printed.alpha}" if one.printed else "none",
            f"{one.place or ''}",
        )
        for one in found
    )
    console = tables.make_console()
    tables.table(("γ", "event", "line", *numbers), rows, right=numbers)
    console.print(f"\n{conclusion(found)}\n", soft_wrap=False)


def _print_cases(cases: list[Case], gamma: float) -> None:
    from rich.text import Text

    from paper.study.casestudy import THRESHOLDS

    def row(case: Case) -> tuple[str | Text, ...]:
        alpha, motion = case.parameters.alpha, case.motion
        exact = _folded(motion.global_map) if motion else f"not steady in {case.periods} periods"
        mark = "*" if alpha in THRESHOLDS else ""
        verdict = Text("agree", "green") if case.agrees else Text("differ", "red")
        return case.panel, f"{alpha}{mark}", exact, _folded(case.printed), verdict

    console = tables.make_console()
    console.print(f"γ = {gamma}\n")
    tables.table(("", "α", "exact", "printed", ""), map(row, cases))
    inside = [case for case in cases if case.parameters.alpha not in THRESHOLDS]
    console.print(
        f"\n{sum(case.agrees for case in cases)} of {len(cases)} agree; "
        f"{sum(case.agrees for case in inside)} of the {len(inside)} away from the printed "
        "bifurcation values (*).\n"
    )


def _folded(global_map: str) -> str:
    """Global map with two local maps to a line, so that the table fits 80 columns."""
    maps = global_map.split(" ∘ ")
    return " ∘\n".join(" ∘ ".join(maps[i : i + 2]) for i in range(0, len(maps), 2))
