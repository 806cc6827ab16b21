"""`make verify`: what is to be reached by the proofs, and what their records say."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple, TypeAlias

import click

from capsule_sym._commands import present
from capsule_sym._commands.verify import verify as prove
from capsule_sym._files import read_json
from capsule_sym._symbolic.proofs.items import Result
from paper.proofs.case import ALPHA

MUTATIONS = Path("results/mutations.json")
ENCLOSED = Path("results/enclose.json")
REGIONS = Path("results/regions.json")
ATTRACTION = Path("results/attraction.json")
FASTEST = Path("results/fastest.json")
WEAKENINGS = Path("results/weakenings.json")
TAMPERING = Path("results/tampering.json")
HORSESHOE = Path("results/horseshoe-proved.json")
_NARROW = 1e-30  # radius of a bifurcation's alpha
_LEFT = 1e-11  # length of alpha that may stay open
_OPEN = 1e-9  # the same, of the motions from rest
_AROUND = 1e-3  # share of the plane that neighbourhoods of single points may have


Read: TypeAlias = Callable[[Any], tuple[str, bool]]
"""Text of a record, and True if it is the goal."""


class Row(NamedTuple):
    """A line of the table: what, what is reached and whether that is the goal, the goal, whence.

    `met` is None where there is no record.
    """

    what: str
    reached: str
    met: bool | None
    goal: str
    source: str


def _mutations(record: Any) -> tuple[str, bool]:
    survive, total = int(record["survive"]), int(record["changes"])
    return f"{survive} of {total}", survive == 0 and total >= 150


def _thresholds(record: Any) -> tuple[str, bool]:
    found = [one for section in record["sections"] for one in section["thresholds"]]
    worst = max((float(one["radius"]) for one in found), default=1.0)
    return f"{len(found)} of 16, within {worst:.0e}", len(found) == 16 and worst < _NARROW


def _coefficients(record: Any) -> tuple[str, bool]:
    found = [one for section in record["sections"] for one in section["thresholds"]]
    known = sum(bool(one["coefficient"]) for one in found)
    return f"{known} of {len(found)}", 0 < known == len(found)


def _intervals(record: Any) -> tuple[str, bool]:
    left = [float(section["unproved"]) for section in record["sections"]]
    whole = len(left) == 2 and not any(section["failed"] for section in record["sections"])
    told = " and ".join(f"all but {x:.0e}" for x in left)
    return told or "none", whole and max(left) < _LEFT


def _orbit(record: Any) -> tuple[str, bool]:
    seconds = float(record["orbit_seconds"])
    return f"{seconds:.2f} s", seconds < 0.2


def _share(least: float, hours: float = math.inf) -> Read:
    """Reader of a proof by parts, which should reach a share within so many hours."""

    def read(record: Any) -> tuple[str, bool]:
        share, took = float(record["share"]), float(record["work"]) / 3600
        return f"{share:.2%} in {took:.2f} h of one core", share > least and took <= hours

    return read


def _weakenings(record: Any) -> tuple[str, bool]:
    survive, total = int(record["survive"]), int(record["weakenings"])
    return f"{survive} of {total}", survive == 0 and total >= 97


def _tampering(record: Any) -> tuple[str, bool]:
    accepted, kinds, trials = (int(record[one]) for one in ("accepted", "kinds", "trials"))
    return f"{accepted} of {trials}, {kinds} kinds", accepted == 0 and kinds >= 100


def _horseshoe(record: Any) -> tuple[str, bool]:
    entropy = float(record["entropy"])
    return f"entropy at least {entropy:.4f}", entropy > 0


_PLANE = _share(1 - _AROUND, hours=4)
_FROM_REST = _share(1 - _OPEN / (ALPHA[1] - ALPHA[0]))
_ROWS: tuple[tuple[str, str, Path, Read, str], ...] = (
    ("changes of what is printed that survive", "0 of 150", MUTATIONS, _mutations, "mutations"),
    ("bifurcations proved, with type", "16 of 16, to 1e-30", ENCLOSED, _thresholds, "verify"),
    ("their coefficients enclosed", "all", ENCLOSED, _coefficients, "verify"),
    ("alpha in [0.001, 2] proved", "all but 1e-11", ENCLOSED, _intervals, "verify"),
    ("the (alpha, gamma) plane proved", "99.9%, 2 h of two cores", REGIONS, _PLANE, "regions"),
    ("one orbit certified", "0.2 s", ENCLOSED, _orbit, "verify"),
    ("motions from rest, over alpha", "all but 1e-9", ATTRACTION, _FROM_REST, "attraction"),
    ("box of drives, none faster", "a share", FASTEST, _share(0.0), "fastest"),
    ("weakened terms of proofs that survive", "0 of 97", WEAKENINGS, _weakenings, "weakenings"),
    ("tampered certificates accepted", "0, 100 kinds", TAMPERING, _tampering, "tampering"),
    ("horseshoe, checked", "one", HORSESHOE, _horseshoe, "horseshoe"),
)


def _whole(seconds: float) -> Row:
    """The time of `make verify`: that of `enclose`, by its record, and that of `verify`."""
    what, goal = "all that `make verify` proves", "300 s on two cores"
    try:
        before = float(read_json(ENCLOSED, "JSON")["seconds"])
    except (ValueError, KeyError, TypeError):
        return Row(what, f"{seconds:.0f} s without `enclose`", None, goal, "make verify")
    told = f"{before + seconds:.0f} s, {before:.0f} of them `enclose`"
    return Row(what, told, before + seconds < 300, goal, f"{ENCLOSED}, verify")


def rows(results: Sequence[Result], seconds: float) -> tuple[Row, ...]:
    """The table, from the records under results/ and a whole run of `verify`."""
    unproved = sum(not result.settled for result in results)
    told = f"{len(results) - unproved} of {len(results)}, {seconds:.0f} s"
    found = [Row("statements settled", told, not unproved, "all", "verify"), _whole(seconds)]
    for what, goal, path, read, target in _ROWS:
        try:
            reached, met = read(read_json(path, "JSON"))
        except (ValueError, KeyError, TypeError):
            told = "unreadable record" if path.exists() else "not run here"
            where = str(path) if path.exists() else f"make {target}"
            found.append(Row(what, told, None, goal, where))
        else:
            found.append(Row(what, reached, met, goal, str(path)))
    return tuple(found)


@click.command()
@click.pass_context
def verify(context: click.Context) -> None:
    """Prove the theory as `capsule-sym verify` does, and show what is reached of the goals.

    The records of the other proofs are those under results/.
    """
    start = perf_counter()
    results = context.invoke(prove)
    marks = {True: "yes", False: "no", None: "–"}
    told = (
        (row.what, row.reached, marks[row.met], row.goal, row.source)
        for row in rows(results, perf_counter() - start)
    )
    console = present.make_console(stderr=True)
    present.table(("", "reached", "", "goal", "from"), told, console=console)
