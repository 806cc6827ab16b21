"""The command `enclose`: Section 4 proved in ball arithmetic."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import command, option
from capsule_sym._texts import bars, tables
from paper.processes import end, spawning, undisturbed

if TYPE_CHECKING:
    from capsule_sym._native import Watch


_HOUR = 3600.0
_EARLIER = option(type=click.Path(path_type=Path, dir_okay=False), metavar="EARLIER")


@command()
def enclose(
    *,
    thresholds: bool = False,
    region: Annotated[Path | None, options.written("FILE")] = None,
    from_rest: Annotated[Path | None, options.written("FILE")] = None,
    fastest: Annotated[Path | None, options.written("FILE")] = None,
    horseshoe: bool = False,
    plan: Annotated[Path | None, _EARLIER] = None,
    max_seconds: options.TimeLimit = 600.0,
    out: Annotated[Path | None, options.written("FILE.json")] = None,
    as_json: options.Json = False,
) -> None:
    """Prove Section 4 in ball arithmetic: every bifurcation, and all alpha between them.

    At both mass ratios each bifurcation is enclosed, with its type, line, order of contact and
    coefficient (alpha changes by coefficient times duration^order as a segment is inserted). On
    each interval between them existence, uniqueness, itinerary and stability of the orbit are
    proved, part by part, except for 6e-13 on either side of a bifurcation. This takes about two
    minutes on two cores. The two mass ratios at which two bifurcations coincide are enclosed too,
    and the curves of both are proved to cross there. Exits with 1 if a step is not proved, such as
    after --max-seconds.

    With --region the plane 0.001 <= alpha <= 2, 1.5 <= gamma <= 5 is proved patch by patch: one
    stable orbit with one itinerary on each patch. With --from-rest, at both mass ratios and for
    alpha in [0.001, 2], the motion from (0, 0, 0) is proved to tend to a periodic one, interval by
    interval. With --fastest, for alpha in [1.9, 2] and omega in [0.75, 0.79], the average velocity
    of the motion from rest is proved to be at most 1e-6 above that at alpha = 2, omega =
    0.76828901338, part by part. All show the proved share of the whole, and --plan spares the
    attempts that failed in an earlier run, also one of other code. With --horseshoe seven sets of
    states are proved to cover each other after one period, so that chaotic motions exist, at alpha
    = 0.3, omega = 0.55, delta = 0.3, zeta = 0.05, beta = 25, gamma = 6.

    Parameters
    ----------
    thresholds
        Only the bifurcations, not the intervals.
    region
        Prove the (alpha, gamma) plane instead; FILE keeps the parts.
    from_rest
        Prove the motions from rest instead; FILE keeps the parts.
    fastest
        Prove the largest average velocity instead; FILE keeps the parts.
    horseshoe
        Prove a horseshoe instead, that is chaotic motions.
    plan
        Begin a new file of parts with the halvings of this earlier one.
    out
        Write certificates of all bifurcations and of the orbits of Fig. 7 (with --horseshoe that of
        the horseshoe) here.
    """
    options.check_beside("region", never=("from_rest", "fastest", "thresholds", "out"))
    options.check_beside("from_rest", never=("fastest", "thresholds", "out"))
    options.check_beside("fastest", never=("thresholds", "out"))
    options.check_beside("plan", needs=tuple(_PARTS))
    options.check_beside("horseshoe", never=(*_PARTS, "thresholds"))
    options.require("flint")
    for name, path in (("region", region), ("from_rest", from_rest), ("fastest", fastest)):
        if path is not None:
            seconds = max_seconds if options.is_given("max_seconds") else _HOUR
            _parts(name, path, plan, seconds, as_json)
            return
    if horseshoe:
        _horseshoe(out, max_seconds, as_json)
        return
    from capsule_sym._files import write_whole
    from capsule_sym._records import dumps
    from paper.proofs.case import GAMMAS

    begin = perf_counter()
    deadline = begin + max_seconds
    calls: list[tuple[Any, ...]] = [
        (_proved, gamma, not thresholds, out is not None, deadline) for gamma in GAMMAS
    ]
    calls.append((_met, deadline))
    *told, (meetings, unmet) = _on_two_cores(calls, "Enclosing both mass ratios")
    records = [section for section, _, _ in told]
    seconds = perf_counter() - begin
    if as_json:
        record = {"sections": records, "codimension_two": meetings, "seconds": round(seconds, 1)}
        click.echo(json.dumps(record | {"orbit_seconds": round(_one_orbit(), 3)}))
    else:
        _print(records, meetings, thresholds, seconds)
    missing = [*unmet, *(reason for _, _, reasons in told for reason in reasons)]
    if out is not None:
        from capsule_sym._enclosures.interface import file_of

        held = [one for _, kept, _ in told for one in kept]
        if held:  # the file is unchanged if nothing is proved
            write_whole(out, dumps(file_of(held)) + "\n", "--out")
            click.echo(f"wrote {len(held)} certificates to {out}", err=True)
    if missing:
        present.fail(f"not proved: {'; '.join(dict.fromkeys(missing))}", 1)
    if any(one["failed"] for one in records):
        raise click.exceptions.Exit(1)


_PARTS = {
    "region": ("PLANE", "the plane", "itinerary"),
    "from_rest": ("FROM_REST", "the motions from rest", "itinerary"),
    "fastest": ("DRIVES", "the largest velocity", "velocity"),
}
"""Tasks of `subdivision` by option, what they prove, and what a proved part is called by."""


def _parts(
    option: str, path: options.Path, plan: Path | None, seconds: float, as_json: bool
) -> None:
    from paper.proofs import subdivision

    name, what, column = _PARTS[option]
    task: subdivision.Task = getattr(subdivision, name)
    with bars.reporting(f"Proving {what}") as progress:

        def report(plane: subdivision.Plane) -> None:
            progress(f"{plane.share:.2%} in {plane.patches} parts")

        try:
            plane = subdivision.prove(path, seconds, report=report, task=task, plan=plan)
        except KeyboardInterrupt:
            raise present.interrupted(path) from None
    shares = sorted(plane.shares.items(), key=lambda one: -one[1])
    if as_json:
        told = {"share": plane.share, "patches": plane.patches, "itineraries": dict(shares)}
        told |= {"seconds": round(plane.seconds, 1), "work": round(plane.work, 1)}
        click.echo(json.dumps(told))
        return
    rows = [*shares, ("all", plane.share)]
    console = tables.make_console()
    tables.table((column, "share"), ((name, f"{share:.2%}") for name, share in rows))
    console.print(f"{plane.patches} parts, {plane.work:.0f} s of one core")


def _horseshoe(out: options.Path | None, max_seconds: float, as_json: bool) -> None:
    from capsule_sym._enclosures.interface import Unproved
    from capsule_sym._files import write_whole
    from capsule_sym._native import Watch
    from capsule_sym._records import dumps
    from paper.proofs.horseshoe import Horseshoe, kept, prove_horseshoe

    begin, found = perf_counter(), list[Horseshoe]()
    try:
        with Watch(max_seconds):
            sets = range(len(kept()["sets"]))
            steps = (prove_horseshoe(kept(), (number,)) for number in sets)
            found += bars.track(steps, "Proving the horseshoe", len(sets))
    except Unproved as error:
        present.fail(f"not proved: {error}", 1)
    if len(found) < len(sets):
        present.fail("not proved: the time was over", 1)
    if out is not None:
        write_whole(out, dumps(kept()) + "\n", "--out")
        click.echo(f"wrote the certificate to {out}", err=True)
    rows = [row for one in found for row in one.coverings]
    told = {
        "coverings": rows,
        "entropy": found[0].entropy,
        "parts": sum(one.parts for one in found),
    }
    if as_json:
        click.echo(json.dumps(told | {"seconds": round(perf_counter() - begin, 1)}))
        return
    covered = {i + 1: ", ".join(f"{j + 1}" for k, j in rows if k == i) for i, _ in rows}
    tables.table(("set", "covers"), ((f"{i}", text) for i, text in covered.items()))
    tables.make_console().print(
        f"{told['parts']} parts; topological entropy per period at least {told['entropy']:.6f}"
    )


def _on_two_cores(calls: Sequence[tuple[Any, ...]], text: str) -> list[Any]:
    """Results of calls, each a function with its arguments."""
    with undisturbed():
        pool = spawning(2)
        found = [pool.submit(*call) for call in calls]
    try:
        return list(bars.track((one.result() for one in found), text, len(calls)))
    finally:
        end(pool)


def _proved(
    gamma: str, intervals: bool, certify: bool, deadline: float
) -> tuple[dict[str, Any], list[dict[str, Any]], list[str]]:
    """Record of a mass ratio; on request its certificates, and the reasons for missing ones."""
    from paper.proofs.section4 import certified, prove_section, record

    limit = _until(deadline)
    kept, missing = certified(gamma, limit.left) if certify else ([], [])
    section = prove_section(gamma, intervals=intervals, max_seconds=limit.left)
    return record(section), kept, missing


def _met(deadline: float) -> tuple[list[dict[str, Any]], list[str]]:
    """Records of the mass ratios at which two bifurcations coincide, and reasons for gaps."""
    from capsule_sym._enclosures.interface import Unproved
    from paper.proofs.case import EXACT
    from paper.proofs.codimension_two import record, section4
    from paper.proofs.section4 import TIME_OVER

    try:
        with _until(deadline):
            return [record(one) for one in section4(EXACT)], []
    except Unproved as error:
        return [], [str(error)]
    return [], [TIME_OVER]


def _until(deadline: float) -> Watch:
    """Watch in a worker until a time of `perf_counter`, which all processes share."""
    from capsule_sym._native import Watch

    return Watch(deadline - perf_counter())


def _one_orbit() -> float:
    """Time in seconds to certify one orbit of six segments."""
    found = capsule_sym.solve_orbit(capsule_sym.Parameters(alpha=1.2))
    assert found.success
    begin = perf_counter()
    capsule_sym.certify_orbit(found)
    return perf_counter() - begin


_EVENTS = {
    **{name: f"{{0[{name}]}}" for name in ("type", "line", "order")},
    "coefficient": "{1:.6g}",
    "alpha": "{0[alpha]}",
}
_INTERVALS = {
    "orbit": "{0}",
    "from": "{1[from]:.13f}",
    "to": "{1[to]:.13f}",
    "boxes": "{1[boxes]}",
}
_MEETINGS = {
    "two at once": "{0[type]}",
    "alpha, gamma": "{0[alpha]}\n{0[gamma]}",
    "dα/dγ of both curves": "{0[slopes][0]:.9f} and {0[slopes][1]:.9f}",
}


def _table(columns: Mapping[str, str], rows: Iterable[Any]) -> None:
    tables.table(columns, ([text.format(*row) for text in columns.values()] for row in rows))


def _print(
    records: Sequence[dict[str, Any]],
    meetings: Sequence[dict[str, Any]],
    thresholds: bool,
    seconds: float,
) -> None:
    console = tables.make_console()
    for one in records:
        console.print(f"γ = {one['gamma']}")
        _table(_EVENTS, ((event, float(event["coefficient"])) for event in one["thresholds"]))
        if not thresholds:
            _table(_INTERVALS, ((" ".join(row["itinerary"]), row) for row in one["intervals"]))
        if one["failed"]:
            console.print(f"not proved: {one['failed']}")
        console.print()
    _table(_MEETINGS, zip(meetings))
    console.print()
    count = sum(len(one["thresholds"]) for one in records)
    worst = max((e["radius"] for one in records for e in one["thresholds"]), default=0.0)
    goals = [("bifurcations with type", f"{count}, within {worst:.0e}", "16, within 1e-30")]
    if not thresholds:
        left = " and ".join(f"{one['unproved']:.1e}" for one in records)
        goals.append(("alpha in [0.001, 2] not proved", left, "1e-11 at each mass ratio"))
    tables.table(("", "proved", "goal"), [*goals, ("seconds", f"{seconds:.0f}", "300")])
