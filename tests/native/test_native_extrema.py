"""Extrema inside a segment in C: each bound on remainder or rounding that is left out shows."""

import ctypes
import math
import shutil
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from mpmath import mp, mpc, mpf

from capsule_sym import Parameters
from capsule_sym._map.backend import Backend, NumpyBackend, backend
from capsule_sym._native import core
from tests.native import KERNELS, LIBRARY, compile_in, structure
from tests.sampling import flows

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
    pytest.mark.skipif(core is None, reason="the C core was not compiled"),
]

GAP, FORCE, SPEED = range(3)
# Remainders are small: they are looked at where expansions reach sixteen times as far, each in the
# segments of one seed. That of the slope is looked at by itself.
LONGER = 16.0
REMAINDERS = {
    "factor * inverse": 4,
    "forcing * inverse": 313,
    "fabs(x[last + 1]) + slack * size[last + 1]": 133,
    "sqrt(c->K) * low": 194,
    "force_per_energy(c, sqrt(c->K))": 30,
}
# The units of the coefficients' own roundings follow these.
ROUNDINGS = (
    "units * v_terms",
    "(8.0 * (n + 3) + 8.0) * UNIT + late",
    "FAINT * e.error[skipped]",
    "MARGIN_AT_UNITS * UNIT",
    "force_change_size(c, x_error, v_error)",
)
# Error of an expansion of the gap, after long or at other starts: each with a parameter set
# (alpha, omega, delta, zeta, beta, gamma), a field, x_r, v_r and angle at the start, a time, and
# how much more x_r and the angle are in truth, which the start has rounded.
ROUNDED = 0.9 * 2.0**-53
FORMS = {
    "2.0 * UNIT * TWO_PI * f->amplitude": (
        (1e3, 1e-3, 0.01, 0.0, 0.0, 1.0), 2, 0.0, 0.0, 1.57, 0.01, 0.0, 4 * math.pi * ROUNDED),
    "c->fast * h / (1.0 + c->sigma * h)": (
        (0.018, 0.0445, 1.36, 0.0, 30.0, 0.228), 4, 0.414, 0.0, 1.356, 236.0, 0.0, 0.0),
    "1.0 + phase + c->omega * h": (
        (0.016459300830176406, 14.16734247601147, 0.06168456082858189, 0.3, 0.0, 4.373605873733001),
        5, 0.0, 0.0, 4.139744222235191, 1776.9512679002873, 0.0, 0.0),
    "FORM_UNITS * UNIT": (
        (0.0, 0.3, 0.41675401693265324, 0.0, 30.0, 0.14654664891821365),
        4, 0.0, 0.6118379496432829, 3.53, 34.25310185651047, 0.0, 0.0),
    "2.0 * UNIT * (TWO_PI + turned)": (
        (0.0096, 23.0, 0.106, 0.01, 0.0, 0.99), 5, -0.2, 0.67, 3.22, 2338.6, 0.0, 0.0),
    "UNIT * gap": ((0.0, 1.0, 1.0, 0.0, 0.0, 1.0), 2, 0.0, 0.0, 0.0, 1.0, ROUNDED, 0.0),
}  # fmt: skip
INSTEAD = {"1.0 + phase + c->omega * h": "1.0 + phase"}
LEFT_OUT = (*REMAINDERS, *ROUNDINGS, *FORMS)


# Internals that the tests read.
PROBE = """
int probe_shown(const expansion *e, int zeros)
{
    return shown(e, 1.0, zeros, 1.0);
}
int probe_below(const expansion *e, double size)
{
    const capsule_peak peak = {size};
    return below(e, &peak, 1.0);
}
void probe_expand(const capsule_constants *c, const capsule_start *start, int quantity, double h,
                  expansion *e)
{
    const course f = course_of(c, start, quantity, 1.0);
    *e = expand(&f, h);
}
"""
ORDER = 8


DOUBLE = ctypes.c_double
_OTHERS = dict.fromkeys(("rest", "growth", "x_r", "gap", "v_r"), DOUBLE)
_COEFFICIENTS = dict.fromkeys(("rate", "error"), DOUBLE * ORDER)
Expanded = structure("expansion", value=DOUBLE, **_COEFFICIENTS, **_OTHERS)
Extremum = structure("capsule_extremum", kind=ctypes.c_int, time=DOUBLE, value=DOUBLE)


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
            text = text.replace(old, f"(weak & {1 << number} ? {INSTEAD.get(old, '0.0')} : {old})")
        text = text.replace("#define REACH_OF_RATE 3.0", "#define REACH_OF_RATE (3.0 * longer)")
        (directory / "extrema.c").write_text("int weak;\ndouble longer = 1.0;\n" + text + PROBE)
        sources = "extrema.c", KERNELS / "capsule_kernels.c"
        compile_in(directory, "-shared", *sources, "-lm", "-o", "extrema")
        self.library = ctypes.CDLL(str(directory / "extrema"))
        self.constants = (ctypes.c_double * 32)()

    def judged(
        self, segments: list[Segment], without: str | None = None, longer: float = 1.0
    ) -> tuple[int, int]:
        """Number of segments with extrema of wrong kinds, and of undecided ones."""
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
        found = self.found(one, 64)
        if found is None:
            return None
        return tuple(extremum.kind for extremum in found if extremum.time > one.after)

    def found(self, one: Segment, room: int) -> list[Any] | None:
        """The extrema; None where they stay open. Nothing beyond the room is written to."""
        found = (Extremum * (room + 1))()
        found[room].kind = 99
        count = self.library.capsule_find_extrema(
            self.of(one),
            (ctypes.c_double * 7)(*one.start),
            one.quantity,
            one.zeros,
            ctypes.c_double(one.duration),
            found,
            room,
        )
        assert found[room].kind == 99
        return None if count < 0 else found[:count]

    def of(self, one: Segment) -> ctypes.Array[ctypes.c_double]:
        """The constants of a segment's field."""
        given = one.parameters.to_dict().values()
        values = (ctypes.c_double * len(given))(*given)
        self.library.capsule_constants_of(one.field, values, self.constants)
        return self.constants


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
    alpha, omega, delta = rng.uniform(0, 3), rng.uniform(0.2, 4), rng.uniform(0, 1)
    zeta, beta, gamma = rng.choice([0.0, 0.05, 0.5]), rng.uniform(0, 30), rng.uniform(0.3, 8)
    parameters = Parameters(alpha, omega, delta, zeta, beta, gamma)
    numbers = NumpyBackend()
    c = numbers.constants(field, parameters)
    x_r, v_r, v_c = rng.uniform(-1, 1, 3)
    margin = x_r + c.kappa * (x_r - c.delta) + 2 * c.zeta * v_r - c.friction
    start = (x_r, x_r - c.delta, v_r, v_c, margin, np.cos(angle), np.sin(angle))
    given = numbers.kernels.Start(*start)
    position, speed, _ = flows(numbers.kernels, c, given, duration, 20_000)
    force = margin + (1 + c.kappa) * position + 2 * c.zeta * (speed - v_r)
    rates = {GAP: speed, FORCE: np.diff(force)}
    if c.drift:
        rates[SPEED] = force
    result = []
    for quantity, rate in rates.items():
        signs = np.sign(rate)
        kinds = tuple(int(b) for a, b in pairwise(signs) if a != b)
        # Extrema of the force within a sample or two of an end are not seen.
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
    ] + close_of_speed()


def close_of_speed() -> list[Segment]:
    """The same of v_c, whose rate is x_r - 1, where x_r'' = 1 - 2 x_r.

    From 1/4 at the speed V it rises to 1/2 + sqrt(1/16 + V^2/2): to the friction, 1, for one V.
    """
    parameters = Parameters(alpha=0.0, omega=1.0, delta=5.0, zeta=0.0, gamma=1.0, f_b=1.0)
    middle = math.sqrt(0.375)
    steps = [*range(40), *(2**k for k in range(6, 30, 2))]
    speeds = middle + np.array([-step for step in steps] + steps) * np.spacing(middle)
    result = []
    for V in speeds.tolist():
        kind = (1, -1) if Fraction(V) ** 2 > Fraction(3, 8) else ()
        start = (0.25, -4.75, V, 1.0, -0.75, 1.0, 0.0)
        result.append(Segment(parameters, 1, start, SPEED, 0, 3.1, 0.0, kind))
    return result


@pytest.mark.parametrize("longer", [1.0, LONGER])
def test_extrema_are_those_of_dense_samples(longer, library, sampled) -> None:
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
def test_without_its_roundings_less_stays_open(term, library, close) -> None:
    assert library.judged(close, term)[1] < library.judged(close)[1]


@pytest.mark.parametrize(
    ("zeros", "part", "index", "falls", "not_shown"),
    [
        (0, "rest", 0, 0.37, 0.38),  # 8 R < 3
        (0, "growth", 0, 0.37, 0.38),
        (1, "rest", 0, 0.33, 0.34),  # 9 R < 3
        (1, "growth", 0, 0.33, 0.34),
        (0, "error", 7, 0.42, 0.43),  # 7 E < 3
        (1, "error", 7, 0.49, 0.51),  # 6 E < 3
    ],
)
def test_a_rate_falls_in_spite_of_all_that_its_slope_may_miss(
    zeros, part, index, falls, not_shown, library
) -> None:
    """The rate t^zeros (1 - 3 t) over 1."""
    for size, shown in ((falls, -1), (not_shown, 0)):
        e = Expanded()
        e.rate[zeros], e.rate[zeros + 1] = 1.0, -3.0
        if part == "error":
            e.error[index] = size
        else:
            setattr(e, part, size)
        assert library.library.probe_shown(ctypes.byref(e), zeros) == shown


@pytest.mark.parametrize(("part", "most"), [("rest", 4.5), ("growth", 4.5), ("rate", 0.5)])
def test_a_size_stays_below_another_in_spite_of_all_that_its_polynomial_leaves_out(
    part, most, library
) -> None:
    """A quantity of 1/2 over 1, whose rate is t^8 at the most, t^9, or exactly 1."""
    for size in (most * 0.99, most * 1.01):
        e = Expanded()
        e.value = 0.5
        if part == "rate":
            e.rate[0] = size
        else:
            setattr(e, part, size)
        found = library.library.probe_below(ctypes.byref(e), ctypes.c_double(1.0))
        assert found == (size < most)


@pytest.fixture
def swinging() -> Segment:
    """x_r = sin h, for long."""
    parameters = Parameters(alpha=0.0, omega=1.0, delta=5.0, zeta=0.0, gamma=1.0, f_b=100.0)
    start = (0.0, -5.0, 1.0, 0.0, -100.0, 1.0, 0.0)
    return Segment(parameters, 2, start, GAP, 0, 6.0, 0.0, (-1, 1))


def test_extrema_stay_open_that_there_is_no_room_for(library: Library, swinging: Segment) -> None:
    found = library.found(swinging, 2)
    assert found is not None
    assert [one.kind for one in found] == [-1, 1]
    assert [one.time for one in found] == pytest.approx([math.pi / 2, 1.5 * math.pi], rel=1e-15)
    assert library.found(swinging, 1) is None
    assert library.found(swinging, 0) is None


def test_what_takes_many_stretches_stays_open(library: Library, swinging: Segment) -> None:
    """A stretch has one extremum at the most, and 2^16 stretches are the most."""
    found = library.found(swinging._replace(duration=1800.0), 1 << 18)
    assert found is not None
    assert len(found) == 573  # pi/2 + 572 pi < 1800
    assert library.found(swinging._replace(duration=math.pi * 2**17), 1 << 18) is None


@pytest.mark.parametrize("seed", range(5))
def test_times_and_values_are_those_of_50_digits(seed: int, library: Library) -> None:
    with backend("mpmath") as numbers, mp.workdps(50):
        for one in random_segments(seed):
            found = library.found(one, 64)
            assert found is not None
            quantity = exact_quantity(numbers, one)
            for extremum in found:
                time = turn(quantity, mpf(extremum.time))
                assert abs(extremum.time - time) < 1e-12
                assert abs(extremum.value - quantity(time)) < 1e-13


def exact_quantity(numbers: Backend, one: Segment) -> Callable[[mpf], mpf]:
    """The quantity after h, by its definition."""
    c = numbers.constants(one.field, one.parameters)
    start = numbers.kernels.Start(*map(numbers.number, one.start))

    def quantity(h: mpf) -> mpf:
        position, v_r, *drifted = numbers.kernels.flow(c, start, h)
        if one.quantity == SPEED:
            return start.v_c + drifted[0]
        gap = start.gap + position
        if one.quantity == GAP:
            return gap
        return start.x_r + position + c.kappa * gap + 2 * c.zeta * v_r

    return quantity


def turn(quantity: Callable[[mpf], mpf], near: mpf) -> mpf:
    """Times at which the quantity is the same a little before and after."""
    step, around = mpf("1e-15"), (near, near + mpf("1e-10"))

    def rate(h: mpf) -> mpf:
        return (quantity(h + step) - quantity(h - step)) / step

    return mp.findroot(rate, around, maxsteps=3, verify=False)


@pytest.mark.parametrize("term", FORMS)
def test_an_expansion_is_off_by_less_than_its_bounds_and_by_more_than_without_one(
    term, library
) -> None:
    assert off_by(term, library) <= 1
    assert off_by(term, library, without=term) > 1


def off_by(case: str, library: Library, without: str | None = None) -> float:
    """The largest error of the gap's rate and its derivatives, in their bounds."""
    values, field, x_r, v_r, angle, h, more_x, more_angle = FORMS[case]
    parameters = Parameters(*values, 1.0)
    start = (x_r, x_r - parameters.delta, v_r, 0.0, 0.0, math.cos(angle), math.sin(angle))
    one = Segment(parameters, field, start, GAP, 0, h, 0.0, ())
    weak = 0 if without is None else 1 << LEFT_OUT.index(without)
    ctypes.c_int.in_dll(library.library, "weak").value = weak
    e = Expanded()
    library.library.probe_expand(
        library.of(one), (ctypes.c_double * 7)(*start), GAP, ctypes.c_double(h), ctypes.byref(e)
    )
    ctypes.c_int.in_dll(library.library, "weak").value = 0
    with backend("mpmath") as numbers, mp.workdps(50):
        c = numbers.constants(field, parameters)
        x, gap, v, v_c, margin, cosine, sine = map(mpf, start)
        turned, x, gap = mpf(more_angle), x + more_x, gap + more_x
        cosine, sine = (
            cosine * mp.cos(turned) - sine * mp.sin(turned),
            sine * mp.cos(turned) + cosine * mp.sin(turned),
        )
        at = numbers.kernels.Start(x, gap, v, v_c, margin, cosine, sine)
        change, v, *_ = numbers.kernels.flow(c, at, mpf(h))
        # The forcing is alpha cos: this and its derivatives, of a complex exponential.
        way = mpc(0, c.omega)
        wave = c.alpha * mpc(cosine, sine) * mp.exp(way * h)
        force = x + change + c.kappa * (gap + change) + 2 * c.zeta * v
        rates = [v, -c.m * force + c.push + wave.real]
        for n in range(1, ORDER - 1):
            rates.append(-c.K * rates[n - 1] - 2 * c.sigma * rates[n] + (wave * way**n).real)
        return max(
            float(abs(e.rate[n] - rate / mp.factorial(n)) / e.error[n])
            for n, rate in enumerate(rates)
        )
