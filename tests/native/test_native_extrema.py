"""Extrema inside a segment in C: each bound on remainder or rounding that is left out shows."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from mpmath import mp, mpf

from capsule_sym import Parameters
from capsule_sym._map.backend import NumpyBackend
from capsule_sym._native import core
from tests.native import KERNELS, LIBRARY

pytestmark = [
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
    pytest.mark.skipif(core is None, reason="the C core was not compiled"),
]

GAP, FORCE, SPEED = range(3)
# Remainders are small: they are looked at where expansions reach sixteen times as far, each in the
# segments of one seed. That of the slope is not shown: no extremum that it hides has been found.
LONGER = 16.0
REMAINDERS = {
    "factor * inverse": 4,
    "forcing * inverse": 6,
    "fabs(x[last + 1]) + slack * size[last + 1]": 4,
    "sqrt(c->K) * low": 1541,
    "force_per_energy(c, sqrt(c->K))": 30,
}
# The units of the coefficients' own roundings stand behind these.
ROUNDINGS = (
    "units * v_terms",
    "(8.0 * (n + 3) + 8.0) * UNIT + late",
    "FAINT * e.error[skipped]",
)
LEFT_OUT = (*REMAINDERS, *ROUNDINGS)


class Extremum(ctypes.Structure):
    """A capsule_extremum."""

    _fields_ = (("kind", ctypes.c_int), ("time", ctypes.c_double), ("value", ctypes.c_double))


class Segment(NamedTuple):
    """A segment and a quantity, with the kinds of its extrema after a time."""

    parameters: Parameters
    field: int
    start: tuple[float, ...]
    quantity: int
    zeros: int
    duration: float
    after: float
    kinds: tuple[int, ...]


class Library:
    """`capsule_find_extrema`, from which one term may be left out, expansions longer or not."""

    def __init__(self, directory: Path) -> None:
        text = (LIBRARY / "extrema.c").read_text()
        for number, old in enumerate(LEFT_OUT):
            assert text.count(old) == 1, old
            text = text.replace(old, f"(weak & {1 << number} ? 0.0 : {old})")
        text = text.replace("#define REACH_OF_RATE 3.0", "#define REACH_OF_RATE (3.0 * longer)")
        (directory / "extrema.c").write_text("int weak;\ndouble longer = 1.0;\n" + text)
        command = ["cc", "-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-shared", "-w"]
        command += [f"-I{LIBRARY}", f"-I{KERNELS}", "extrema.c", str(KERNELS / "capsule_kernels.c")]
        subprocess.run([*command, "-lm", "-o", "extrema"], cwd=directory, check=True)
        self.library = ctypes.CDLL(str(directory / "extrema"))
        self.constants = (ctypes.c_double * 32)()

    def judged(
        self, segments: list[Segment], without: str | None = None, longer: float = 1.0
    ) -> tuple[int, int]:
        """How many segments have extrema of other kinds than they should have, and stay open."""
        weak = 0 if without is None else 1 << LEFT_OUT.index(without)
        ctypes.c_int.in_dll(self.library, "weak").value = weak
        ctypes.c_double.in_dll(self.library, "longer").value = longer
        found = [self.extrema(one) for one in segments]
        wrong = sum(
            kinds not in (None, one.kinds) for kinds, one in zip(found, segments, strict=True)
        )
        return wrong, found.count(None)

    def extrema(self, one: Segment) -> tuple[int, ...] | None:
        """The kinds of the extrema after a time; None where they stay open."""
        values = map(ctypes.c_double, one.parameters.to_dict().values())
        self.library.capsule_constants_of(one.field, *values, self.constants)
        found = (Extremum * 64)()
        count = self.library.capsule_find_extrema(
            self.constants,
            (ctypes.c_double * 7)(*one.start),
            one.quantity,
            one.zeros,
            ctypes.c_double(one.duration),
            found,
            64,
        )
        if count < 0:
            return None
        return tuple(extremum.kind for extremum in found[:count] if extremum.time > one.after)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    return Library(tmp_path_factory.mktemp("extrema"))


@pytest.fixture(scope="module")
def sampled() -> list[Segment]:
    """Random segments, whose extrema dense samples of the rate show."""
    return [one for seed in range(150) for one in random_segments(seed)]


def random_segments(seed: int) -> list[Segment]:
    """A segment with each of its quantities."""
    rng = np.random.default_rng(seed)
    field, angle, duration = int(rng.integers(1, 7)), rng.uniform(0, 6), rng.uniform(1, 12)
    parameters = Parameters(
        alpha=rng.uniform(0, 3),
        omega=rng.uniform(0.2, 4),
        delta=rng.uniform(0, 1),
        zeta=rng.choice([0.0, 0.05, 0.5]),
        beta=rng.uniform(0, 30),
        gamma=rng.uniform(0.3, 8),
    )
    numbers = NumpyBackend()
    c = numbers.constants(field, parameters)
    x_r, v_r, v_c = rng.uniform(-1, 1, 3)
    margin = x_r + c.kappa * (x_r - c.delta) + 2 * c.zeta * v_r - c.friction
    start = (x_r, x_r - c.delta, v_r, v_c, margin, np.cos(angle), np.sin(angle))
    times = np.linspace(0, duration, 20_001)
    position, speed, *_ = numbers.kernels.flow(c, numbers.kernels.Start(*start), times)
    speed[0], position[0] = v_r, 0.0
    force = margin + (1 + c.kappa) * position + 2 * c.zeta * (speed - v_r)
    rates = {GAP: speed, FORCE: np.diff(force)}
    if c.drift:
        rates[SPEED] = force
    result = []
    for quantity, rate in rates.items():
        signs = np.sign(rate)
        kinds = tuple(int(b) for a, b in pairwise(signs) if a != b)
        # What is within a sample or two of an end is not seen of the force.
        if len(set(signs[:4])) == len(set(signs[-4:])) == 1:
            result.append(Segment(parameters, field, start, quantity, 0, duration, 0.0, kinds))
    return result


@pytest.fixture(scope="module")
def close() -> list[Segment]:
    """Segments whose rate comes as near to 0 as rounding lets it, above or below.

    x_r = V sin h + (cos h - cos 3 h)/8: where its rate is largest, near h = 2.6, it is 0 for one V.
    """
    with mp.workdps(40):

        def top(V: mpf) -> mpf:
            h = mp.findroot(lambda h: -mp.cos(h) / 8 - V * mp.sin(h) + 9 * mp.cos(3 * h) / 8, 2.7)
            return -mp.sin(h) / 8 + V * mp.cos(h) + 3 * mp.sin(3 * h) / 8

        middle = float(mp.findroot(top, (0.36, 0.365)))
        steps = [*range(40), *(2**k for k in range(6, 30, 2))]
        speeds = middle + np.array([-step for step in steps] + steps) * np.spacing(middle)
        kinds = [(1, -1) if top(mpf(float(V))) > 0 else () for V in speeds]
    parameters = Parameters(alpha=1.0, omega=3.0, delta=5.0, zeta=0.0, gamma=1.0, f_b=100.0)
    return [
        Segment(parameters, 2, (0.0, -5.0, V, 0.0, 0.0, 1.0, 0.0), quantity, 0, 3.1, 2.0, kind)
        for V, kind in zip(speeds.tolist(), kinds, strict=True)
        for quantity in (GAP, FORCE)
    ]


@pytest.mark.parametrize("longer", [1.0, LONGER])
def test_extrema_are_those_of_dense_samples(
    longer: float, library: Library, sampled: list[Segment]
) -> None:
    assert len(sampled) > 300
    assert library.judged(sampled, longer=longer) == (0, 0)


@pytest.mark.parametrize("term", REMAINDERS)
def test_without_its_remainder_an_extremum_is_missed(term: str, library: Library) -> None:
    segments = random_segments(REMAINDERS[term])
    assert library.judged(segments, longer=LONGER)[0] == 0
    assert library.judged(segments, term, longer=LONGER)[0] > 0


def test_what_rounding_hides_stays_open(library: Library, close: list[Segment]) -> None:
    wrong, left_open = library.judged(close)
    assert wrong == 0
    assert 0 < left_open < len(close)


@pytest.mark.parametrize("term", ROUNDINGS)
def test_without_its_roundings_less_stays_open(
    term: str, library: Library, close: list[Segment]
) -> None:
    assert library.judged(close, term)[1] < library.judged(close)[1]


def test_a_rate_that_vanishes_at_the_start_is_divided_out(library: Library) -> None:
    """Where a slip begins v_c' is 0; it is so again where the force is back at its bound."""
    p = Parameters(alpha=1.3)
    x_r = 0.35
    v_r = (p.f_b - x_r - p.beta * (x_r - p.delta)) / (2 * p.zeta)
    start = (x_r, x_r - p.delta, v_r, 0.0, 0.0, np.cos(0.2), np.sin(0.2))
    one = Segment(p, 4, start, SPEED, 1, 2.0, 0.0, (-1,))
    assert library.extrema(one) == (-1,)
    assert library.extrema(one._replace(zeros=0)) is None


def test_the_remainder_of_a_tiny_motion_is_bounded(library: Library) -> None:
    """Below 1e-154 squares are 0; a motion and its forces may be scaled."""
    by = 2.0**-600
    tiny = [
        one._replace(
            parameters=replace(
                one.parameters,
                alpha=one.parameters.alpha * by,
                delta=one.parameters.delta * by,
                f_b=one.parameters.f_b * by,
            ),
            start=(*(value * by for value in one.start[:5]), *one.start[5:]),
        )
        for one in random_segments(REMAINDERS["fabs(x[last + 1]) + slack * size[last + 1]"])
    ]
    assert library.judged(tiny, longer=LONGER) == (0, 0)


def test_what_underflow_hides_stays_open() -> None:
    """As `close`, but with roundings of 0: minimum at 2.59374245, maximum at 2.59374625."""
    at = core.Map(np.array((8.487983164e-314, 3, 0, 0, 0, 1, 100)))
    assert at.extrema(2, (0, 0, 3.0714703855e-314, 0, 0, 1, 0), 0, 0, 3.1) is None


@pytest.mark.parametrize(("duration", "found"), [(np.nan, None), (0.0, []), (-1.0, [])])
def test_a_segment_without_duration_has_no_extrema(
    duration: float, found: list[object] | None
) -> None:
    at = core.Map(np.array((1.0, 3, 5, 0, 0, 1, 100)))
    assert at.extrema(2, (0, -5, 0.3, 0, 0, 1, 0), 0, 0, duration) == found
