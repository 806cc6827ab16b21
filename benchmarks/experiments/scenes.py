"""Runs and hard starts of scenes beside the judge: `python -m benchmarks scenes-check SCENE ...`.

The judge is `integrator.c`, based on the equations of motion alone, in 113 bits. Checks that are
interrupted resume where they were, unless the code has changed.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path
from random import Random
from typing import NamedTuple

from benchmarks.experiments.scene_cases import cases
from benchmarks.experiments.scene_starts import HardStart, hard_start
from tests.scenes import (
    HERE,
    UNIT,
    Integrator,
    Run,
    Start,
    grouped,
    integrator,
    random_start,
    random_starts,
    typical_starts,
)
from tests.scenes.library import Found, Library, library

CONTRACT = 8.0
"""Largest error of a switching time, in units of u (t* + M/|g'(t*)|)."""

CLOSED, SETTLED = 1, 2000
"""Status of an orbit that is found, and periods after which a run has come to its motion."""

STATES = 2.0
"""Largest error of a final state, in units of the run's rounding errors."""

WAYS = {"as needed": 0, "double": 1, "106 bits": 2}
LANES = (4, 8)
CHUNK = {"runs": 100, "cases": 1, "motions": 100, "hard": 2000}
RUNS_TOLD = 1e-7  # likewise for all of a run
TOLD = 1e-12  # from this distance on, one rounding of a state does not change what follows


@dataclass
class Tally:
    """Counts over some starts; `wrong` has what disagrees with the judge."""

    starts: int = 0
    switches: int = 0
    worst: float = 0.0
    kinds: dict[str, int] = field(default_factory=dict)
    open: dict[str, int] = field(default_factory=dict)
    far_open: dict[str, int] = field(default_factory=dict)
    undecided: int = 0
    wrong: list[dict[str, object]] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Add the counts of another tally."""
        self.starts += other.starts
        self.switches += other.switches
        self.undecided += other.undecided
        self.worst = max(self.worst, other.worst)
        for name in ("kinds", "open", "far_open"):
            setattr(self, name, dict(Counter(getattr(self, name)) + Counter(getattr(other, name))))
        self.wrong += other.wrong

    def blame(self, start: Start, way: str, kind: str, problem: str) -> None:
        """Add a disagreement."""
        self.wrong.append({"problem": problem, "way": way, "kind": kind, **start._asdict()})


def random_runs(judge: Integrator, library: Library, count: int, seed: int = 30) -> Tally:
    """Random runs of some periods: itineraries, and final states within conditioning.

    Ten after the other have the same linear flows, so that they go side by side.
    """
    starts, tally = grouped(random_starts(library.form, count, seed), 10), Tally(starts=count)
    expected = judge.runs(library.form, starts)
    for way in ("as needed", "106 bits"):
        found = library.runs(starts, precision=WAYS[way])
        for start, run, true in zip(starts, found, expected, strict=True):
            tally.switches += len(run.segments) if way == "as needed" else 0
            _compare_run(tally, start, way, run, true)
    for lanes in LANES:
        for start, run, true in zip(starts, library.many(starts, lanes), expected, strict=True):
            _compare_run(tally, start, f"{lanes} lanes", run, true)
        for start, run, true in zip(starts, library.switches(starts, lanes), expected, strict=True):
            _compare_run(tally, start, f"{lanes} lanes by switches", run, true)
    return tally


def _compare_run(tally: Tally, start: Start, way: str, run: Found, true: Run) -> None:
    if true.status not in {"done", "most"}:
        tally.undecided += 1
    elif run.stop != {"done": "done", "most": "full"}[true.status]:
        tally.blame(start, way, "run", f"stopped: {run.stop}, after {run.fields}")
    elif run.segments and run.fields != (fields := _fields(way, true)):
        tally.blame(start, way, "run", f"{_parted(run.fields, fields)}")
    else:
        off = true.off(run.state)
        tally.worst = max(tally.worst, off)
        if not off <= STATES:
            tally.blame(start, way, "run", f"state off by {off:.3g} units: {run.state}")


def _fields(way: str, true: Run) -> tuple[int, ...]:
    """Fields passed; by switches only those that a switch ends."""
    if "switches" not in way:
        return true.fields
    return tuple(segment.field for segment in true.segments if segment.event != "E")


def _parted(found: Sequence[int], true: Sequence[int]) -> str:
    n = next((i for i, (a, b) in enumerate(zip(found, true, strict=False)) if a != b), -1)
    n = min(len(found), len(true)) if n < 0 else n
    near = slice(max(0, n - 2), n + 2)
    return f"fields part at segment {n}: {found[near]}, not {true[near]}"


def adversarial(judge: Integrator, library: Library, count: int, seed: str) -> Tally:
    """First switches of random hard starts."""
    random = Random(seed)
    return first_switches(judge, library, [hard_start(library.form, random) for _ in range(count)])


def random_motions(judge: Integrator, library: Library, count: int, seed: int) -> Tally:
    """Random periodic motions: an orbit is found, near the run's end, and the judge closes it."""
    random, tally = Random(f"motions {seed}"), Tally()
    while tally.starts < count:
        starts = list[Start]()
        while len(starts) < count - tally.starts:
            start = random_start(library.form, random)
            if start.parameters["zeta"] > 0:
                starts.append(start._replace(state=(0.0, 0.0, 0.0), phase=0.0))
        found = zip(starts, library.motions(starts, SETTLED), strict=True)
        periodic = [(start, motion) for start, motion in found if motion.number]
        tally.starts += len(periodic)
        for start, motion in periodic:
            apart = max(abs(a - b) for a, b in zip(motion.orbit, motion.end, strict=True))
            if motion.status != CLOSED or apart > 1e-6 * (1 + max(map(abs, motion.end))):
                problem = f"status {motion.status}, {apart:.1g} apart, {motion.number} periods"
                tally.blame(start, "orbit", "motion", problem)
                continue
            x_r, v_r, v_c = motion.orbit
            again = start._replace(state=(x_r, v_r, v_c))
            (run,) = judge.runs(library.form, [again], motion.number, checked=False)
            back = max(abs(float(a) - b) for a, b in zip(run.state, motion.orbit, strict=False))
            tally.worst = max(tally.worst, back)
            if run.status != "done" or back > 1e-9 * (1 + max(map(abs, motion.end))):
                tally.blame(again, "orbit", "motion", f"{run.status}, closed to {back:.1g}")
    return tally


def hard_cases(judge: Integrator, library: Library) -> Tally:
    """First switches of the cases by name, and runs of those that no rounding decides."""
    named = list(cases(library.form))
    tally = first_switches(judge, library, named)
    far = [one for one in named if one.distance > RUNS_TOLD]
    starts = [one.start for one in far]
    for start, run, true in zip(
        starts, library.runs(starts, 2, 500), judge.runs(library.form, starts, 2, 500), strict=True
    ):
        _compare_run(tally, start, "as needed", run, true)
    return tally


def first_switches(judge: Integrator, library: Library, hard: Sequence[HardStart]) -> Tally:
    """First switches at every width: field, event, what follows, and time."""
    starts = [one.start for one in hard]
    expected = judge.runs(library.form, starts, periods=2, most=1, checked=False)
    tally = Tally(starts=len(hard), kinds=dict(Counter(one.kind for one in hard)))
    tally.undecided = sum(true.status not in {"done", "most"} for true in expected)
    ways = {way: library.runs(starts, 2, 2, precision) for way, precision in WAYS.items()}
    ways |= {f"{lanes} lanes": library.in_lanes(starts, lanes) for lanes in LANES}
    for way, found in ways.items():
        for one, run, true in zip(hard, found, expected, strict=True):
            tally.switches += 1
            if run.stop == "open" and not run.segments:
                tally.open[way] = tally.open.get(way, 0) + 1
                if one.distance > 1e-13 and true.status in {"done", "most"}:
                    tally.far_open[way] = tally.far_open.get(way, 0) + 1
            for problem in _problems(library, tally, way, one, run, true):
                tally.blame(one.start, way, one.kind, f"{problem} (distance {one.distance:.1g})")
    return tally


def _problems(
    library: Library, tally: Tally, way: str, one: HardStart, run: Found, true: Run
) -> Iterator[str]:
    if run.stop == "refused":
        yield "refused"
    if run.stop == "refused" or not true.segments:
        return
    (expected,) = true.segments
    if not run.segments:
        if run.stop == "done" and expected.event != "E" and "lanes" in way:
            yield f"no switch, not {expected.event} from F{expected.field}"
        return
    first = run.segments[0]
    if first.field != expected.field:
        yield f"F{first.field}, not F{expected.field}"
        return
    plane, told = library.plane(true), one.distance > TOLD or way == "106 bits"
    fields = 3 * (1 + library.form.stops) * (1 + library.form.pulsed)
    follows = expected.event == "V" and first.plane <= fields  # a landing's plane is what follows
    if plane is not None and first.plane != plane and (told or not follows):
        yield f"F{first.field} ends on {first.plane}, not {plane} ({expected.event})"
        return
    if expected.event == "E":
        return
    off = abs(first.duration - float(expected.duration)) / UNIT
    slow = expected.size / abs(expected.rate) if expected.rate else 0.0
    timed = expected.event in {"R", "D"}
    period = 2 * math.pi / one.start.parameters["omega"]
    allowed = float(expected.duration) + (period if timed else slow)
    if "lanes" in way:  # these have a difference of angles, each of two doubles
        allowed += UNIT * period
    error = off / allowed if allowed else 0.0
    tally.worst = max(tally.worst, error)
    if error > CONTRACT:
        yield f"duration off by {error:.3g} units: {first.duration}"
    field = run.segments[1].field if len(run.segments) > 1 else true.following
    if true.status == "most" and told and field != true.following:
        yield f"F{field} follows {expected.event}, not F{true.following}"


def _log(path: Path, key: str) -> dict[str, Tally]:
    """Tallies that are known for this state of the code, by chunk."""
    known = {}
    for line in path.read_text().splitlines() if path.exists() else ():
        record = json.loads(line)
        if record.pop("key") == key:
            chunk = record.pop("chunk")
            known[chunk] = Tally(**record)
    return known


def _code(*files: Path) -> str:
    own = (Path(__file__).with_name(name) for name in ("scene_cases.py", "scene_starts.py"))
    names = ("__init__.py", "pieces.h", "integrator.c")
    every = (*files, Path(__file__), *own, *(HERE / name for name in names))
    return sha256(b"".join(file.read_bytes() for file in every)).hexdigest()[:16]


class Checked(NamedTuple):
    """A scene's tallies by kind, and microseconds a switch alone and side by side."""

    tallies: dict[str, Tally]
    times: tuple[float, float]


def checked(scene: str, folder: Path, runs: int, motions: int, hard: int) -> Checked:
    """All checks of a scene in such numbers; what the folder's log has is not run."""
    place = folder / scene
    place.mkdir(parents=True, exist_ok=True)
    scenes, judge = library(scene, place, "-O3"), integrator(place)
    log, key = place / "log.jsonl", _code(scenes.program)
    known, found = _log(log, key), {}
    for kind, count in (("runs", runs), ("cases", 1), ("motions", motions), ("hard", hard)):
        found[kind] = Tally()
        size = min(CHUNK[kind], count)
        for number in range(-(-count // size)) if count else ():
            chunk = f"{kind} {number} of {size}"
            if chunk not in known:
                if kind == "runs":
                    known[chunk] = random_runs(judge, scenes, size, number)
                elif kind == "cases":
                    known[chunk] = hard_cases(judge, scenes)
                elif kind == "motions":
                    known[chunk] = random_motions(judge, scenes, size, number)
                else:
                    known[chunk] = adversarial(judge, scenes, size, f"{scene} {number}")
                with log.open("a") as file:
                    file.write(
                        json.dumps({"key": key, "chunk": chunk, **asdict(known[chunk])}) + "\n"
                    )
            found[kind].add(known[chunk])
    starts = typical_starts(scenes.form, 512)
    times = [scenes.times(starts, 100) for _ in range(5)]
    return Checked(found, (min(one for one, _ in times), min(many for _, many in times)))


def check(scenes: Sequence[str], runs: int, motions: int, hard: int, out: Path) -> bool:
    """Check scenes, and print a table; False if a scene and the judge disagree."""
    found = {name: checked(name, out, runs, motions, hard) for name in scenes}
    for name, one in found.items():
        for tally in one.tallies.values():
            for problem in tally.wrong:
                print(f"{name}: {problem}")
    first = next(iter(found.values())).times
    row = "{:16} {:>10} {:>5} {:>9} {:>9} {:>12} {:>5} {:>12} {:>12}"
    print(row.format("wrong of", "runs", "off", "cases", "motions", "hard", "off", "us", "us many"))
    for name, one in found.items():
        wrong = [f"{len(tally.wrong)} of {tally.starts}" for tally in one.tallies.values()]
        off = (f"{one.tallies[kind].worst:.2f}" for kind in ("runs", "hard"))
        times = (f"{a:.2f} ({a / b:.2f})" for a, b in zip(one.times, first, strict=True))
        print(row.format(name, wrong[0], next(off), *wrong[1:], next(off), *times))
    print(
        f"\noff: largest error of a final state, of {STATES:g} units of rounding errors, and "
        f"of a switching time, of {CONTRACT:g} u (t* + M/|g'(t*)|).\n"
        "us: microseconds a switch, one by one and side by side, and over those of the first row."
    )
    for name, one in found.items():
        tally = one.tallies["hard"]
        print(f"{name}: cases by name {one.tallies['cases'].kinds}")
        print(f"{name}: undecided {tally.open}, by the judge {tally.undecided}; {tally.kinds}")
    return not any(tally.wrong for one in found.values() for tally in one.tallies.values())
