"""All extrema inside a segment: against theory, dense samples and 50 digits."""

import math
from dataclasses import replace
from random import Random
from typing import Any

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from capsule_sym import Parameters, results
from capsule_sym._map.backend import Backend, MpmathBackend, NumpyBackend, backend
from capsule_sym._map.expansion import Guard
from capsule_sym._native import core
from capsule_sym._orbits.shooting import extrema as module
from capsule_sym._orbits.shooting.equations import SegmentFlow, shooting
from capsule_sym._orbits.shooting.extrema import Extremum, extrema, minima
from capsule_sym._parameters import CAPSULE
from capsule_sym.generated.interface import Quantity
from tests.sampling import flows, many, sampled


@pytest.fixture
def by_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reference search, also where the C core would find the extrema."""
    monkeypatch.setattr(module, "_by_core", lambda *_: None)


@pytest.fixture(params=["core", pytest.param("search", marks=pytest.mark.long)])
def either(request: pytest.FixtureRequest) -> None:
    """By the C core, and by the reference search."""
    if request.param == "search":
        request.getfixturevalue("by_search")


WORDS = {1: "14", 2: "21", 3: "36", 4: "41", 5: "54", 6: "63"}
Values = tuple[float, ...]  # alpha, omega, delta, zeta, beta, gamma, f_b
# The last has digits to spare for differences.
SYSTEMS: dict[str, Backend] = {
    "numpy": NumpyBackend(),
    "mpmath": MpmathBackend(),
    "more": MpmathBackend(130),
}


def segment(
    values: Values, field: int, start: list[Any], h: float, name: str = "numpy"
) -> SegmentFlow:
    """A segment of duration h from x_r, v_r, v_c and forcing angle, the first of an itinerary."""
    numbers = SYSTEMS[name]
    z = np.array([numbers.number(value) for value in (*start, h, 1.0)])
    exact = [numbers.number(value) for value in values]
    return shooting(numbers, exact, results.Itinerary.parse(WORDS[field]), z).flows[0]


def random_segment_flow(seed: int, name: str = "numpy", smaller: int = 0) -> SegmentFlow:
    """A segment, or the same one with all lengths, speeds and forces smaller by 2^smaller."""
    random, number = Random(seed), SYSTEMS[name].number
    scale = number(2) ** -smaller
    field = random.randint(1, 6)
    values = Parameters(
        alpha=random.uniform(0, 3),
        omega=random.uniform(0.2, 4),
        delta=random.uniform(0, 1),
        zeta=random.choice([0.0, 0.05, 0.5, 2.0]),
        beta=random.uniform(0, 30),
        gamma=random.uniform(0.3, 8),
    )
    start = [random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), 0.7]
    duration = random.uniform(0.05, 12)
    alpha, omega, delta, zeta, beta, gamma, f_b = map(number, values.to_dict().values())
    given = (alpha * scale, omega, delta * scale, zeta, beta, gamma, f_b * scale)
    moving = [number(value) * scale for value in start[:3]]
    return segment(given, field, [*moving, start[3]], duration, name)


def found(flow: SegmentFlow, quantity: Quantity, name: str = "numpy") -> list[Extremum]:
    return list(extrema(SYSTEMS[name], flow, quantity, {}))


def value(flow: SegmentFlow, quantity: Quantity, h: Any, name: str = "numpy") -> Any:
    """A quantity a duration after the start, or at many equal steps up to it, by its definition."""
    c, start, kernels = flow.c, flow.closed, SYSTEMS[name].kernels
    if isinstance(h, np.ndarray):
        position, v_r, *drifted = flows(kernels, c, start, h[-1], len(h))[:, 1:]
    else:
        position, v_r, *drifted = kernels.flow(c, start, SYSTEMS[name].number(h))
    gap = start.gap + position
    if quantity is Quantity.GAP:
        return gap
    if quantity is Quantity.SPEED:
        return start.v_c + drifted[0]
    return start.x_r + position + c.kappa * gap + 2 * c.zeta * v_r


def quantities(flow: SegmentFlow) -> list[Quantity]:
    return [quantity for quantity in Quantity if flow.c.drift or quantity is not Quantity.SPEED]


def shown(times: NDArray[np.float64], values: NDArray[np.float64], kind: int) -> list[int]:
    """Sample times at which an extremum appears."""
    rises = np.sign(np.diff(values))
    turned = (rises[1:] == kind) & (rises[:-1] != kind)
    return (np.flatnonzero(turned) + 1).tolist()  # type: ignore[no-any-return]


def agree(
    every: list[tuple[Any, Any]], kind: int, times: NDArray[np.float64], values: NDArray[np.float64]
) -> int:
    """Assert that extrema (time, value) are those that samples show; return how many there are."""
    seen = shown(times, values, kind)
    # Beside an end the samples may show one or not.
    inner = [
        (time, least)
        for time, least in every
        if times[1] < time < times[-2] or np.any(abs(times[seen] - time) < times[0])
    ]
    assert [time for time, _ in inner] == pytest.approx(times[seen], abs=times[0])
    for (_, least), shown_least in zip(inner, values[seen], strict=True):
        assert -1e-13 <= kind * (shown_least - least) < 1e-4
    return len(inner)


@sampled
@pytest.mark.usefixtures("either")
@pytest.mark.parametrize("quantity", Quantity)
def test_every_extremum_of_dense_samples_is_found_and_no_other(quantity: Quantity) -> None:
    seen = 0
    for seed in range(many(40, 20)):
        flow = random_segment_flow(seed)
        if quantity is Quantity.SPEED and not flow.c.drift:
            continue
        times = np.linspace(0, flow.h, 24_001)[1:]
        values, every = value(flow, quantity, times), found(flow, quantity)
        for kind in (1, -1):
            same = [(turn.time, turn.value) for turn in every if turn.kind == kind]
            seen += agree(same, kind, times, values)
    assert seen > many(50, 25)


@sampled
@pytest.mark.usefixtures("either")
def test_guards_are_least_where_their_quantities_turn() -> None:
    seen = dict.fromkeys(Guard, 0)
    for seed in range(many(40, 20)):
        flow = random_segment_flow(seed)
        c, times = flow.c, np.linspace(0, flow.h, 24_001)[1:]
        gap, force = (value(flow, q, times) for q in (Quantity.GAP, Quantity.FORCE))
        guards: dict[Guard, NDArray[Any]] = {Guard.GAP: gap if c.contact else -gap}
        if c.drift:
            guards[Guard.DRIFT] = c.drift * value(flow, Quantity.SPEED, times)
        else:
            guards |= {Guard.UPPER: c.f_b - force, Guard.LOWER: c.f_b + force}
        with backend("numpy") as numbers:
            least = list(minima(numbers, flow, {}))
        assert {one.guard for one in least} <= guards.keys()
        for guard, values in guards.items():
            same = [(one.time, one.value) for one in least if one.guard is guard]
            seen[guard] += agree(same, 1, times, values)
    own = (Guard.GAP, Guard.DRIFT, Guard.UPPER, Guard.LOWER)
    assert min(seen[guard] for guard in own) > 10


@pytest.mark.usefixtures("either")
def test_extrema_of_free_oscillation_are_half_periods_apart() -> None:
    """x_r = 0.3 cos t without damping and drive: maxima and minima in turn."""
    values = (0.0, 1.0, 5.0, 0.0, 0.0, 1.0, 1.0)
    flow = segment(values, 2, [0.3 * math.cos(1), -0.3 * math.sin(1), 0.0, 0.0], 40.0)
    every = found(flow, Quantity.GAP)
    assert [turn.kind for turn in every] == [(-1) ** n for n in range(13)]
    expected = [math.pi * n - 1 for n in range(1, 14)]
    assert [turn.time for turn in every] == pytest.approx(expected, abs=1e-12)
    assert [abs(turn.value + 5.0) for turn in every] == pytest.approx([0.3] * 13, abs=1e-13)


@pytest.mark.usefixtures("either")
@pytest.mark.parametrize("smaller", [560, 830, 1000])
def test_a_smaller_motion_has_the_same_extrema(smaller: int) -> None:
    """By the scale of the system: squares of what is below 2^-537 vanish in doubles."""
    for seed in (1, 2, 4):
        ordinary, tiny = random_segment_flow(seed), random_segment_flow(seed, smaller=smaller)
        for quantity in quantities(ordinary):
            expected, every = found(ordinary, quantity), found(tiny, quantity)
            assert [turn.kind for turn in every] == [turn.kind for turn in expected]
            for one, other in zip(every, expected, strict=True):
                assert one.time == pytest.approx(other.time, abs=1e-12)
                assert one.value * 2.0**smaller == pytest.approx(other.value, abs=1e-12)


def test_fifty_digits_hold_what_no_double_does() -> None:
    exact, tiny = random_segment_flow(5, "mpmath"), random_segment_flow(5, "mpmath", 3000)
    every = found(tiny, Quantity.GAP, "mpmath")
    expected = found(exact, Quantity.GAP, "mpmath")
    assert len(every) == len(expected) > 1
    for one, other in zip(every, expected, strict=True):
        assert one.kind == other.kind
        assert abs(one.time - other.time) < mpf("1e-45")


@pytest.mark.usefixtures("either")
@pytest.mark.parametrize("start", [(1, 0), (0, -1), (-3, 2), (5, 7)])
def test_extrema_of_the_smallest_oscillations(start: tuple[int, int]) -> None:
    """x_r = a cos h + b sin h, so many of the smallest double: extrema where tan h = b/a."""
    a, b = start
    flow = segment(
        (0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0), 2, [a * 2.0**-1074, b * 2.0**-1074, 0, 0], 9
    )
    first = math.atan2(b, a) % math.pi
    times = [first + n * math.pi for n in range(4) if 0 < first + n * math.pi < 9]
    for quantity in (Quantity.GAP, Quantity.FORCE):
        every = found(flow, quantity)
        assert [turn.time for turn in every] == pytest.approx(times, abs=1e-12)
        kinds = [-np.sign(a * math.cos(time) + b * math.sin(time)) for time in times]
        assert [turn.kind for turn in every] == kinds


@pytest.mark.usefixtures("either")
@pytest.mark.parametrize("duration", [math.nan, math.inf])
def test_a_duration_that_is_none_is_refused(duration: float) -> None:
    flow = replace(random_segment_flow(5), h=duration)
    with pytest.raises(ValueError, match=f"duration {duration}"):
        found(flow, Quantity.GAP)


@pytest.mark.usefixtures("by_search")
def test_a_remainder_too_small_misplaces_an_extremum(monkeypatch: pytest.MonkeyPatch) -> None:
    # The velocity -sin(t + pi - 2.999) vanishes just where an expansion about 0 ends.
    values, begin = (0.0, 1.0, 5.0, 0.0, 0.0, 1.0, 2.0), math.pi - 2.999
    flow = segment(values, 2, [math.cos(begin), -math.sin(begin), 0.0, 0.0], 4.0)
    assert [turn.time for turn in found(flow, Quantity.GAP)] == pytest.approx([2.999], abs=1e-14)
    small = [math.cos(begin) * 2.0**-560, -math.sin(begin) * 2.0**-560, 0.0, 0.0]
    every = found(segment((0.0, 1.0, 0.0, *values[3:]), 2, small, 4.0), Quantity.GAP)
    assert [turn.time for turn in every] == pytest.approx([2.999], abs=1e-14)
    honest = module.expand

    def careless(*arguments: Any) -> Any:
        expansions = honest(*arguments).items()
        return {g: replace(e, rest=0.0, growth=0.0) for g, e in expansions}

    monkeypatch.setattr(module, "expand", careless)
    assert [turn.time for turn in found(flow, Quantity.GAP)] != pytest.approx([2.999], abs=1e-3)


@pytest.mark.usefixtures("either")
def test_a_pair_of_extrema_that_sampling_would_miss() -> None:
    # x_r = V sin h + (cos h - cos 3 h)/8: its velocity has a maximum near h = 2.7, and V is such
    # that this is 1e-9 above zero, so that x_r has a minimum and a maximum 5e-5 apart.
    def top(V: float) -> float:
        highest = minimize_scalar(
            lambda h: math.sin(h) / 8 - V * math.cos(h) - 3 * math.sin(3 * h) / 8,
            bounds=(2.2, 3.1),
            method="bounded",
            options={"xatol": 1e-12},
        )
        assert 2.3 < highest.x < 3.0
        return -float(highest.fun)

    for above, kinds in ((1e-9, [1, -1]), (-1e-9, [])):
        V = float(brentq(lambda V, above=above: top(V) - above, 0.2, 0.5, xtol=1e-15))
        flow = segment((1.0, 3.0, 5.0, 0.0, 0.0, 1.0, 100.0), 2, [0.0, V, 0.0, 0.0], 3.1)
        for quantity in (Quantity.GAP, Quantity.FORCE):
            every = [turn for turn in found(flow, quantity) if turn.time > 2]
            assert [turn.kind for turn in every] == kinds, V


@pytest.mark.long
@pytest.mark.parametrize(("name", "error"), [("numpy", 1e-5), ("mpmath", 1e-18)])
def test_flat_extrema_are_found_as_far_as_rounding_lets_them(name: str, error: float) -> None:
    """x_r = (9 cos h - cos 3 h)/8 has the velocity -3/2 sin^3 h."""
    flow = segment((1.0, 3.0, 5.0, 0.0, 0.0, 1.0, 100.0), 2, [1.0, 0.0, 0.0, 0.0], 8.0, name)
    for quantity in (Quantity.GAP, Quantity.FORCE):
        every = found(flow, quantity, name)
        assert [turn.kind for turn in every] == [1, -1]
        for n, turn in enumerate(every, 1):
            with mp.workdps(60):
                assert abs(turn.time - n * mp.pi) < error


@pytest.mark.usefixtures("either")
def test_zero_of_the_rate_at_the_start_is_no_extremum() -> None:
    """At the start of a slip v_c and v_c' vanish: it is not an interior extremum of the segment."""
    values, x_r = tuple(Parameters(alpha=1.3).to_dict().values()), 0.35
    for missed in (0.0, 1e-13, -1e-13):  # by the solution of an orbit's equations
        v_r = (1.0 + missed - x_r - 1.5 * (x_r - 0.02)) / 0.1
        flow = segment(values, 4, [x_r, v_r, 0.0, 0.2], 2.0)
        with backend("numpy") as numbers:
            every = list(extrema(numbers, flow, Quantity.SPEED, {Guard.DRIFT: 2}))
        assert [turn.kind for turn in every] == [-1]
        assert every[0].time > 1e-3


# 94: undamped, so that gap and force turn together
@pytest.mark.parametrize(
    "seed", [pytest.param(2, marks=pytest.mark.long), 5, pytest.param(94, marks=pytest.mark.long)]
)
def test_extrema_in_fifty_digits_are_roots_of_the_derivative(seed: int) -> None:
    flow, exact, more = (random_segment_flow(seed, name) for name in SYSTEMS)
    seen = 0
    for quantity in quantities(flow):
        coarse, fine = found(flow, quantity), found(exact, quantity, "mpmath")
        assert [turn.kind for turn in coarse] == [turn.kind for turn in fine]
        for one, two in zip(coarse, fine, strict=True):
            assert abs(one.time - two.time) < 1e-12
            assert abs(one.value - two.value) < 1e-13
            with mp.workdps(60):
                root = mpmath.findroot(
                    lambda t, quantity=quantity: mpmath.diff(
                        lambda h: value(more, quantity, h, "more"), t
                    ),
                    (mpf(one.time) - mpf("1e-9"), two.time),  # begins with a secant this short
                )
                assert abs(two.time - root) < mpf("1e-45")
                assert abs(two.value - value(exact, quantity, root, "mpmath")) < mpf("1e-50")
            seen += 1
    assert seen > 3


def counting(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Every expansion that the search makes from here on."""
    made: list[Any] = []
    for place, name in ((module, "expand"), (module.quasistatic, "expand_forced")):
        honest = getattr(place, name)

        def counted(*arguments: Any, honest: Any = honest) -> Any:
            made.append(arguments)
            return honest(*arguments)

        monkeypatch.setattr(place, name, counted)
    return made


@pytest.mark.usefixtures("by_search")
@pytest.mark.parametrize(("name", "error"), [("numpy", 100.0), ("mpmath", 1e-30)])
@pytest.mark.parametrize("zeta", [0.05, 1.0])
def test_slow_forcing_is_passed_in_few_steps(zeta, name, error, monkeypatch) -> None:
    """At omega = 1e-7 the rate is at rounding's mercy for 1e5 of the segment's own times."""
    made, omega = counting(monkeypatch), 1e-7
    values = (0.1, omega, 0.5, zeta, 0.0, 1.0, 100.0)
    flow = segment(values, 2, [0.1, 0.0, 0.0, 0.0], 2.5 * math.pi / omega, name)
    with mp.workdps(60):
        # x_r goes as cos(omega h - late), P = x_r + 2 zeta v_r as cos(omega h - late + early).
        exact = mpf(omega)
        late = mp.atan2(2 * mpf(zeta) * exact, 1 - exact**2)
        early = mp.atan(2 * mpf(zeta) * exact)
        for quantity, behind in ((Quantity.GAP, late), (Quantity.FORCE, late - early)):
            every = [turn for turn in found(flow, quantity, name) if turn.time * omega > 1]
            assert [turn.kind for turn in every] == [1, -1]
            for n, turn in enumerate(every, 1):
                assert abs(turn.time - (n * mp.pi + behind) / exact) < error
    assert len(made) < 3000


@pytest.mark.long
@pytest.mark.skipif(core is None, reason="the C core was not compiled")
@pytest.mark.parametrize(("zeta", "count"), [(0.05, 71), (1.0, 3)])
def test_the_core_finds_extrema_of_slow_forcing_itself(zeta: float, count: int) -> None:
    """A rounding of x_r = 0.1 moves an extremum by 1e-17/(alpha omega^2) = 1e-8 at the most."""
    values, omega = (0.1, 1e-4, 0.5, zeta, 0.0, 1.0, 100.0), 1e-4
    coarse, fine = (
        segment(values, 2, [0.1, 0.013, 0.0, 0.0], 2.5 * math.pi / omega, name)
        for name in ("numpy", "mpmath")
    )
    every, exact = (
        module._by_core(CAPSULE, coarse, Quantity.GAP, 0),
        found(fine, Quantity.GAP, "mpmath"),
    )
    assert every is not None
    assert [turn.kind for turn in every] == [turn.kind for turn in exact]
    assert len(exact) == count
    for one, other in zip(every, exact, strict=True):
        assert abs(one.time - other.time) < 1e-8
        assert abs(one.value - other.value) < 1e-15


@pytest.mark.usefixtures("either")
def test_hidden_extrema_of_slow_forcing_are_not_made_up() -> None:
    """Drifting, overdamped, from far off: one dies away, and then the forcing's own are left."""
    omega = 1e-5
    flow = segment(
        (0.1, omega, 0.5, 5.0, 1.5, 1.0, 0.3), 4, [0.7, 0.0, 1.0, 0.0], 2.5 * math.pi / omega
    )
    late = [turn for turn in found(flow, Quantity.FORCE) if turn.time * omega > 0.1]
    assert [turn.kind for turn in late] == [1, -1]
    for n, turn in enumerate(late, 1):
        assert turn.time * omega == pytest.approx(n * math.pi, rel=1e-3)
