"""Bifurcations of scenes beside the judge: `python -m benchmarks curves SCENE ...`.

Random branches and curves are found by the package. Of each bifurcation the judge, `integrator.c`,
solves for the orbits beside it: fixed points of its own map, by Newton's method on differences of
its own runs. Compared are the itinerary on both sides, multipliers, the parameter by the normal
form, and the term by which the maps of both sides differ.
"""

from __future__ import annotations

import math
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import numpy as np

from capsule_sym import (
    InvalidInput,
    continue_bifurcation,
    continue_orbit,
    performance,
    scenes,
    solve_orbit,
)
from capsule_sym._orbits.interface import middle
from capsule_sym.results import Bifurcation, Curve, CurvePoint
from tests.scenes import SCENES, Form, Integrator, Run, Start, integrator, random_start

SMALL = 1e-12  # of differences for a Jacobian
BESIDE = 1e-7  # of a parameter, to either side of a bifurcation
NEAR = 1e-3  # in multipliers, of their limit from beside the bifurcation
CLOSED = 1e-9  # before the last step of Newton's method
EIGENVALUE = {"fold": 1, "symmetry breaking": 1, "period doubling": -1}
SMOOTH, GROWTH, SLOPE = 2e-2, 1e-2, 1e-4


class Undecided(Exception):
    """The judge does not decide."""


class Section(NamedTuple):
    """The judge's map over some periods from a share of one on, and its end if not there again."""

    judge: Integrator
    form: Form
    share: float
    periods: float

    def runs(self, points: Sequence[tuple[dict[str, float], Any]]) -> list[Run]:
        """Runs at parameters from states; raises Undecided where one does not come to its end."""
        starts = [
            Start(p, (float(x[0]), float(x[1]), float(x[2])), self.share * math.tau / p["omega"])
            for p, x in points
        ]
        found = self.judge.runs(self.form, starts, self.share + self.periods, checked=False)
        if any(run.status != "done" for run in found):
            raise Undecided("a run does not come to its end")
        return found

    def jacobian(self, p: dict[str, float], x: Any) -> tuple[Run, Any]:
        """The run from a state, and the derivative of its end by the components that vary."""
        units = SMALL * np.eye(3)[: 3 if x[2] else 2]
        pairs = [(x + unit, x - unit) for unit in units]
        run, *moved = self.runs([(p, x), *((p, one) for pair in pairs for one in pair)])
        columns = [
            [float(a - b) for a, b in zip(one.state[:3], two.state, strict=False)]
            for one, two in zip(moved[::2], moved[1::2], strict=True)
        ]
        widths = [float((one - two)[k]) for k, (one, two) in enumerate(pairs)]
        return run, np.array(columns).T / widths

    def orbit(self, p: dict[str, float], x: Any) -> tuple[Any, Run, Any]:
        """The fixed point near a state, its run, and the multipliers that are not 0 by rest."""
        closed = False
        for _ in range(12):
            run, by = self.jacobian(p, x)
            off = np.array([float(a - Fraction(b)) for a, b in zip(run.state[:3], x, strict=False)])
            n = len(by.T)
            if closed:
                return x, run, np.linalg.eigvals(by[:n])
            closed = bool(abs(off).max() < CLOSED * (1 + abs(x).max()))
            x = np.array(x)
            x[:n] -= np.linalg.solve(by[:n] - np.eye(n), off[:n])
        raise Undecided("no orbit")


def cycle(fields: Sequence[int]) -> tuple[int, ...]:
    """The fields of a cycle, from the least rotation on."""
    fields = tuple(fields)
    return min(fields[k:] + fields[:k] for k in range(len(fields)))


def polynomial(multipliers: Sequence[complex]) -> Any:
    """The characteristic polynomial of multipliers; those that are not given are 0."""
    return np.poly([*multipliers, 0, 0][:3]).real


def passed(run: Run) -> tuple[int, ...]:
    """The cycle of fields of an orbit that begins and ends within one segment."""
    if len(run.fields) > 1 and run.fields[0] != run.fields[-1]:
        raise Undecided("the run does not end where it begins")
    return cycle(run.fields[:-1] or run.fields)


def halves_alike(fields: Sequence[int], periods: int) -> bool:
    """True if a cycle of fields over so many periods is one twice over."""
    half = len(fields) // 2
    return periods % 2 == 0 and tuple(fields[:half]) == tuple(fields[half:])


def durations(run: Run) -> Any:
    """Durations of an orbit's segments, from that in which it begins."""
    found = [float(one.duration) for one in run.segments]
    return np.array([found[0] + found[-1], *found[1:-1]])


@dataclass
class Tally:
    """Counts by the check and the type of the bifurcation."""

    right: Counter[tuple[str, str]] = field(default_factory=Counter)
    open: Counter[tuple[str, str]] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    reasons: Counter[str] = field(default_factory=Counter)

    def judged(self, what: str, one: Any, kind: str, judge: Any) -> None:
        """Count the verdict of a judgement, which raises AssertionError where it is wrong."""
        try:
            judge()
            self.right[what, kind] += 1
        except Undecided as reason:
            self.open[what, kind] += 1
            self.reasons[f"{what}, {kind}: {reason}"] += 1
        except AssertionError as problem:
            p = one.orbit.parameters.to_dict()
            self.wrong.append(f"{what} of {kind}, segment {one.segment}: {problem} at {p}")


class Judged:
    """A bifurcation of a branch or a point of a curve, as the judge meets it."""

    def __init__(self, judge: Integrator, one: Bifurcation | CurvePoint, kind: str) -> None:
        self.one, self.orbit, self.kind, self.judge = one, one.orbit, kind, judge
        self.form = SCENES[self.orbit.scene.name]
        self.p = {k: float(v) for k, v in self.orbit.parameters.to_dict().items()}
        flows = self.orbit.system.flows
        self.first = max(range(len(flows)), key=lambda i: float(flows[i].h))
        state, angle = middle(self.orbit, flows[self.first])
        self.x, number = np.array(state), self.orbit.itinerary.period_number
        self.section = Section(judge, self.form, angle / math.tau, number)

    @property
    def bifurcation(self) -> Bifurcation:
        """The bifurcation of a branch; a point of a curve is none."""
        assert isinstance(self.one, Bifurcation)
        return self.one

    def smooth(self) -> None:
        """The orbit closes, and a multiplier is that of its type."""
        run, by = self.section.jacobian(self.p, self.x)
        off = max(abs(float(a) - b) for a, b in zip(run.state[:3], self.x, strict=True))
        n = len(by.T)
        found = np.linalg.eigvals(by[:n])
        assert off < 1e-9 * (1 + abs(by).max()), f"open by {off:.1g}"
        assert passed(run) == cycle(self.orbit.itinerary.fields), f"fields {run.fields}"
        if self.kind in EIGENVALUE:
            apart = min(abs(found - EIGENVALUE[self.kind]))
        else:
            apart = min(abs(abs(one) - 1) for one in found if one.imag)
        assert apart < 1e-6, f"multipliers {found}"

    def beside(self, name: str) -> list[tuple[tuple[int, ...], Any]]:
        """The judge's orbits a little below and above in a parameter: fields, and stability.

        That is the characteristic polynomial, its limit at the bifurcation: it changes by the
        distance, or, where the segment grows like its root, by the root.
        """
        found = []
        for sign in (-1, 1):
            ends = []
            for size in (BESIDE, BESIDE / 4, BESIDE / 16):
                p = self.p | {name: self.p[name] + sign * size * max(1.0, abs(self.p[name]))}
                _, run, multipliers = self.section.orbit(p, self.x)
                ends.append((passed(run), polynomial(multipliers)))
            if len({fields for fields, _ in ends}) > 1:
                raise Undecided("another border is near")
            far, near, nearest = (one for _, one in ends)
            found.append((ends[0][0], (far - 6 * near + 8 * nearest) / 3))
        return found

    def border(self, names: Sequence[str]) -> None:
        """On one side is the itinerary with the segment, on the other that without it."""
        one = self.one
        self.one_event()
        without = one.orbit_without
        if without is None:
            raise Undecided("there is nothing beyond")
        expected = [cycle(o.itinerary.fields) for o in (self.orbit, without)]
        both = one.multipliers, one.multipliers_without
        problems = []
        for name in names:
            try:
                found = self.beside(name)
            except (Undecided, np.linalg.LinAlgError) as reason:
                problems.append(f"{name}: {reason}")
                continue
            cycles = [fields for fields, _ in found]
            number = self.orbit.itinerary.period_number
            if any(halves_alike(one, number) for one in cycles):
                problems.append(f"{name}: an orbit of half the period is near")
                continue
            if cycles[0] == cycles[1]:
                problems.append(f"{name}: both {'with' if cycles[0] == expected[0] else 'without'}")
                if cycles[0] in expected:
                    continue
            order = 1 if cycles == expected else -1
            assert cycles == expected[::order], f"fields {cycles}, not {expected}"
            if isinstance(one, Bifurcation):
                upwards = one.interval[0] < one.value
                named = one.itinerary_before, one.itinerary_after
                told = [itinerary and cycle(itinerary.fields) for itinerary in named]
                told = told if upwards else told[::-1]
                assert all(t in (None, c) for t, c in zip(told, cycles, strict=True)), (
                    f"{told} is found, not {cycles}"
                )
            for (_, true), own in zip(found, both[::order], strict=True):
                apart = abs(polynomial(own) - true).max() / (1 + abs(true).max())
                assert apart < NEAR, f"multipliers {own}, not {np.roots(true)}"
            return
        raise Undecided("; ".join(problems))

    def one_event(self) -> None:
        """Raises Undecided where more than one switch is at a border, but for mirror images."""
        zero = [i for i, flow in enumerate(self.orbit.system.flows) if abs(flow.h) < 1e-9]
        n, fields = len(self.orbit.itinerary), self.orbit.itinerary.fields
        if halves_alike(fields, self.orbit.itinerary.period_number):
            raise Undecided("the orbit has half the period")
        if any(1e-9 < abs(flow.h) < 1e-3 for flow in self.orbit.system.flows):
            raise Undecided("another segment is short")
        pair = len(zero) == 2 and (zero[1] - zero[0]) % n in {1, n - 1}
        if len(zero) > 1 and not pair and getattr(self.one, "symmetry", "") != "kept":
            raise Undecided("two switches are at borders at once")

    def derivatives(self, name: str) -> None:
        """On each side velocity and durations change like the orbit of that side."""
        self.one_event()
        told = {}
        for orbit in (self.orbit, self.one.orbit_without):
            if orbit is None:
                raise Undecided("there is nothing beyond")
            k = orbit.scene.facts.PARAMETERS.index(name)
            own = [*orbit.by_parameter[4:, k], performance(orbit).velocity.gradient[name]]
            told[cycle(orbit.itinerary.fields)] = orbit, np.array(own, dtype=float)
        for sign in (1, -1):
            apart = []
            for step in (1e-6, 1e-7, 1e-8):
                fields, begin, slope = self._slope(name, sign * step * max(1.0, abs(self.p[name])))
                if fields not in told:
                    raise Undecided("another itinerary is near")
                orbit, rows = told[fields]
                # The judge's first segment, in which nothing is at a border, is one of both orbits.
                field = self.orbit.itinerary.fields[self.first]
                lasting = (
                    (abs(float(orbit.durations[i]) - begin), i)
                    for i in range(len(orbit.itinerary))
                    if orbit.itinerary.fields[i] == field
                )
                _, i = min(lasting)
                expected = np.array([*np.roll(rows[:-1], -i), rows[-1]])
                apart.append(abs(slope - expected).max() / (1 + abs(expected).max()))
            del told[fields]
            # Near a fold the steps are long still: the next would be as much better as the last.
            apart.append(apart[-1] ** 2 / apart[-2])
            assert min(apart) < SLOPE, f"by {name}: {expected}, not {slope}, {apart}"

    def _slope(self, name: str, step: float) -> tuple[tuple[int, ...], float, Any]:
        """On one side the cycle, the first segment's duration, and slopes at the bifurcation."""
        runs = []
        for k in (1, 2, 3):
            p = self.p | {name: self.p[name] + k * step}
            _, run, _ = self.section.orbit(p, self.x)
            period = 2 * math.pi / p["omega"] * self.section.periods
            runs.append([*durations(run), float(run.state[3]) / period])
        if len({len(one) for one in runs}) > 1:
            raise Undecided("another itinerary is near")
        one, two, three = (np.array(row) for row in runs)
        slope = (-5 * one + 8 * two - 3 * three) / (2 * step)
        return passed(run), float(one[0]), slope

    def growth(self) -> None:
        """The duration of the segment grows with the parameter as by the normal form."""
        one, form = self.bifurcation, self.bifurcation.normal_form
        self.one_event()
        if form is None or one.segment is None:
            raise Undecided("no normal form")
        place = (one.segment - self.first) % len(self.orbit.itinerary)
        found = list[float]()
        for size in (2e-3, 2e-4, 2e-5, 4e-6):
            if len(found) == 2 and abs(found[1] - found[0]) < GROWTH / 2:
                break
            found = []
            for duration in (size, size / 2):
                value = one.value + form.growth * duration**form.order
                _, run, _ = self.section.orbit(self.p | {one.parameter: value}, self.x)
                if passed(run) == cycle(self.orbit.itinerary.fields):
                    found.append(float(run.segments[place].duration) / duration)
        if halves_alike(passed(run), self.orbit.itinerary.period_number):
            raise Undecided("an orbit of half the period is near")
        assert len(found) == 2, f"fields {run.fields} where the segment is said to be"
        ratio = 2 * found[1] - found[0]
        assert abs(ratio - 1) < GROWTH, f"durations {found} of those by the normal form"

    def amplitude(self) -> None:
        """Beside a smooth bifurcation orbits are as far apart as by the normal form."""
        one, form = self.bifurcation, self.bifurcation.normal_form
        if form is None or form.coefficient is None:
            raise Undecided("no normal form")
        doubles = self.kind == "period doubling"
        n = len(self.orbit.itinerary) * (1 + doubles)
        section = self.section._replace(periods=self.section.periods * (1 + doubles))
        _, by = self.section.jacobian(self.p, self.x)
        values, vectors = np.linalg.eig(by[: len(by.T)])
        along = np.zeros(3)
        w = vectors[:, abs(values - EIGENVALUE[self.kind]).argmin()].real
        along[: len(w)] = w / abs(w).max()

        def apart(run: Run) -> Any:
            if passed(run) != cycle(self.orbit.itinerary.fields * (1 + doubles)):
                raise Undecided("another itinerary is near")
            if self.kind == "fold":
                return durations(run)
            first, second = np.split(durations(run), 2)
            return (first - second) / 2

        ends = [section.runs([(self.p, self.x + k * SMALL * along)])[0] for k in (1, -1)]
        if any(len(run.fields) != n + 1 for run in ends):
            raise Undecided("another itinerary is near")
        speed = float(np.linalg.norm(apart(ends[0]) - apart(ends[1]))) / (2 * SMALL)
        middle = (apart(ends[0]) + apart(ends[1])) / 2
        ratios = []
        for size in (4e-3, 2e-3):
            p = self.p | {one.parameter: one.value + form.growth * size**2}
            both = []
            for sign in (1, -1):
                _, run, multipliers = section.orbit(p, self.x + sign * size / speed * along)
                moved = float(np.linalg.norm(apart(run) - middle))
                if moved < size / 4:
                    raise Undecided("Newton's method leads to the orbit between")
                nearest = float(abs(multipliers - 1).min())
                grown = 2 * size if self.kind == "fold" else 4 * size**2
                both.append((moved / size, nearest / grown / abs(form.coefficient)))
            ratios.append(np.mean(both, axis=0))
        limit = (4 * ratios[1] - ratios[0]) / 3
        assert abs(limit - 1).max() < SMOOTH, f"amplitude and coefficient off: {ratios}"


def judge_bifurcation(tally: Tally, judge: Integrator, one: Bifurcation) -> None:
    """Judge a bifurcation of a branch, and its normal form."""
    met = Judged(judge, one, one.type)
    if one.segment is None:
        tally.judged("point", one, one.type, met.smooth)
        if one.type in EIGENVALUE:
            tally.judged("normal form", one, one.type, met.amplitude)
        return
    tally.judged("point", one, one.type, lambda: met.border((one.parameter,)))
    tally.judged("growth", one, one.type, met.growth)
    if one.type == "edge":
        for name in ("D", "omega"):
            tally.judged(f"slope by {name}", one, one.type, partial(met.derivatives, name))


def judge_curve(tally: Tally, judge: Integrator, curve: Curve) -> None:
    """Judge three points of a curve."""
    count = len(curve.points)
    for k in sorted({count // 6, count // 2, 5 * count // 6}):
        point = curve.points[k]
        met = Judged(judge, point, curve.type)
        judged = met.smooth if point.segment is None else partial(met.border, curve.parameters)
        tally.judged("curve point", point, curve.type, judged)


def parameters_of(name: str, random: Random) -> dict[str, float]:
    """Random parameters whose motions are neither too long nor too hard."""
    given = random_start(SCENES[name], random).parameters
    given["zeta"] = random.choice([0.02, 0.05, 0.2])
    for key in ("beta", "beta_1", "beta_2"):
        if key in given:
            given[key] = random.choice([1.5, random.uniform(1, 20), 100.0])
    if name == "prototype" and random.random() < 0.4:  # one whose motions have mirror images
        given |= {"delta_2": given["delta_1"], "beta_2": given["beta_1"], "s": 0.0, "D": 0.5}
        given |= {"alpha_low": -given["alpha"], "f_plus": 1.0, "f_minus": 1.0}
    return given


def random_branches(name: str, random: Random) -> Iterator[tuple[Any, str]]:
    """Branches of random motions in a random parameter, with another one to follow curves in."""
    scene, known = getattr(scenes, name), ("alpha", "omega", "zeta", "gamma", "D", "s", "alpha_low")
    while True:
        given = parameters_of(name, random)
        orbit = solve_orbit(scene.Parameters(**given), max_seconds=5)
        if not orbit.success or orbit.itinerary.period_number > 4:
            continue
        alike = given.get("alpha_low") == -given["alpha"] and given["D"] == 0.5
        names = ["omega", "zeta", "gamma"] if alike else [one for one in known if one in given]
        first, second = random.sample(names, 2)
        to = given[first] * random.choice([0.7, 1.4])
        if first in {"D", "s", "alpha_low"}:
            to = given[first] + random.choice([-0.1, 0.1])
        if not 0.02 < to < 0.98 and first == "D":
            continue
        yield continue_orbit(orbit, first, to, points=15, max_seconds=4), second


def checked(name: str, judge: Integrator, curves: int, seed: int) -> Tally:
    """Bifurcations and curves of random branches of a scene, checked."""
    random, tally = Random(f"{seed} {name}"), Tally()
    many, met = Counter[str](), Counter[str]()
    for branch, second in random_branches(name, random):
        for one in branch.bifurcations:
            if max(many[one.type] * 5, met[one.type] * 3) > curves:
                continue
            met[one.type] += 1
            if sum(many.values()) >= curves or not one.success:
                continue
            judge_bifurcation(tally, judge, one)
            p = one.orbit.parameters
            low, high = (sorted((0.9 * v, 1.1 * v)) for v in (one.value, p.to_dict()[second]))
            try:
                curve = continue_bifurcation(
                    one, second, (tuple(low), tuple(high)), points=6, max_seconds=5
                )
            except InvalidInput:
                continue
            if len(curve.points) > 2:
                many[one.type] += 1
                judge_curve(tally, judge, curve)
        if sum(many.values()) >= curves:
            return tally
    raise AssertionError("there is always another branch")


def check(names: Sequence[str], curves: int, seed: int) -> int:
    """Judge bifurcations of scenes, and print a table; how many are wrong."""
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        judge = integrator(Path(folder))
        for name in names:
            tally = checked(name, judge, curves, seed)
            wrong += len(tally.wrong)
            for key in sorted({*tally.right, *tally.open}):
                counts = f"{tally.right[key]} right, {tally.open[key]} not decided"
                print(f"{name:15} {key[0]:12} {key[1]:32} {counts}")
            for problem in tally.wrong:
                print(f"{name} WRONG: {problem}", flush=True)
            for reason, count in tally.reasons.most_common(8):
                print(f"{name} not decided, {count}: {reason}")
    return wrong
