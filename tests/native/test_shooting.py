"""Itineraries solved by the core, beside the shooting in 50 digits and known bifurcations."""

from random import Random
from typing import Any

import numpy as np
import pytest
from mpmath import mp

import capsule_sym as cs
from capsule_sym._map.backend import backend
from capsule_sym._map.expansion import Guard
from capsule_sym._native import Watch, core
from capsule_sym._orbits.shooting import closed
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import PARAMETERS, ShootingSystem, of_core, shooting
from capsule_sym._orbits.shooting.itinerary import contact, drift, mirror
from capsule_sym._orbits.shooting.newton import newton
from capsule_sym._orbits.shooting.stability import field
from capsule_sym.generated.interface import Solving
from tests.finals import parameter_rows

pytestmark = pytest.mark.skipif(core is None, reason="the C core was not compiled")

# Error that a segment adds to all later ones, in units of rounding; and what interpolation
# near a duration of 0 leaves of a guard's gradient, as the tests of the equations have it.
ROUNDINGS, INTERPOLATED = 64, 3e-7
DURATIONS = (0.0, 1e-12, -1e-9, 1e-5, -1e-3, 0.03)


def random_itinerary(draw: Random) -> cs.results.Itinerary:
    """A closed walk over the fields, each step by one guard; a third are of mirrored halves."""
    while True:
        mirrored = draw.random() < 1 / 3
        fields = [draw.randint(1, 3) if mirrored else draw.randint(1, 6)]
        for _ in range(draw.choice((1, 2, 3, 5, 9))):
            ways = [
                other for other in range(1, 4 if mirrored else 7) if _follows(fields[-1], other)
            ]
            fields.append(draw.choice(ways))
        if _follows(fields[-1], mirror(fields[0]) if mirrored else fields[0]):
            return cs.results.Itinerary.of(fields, draw.choice((1, 3)), mirrored)


def _follows(field: int, other: int) -> bool:
    return (contact(field) != contact(other)) != (drift(field) != drift(other))


def random_case(seed: int) -> tuple[tuple[float, ...], cs.results.Itinerary, np.ndarray]:
    """Parameters, an itinerary, and unknowns; some durations are 0, tiny, or below 0."""
    draw = Random(seed)
    itinerary = random_itinerary(draw)
    ranges = ((0.2, 2), (0.4, 2), (0, 0.5), (0.01, 0.5), (0, 5), (0.3, 5), (0.3, 1.5))
    values = cs.Parameters(*(draw.uniform(*ends) for ends in ranges))
    # If v_c vanishes twice at a start off the force's bound, it is a small difference over the
    # square of a short duration: there they are long.
    durations = [
        draw.choice(DURATIONS)
        if draw.random() < 0.3 and itinerary.zeros(i) < 2
        else draw.uniform(0.1, 1.5)
        for i in range(len(itinerary))
    ]
    start = [draw.uniform(-1, 1) for _ in range(3)]
    z = np.array([*start, draw.uniform(0, 6), *durations])
    return tuple(values.to_dict().values()), itinerary, z


def everything(system: ShootingSystem) -> list[Any]:
    return [
        system.residual,
        np.hstack([system.by_z, system.by_p]),
        np.array([system.advance]),
        system.advance_by,
    ]


def softness(itinerary: cs.results.Itinerary, exact: ShootingSystem) -> float:
    """Growth of a rounding of the states in saltation matrices: they divide by the rate of v_c.

    If the capsule comes to rest softly and moves again, that rate is a small difference.
    """
    rates = [
        float(field(flow.c, flow.end, mp.one)[2])  # v_c' has no forcing
        for k, flow in enumerate(exact.flows)
        if flow.segment.guard is Guard.DRIFT and drift(itinerary.neighbour(k + 1))
    ]
    return sum(1 / abs(rate) for rate in rates)


def compare(seed: int) -> None:
    """The core's system beside that in 50 digits, in units of what it is made of."""
    values, itinerary, z = random_case(seed)
    with backend("numpy") as numbers:
        found = shooting(numbers, values, itinerary, z)
    with backend("mpmath") as numbers:
        given, unknowns = ([numbers.number(v) for v in row] for row in (values, z))
        exact = shooting(numbers, given, itinerary, np.array(unknowns))
        matrix = cs.orbits.monodromy_matrix(
            cs.results.Orbit(tuple(given), itinerary, np.array(unknowns), exact, "mpmath")
        )
    assert found.monodromy is not None
    largest = 1 + max(float(abs(flow.end_by).max()) for flow in exact.flows)
    motion = 1 + max(float(abs(flow.end).max()) for flow in exact.flows)
    error = ROUNDINGS * len(itinerary) * 2.0**-53 * largest * motion
    least = min(abs(z[4:]))
    rows = INTERPOLATED * largest * motion if least < 1e-2 else 1e3 * error
    with mp.workdps(60):
        for mine, true, bound in zip(
            everything(found), everything(exact), (error, rows, error, 1e3 * error), strict=True
        ):
            assert np.max(abs(mine - true)) <= bound, (seed, itinerary, z)
        relative = error + 2.0**-53 * motion * softness(itinerary, exact)
        assert np.max(abs(found.monodromy - matrix)) <= relative * (1 + abs(matrix).max()), seed


@pytest.mark.parametrize("seed", [*range(40), pytest.param(None, marks=pytest.mark.long)])
def test_the_system_is_that_of_fifty_digits(seed: int | None) -> None:
    for one in range(40, 440) if seed is None else (seed,):
        compare(one)


def orbits(count: int) -> list[cs.results.Orbit]:
    draw, found = Random(3), []
    while len(found) < count:
        alpha, omega = draw.uniform(0.2, 3), draw.uniform(0.5, 2)
        delta = draw.choice((0.0, draw.uniform(0, 0.6)))
        others = (draw.uniform(*ends) for ends in ((0.01, 0.6), (0, 10), (0.4, 4)))
        parameters = cs.Parameters(alpha, omega, delta, *others)
        orbit = cs.solve_orbit(parameters, periods=128)
        if orbit.success:
            found.append(orbit)
    return found


def compare_searches(count: int) -> None:
    """Both searches from guesses off by a tenth: the same status, and the same solution."""
    solved = 0
    for seed, orbit in enumerate(orbits(count)):
        guess = orbit.z * (1 + 0.1 * np.random.default_rng(seed).normal(size=len(orbit.z)))
        with backend("numpy") as numbers, np.errstate(all="ignore"):
            forms = ClosedForms(numbers, orbit.values)
            z, arrays, solving, _, norm = forms.solved(orbit.itinerary, guess)  # type: ignore[misc]
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(closed, "core_of", lambda scene: None)
                closed._constants.cache_clear()
                other = newton(numbers, orbit.values, orbit.itinerary, guess)
                closed._constants.cache_clear()
        assert solving == other.solving
        if solving == Solving.SOLVED:
            solved += 1
            system = of_core(orbit.values, orbit.itinerary, z, arrays)
            assert max(abs(system.residual)) == norm < 1e-12
            loss = 2.0**-45 * np.linalg.cond(system.by_z)
            assert np.max(abs(z - other.z)) < loss * max(1.0, np.max(abs(z)))
    assert solved > count / 2


@pytest.mark.parametrize("count", [12, pytest.param(300, marks=pytest.mark.long)])
def test_the_search_is_that_of_the_reference(count: int) -> None:
    compare_searches(count)


def test_a_segment_held_at_no_duration_is_the_bifurcation() -> None:
    """From a tenth of a per cent beside each border collision of a branch back to it, by alpha."""
    branch = cs.continue_orbit(cs.solve_orbit(cs.Parameters(alpha=0.05)), "alpha", 1.9, points=40)
    held = [one for one in branch.bifurcations if one.segment is not None]
    assert len(held) > 5
    for one in held:
        orbit, place = one.orbit, 4 + one.segment
        itinerary = orbit.itinerary
        fields = np.array(itinerary.fields, np.int32)
        values = np.array(orbit.values, dtype=float)
        values[0] *= 1.001
        guess = 1.001 * np.array(orbit.z, dtype=float)
        guess[place] = 0.0
        z, _, status, steps, residual, found = core.fields(values).solve_itinerary(
            fields, itinerary.period_number, itinerary.mirrored, guess, np.eye(7)[0], place
        )
        assert (status, z[place]) == (Solving.SOLVED, 0.0)
        assert residual < 1e-13
        assert steps < 10
        assert found[0] == pytest.approx(one.value, rel=1e-12)
        assert found[1:] == tuple(values[1:])


def test_a_part_of_the_start_held_is_a_point_of_the_branch() -> None:
    one, other = (cs.solve_orbit(cs.Parameters(alpha=alpha)) for alpha in (0.6, 0.601))
    assert one.itinerary == other.itinerary
    fields = np.array(one.itinerary.fields, np.int32)
    for held in range(4):
        if one.z[held] == other.z[held]:
            continue
        guess = one.z.copy()
        guess[held] = other.z[held]
        z, _, status, _, _, values = core.fields(np.array(one.values)).solve_itinerary(
            fields, 1, False, guess, 0.3 * np.eye(len(PARAMETERS))[0], held
        )
        assert status == Solving.SOLVED
        assert values == pytest.approx(other.values, rel=1e-11)
        assert z == pytest.approx(other.z, abs=1e-11)


def test_parameters_stay_what_a_model_may_have() -> None:
    orbit = cs.solve_orbit(cs.Parameters(alpha=0.6))
    guess = orbit.z.copy()
    guess[0] = -1.0
    fields = np.array(orbit.itinerary.fields, np.int32)
    *_, status, _, _, values = core.fields(np.array(orbit.values)).solve_itinerary(
        fields, 1, False, guess, np.eye(7)[4], 0
    )
    assert status != Solving.SOLVED
    assert values[4] >= 0


def test_a_search_that_begins_nowhere_takes_no_step() -> None:
    fields = core.fields(parameter_rows(cs.Parameters())[0])
    found = fields.solve_itinerary(np.array([1, 2], np.int32), 1, False, [np.nan] * 6)
    assert found[2:4] == (Solving.NOT_FINITE, 0)


def test_a_mirrored_half_is_over_an_odd_number_of_periods() -> None:
    with pytest.raises(cs.InvalidInput, match="period_number = 2: must be odd"):
        cs.results.Itinerary.of([2, 3], 2, True)
    fields, at = np.array([2, 3], np.int32), core.fields(parameter_rows(cs.Parameters())[0])
    with pytest.raises(ValueError, match="fields"):
        at.solve_itinerary(fields, 2, True, [0.89, -0.64, 0.0, 24.5, 3.0, 0.9])


def test_a_map_is_remade_of_all_parameters() -> None:
    remade = core.map(parameter_rows(cs.Parameters())[0])
    with pytest.raises(ValueError, match=r"parameters must have shape \(7,\)"):
        remade.remake(1.0)


def test_a_long_itinerary_is_solved_from_its_solution() -> None:
    """No equation loses digits to the turns that have passed: 9.8e-12 with angles in one double."""
    orbit = cs.solve_orbit(cs.Parameters(alpha=0.7))
    times = 700 // len(orbit.itinerary)
    long = cs.results.Itinerary(times * orbit.itinerary.segments, times)
    z = [*orbit.z[:4], *(times * orbit.z[4:].tolist())]
    found = cs.orbits.solve_itinerary(orbit.parameters, long, z)
    assert found.success
    assert found.iterations <= 2
    assert found.residual < 1e-13
    assert found.z == pytest.approx(np.array(z), abs=1e-12)
    beside = cs.orbits.solve_itinerary(orbit.parameters, long, [value * (1 + 1e-6) for value in z])
    assert beside.success
    assert beside.iterations <= 4  # each squares the distance
    assert beside.z == pytest.approx(np.array(z), abs=1e-12)


def test_a_watch_stops_the_search() -> None:
    orbit = cs.solve_orbit(cs.Parameters(alpha=0.6))
    long = cs.results.Itinerary(200 * orbit.itinerary.segments, 200)
    watch = Watch()
    watch.stop()
    z = np.array([*orbit.z[:4], *(200 * orbit.z[4:].tolist())]) * 1.01
    found = core.fields(np.array(orbit.values)).solve_itinerary(
        np.array(long.fields, np.int32), 200, False, z, watch=watch
    )
    assert found[2] is None


def test_what_is_too_long_for_the_core_is_solved_without_it(monkeypatch) -> None:
    orbit = cs.solve_orbit(cs.Parameters(alpha=0.6))
    long = cs.results.Itinerary(1025 * orbit.itinerary.segments, 1025)
    z = np.array([*orbit.z[:4], *(1025 * orbit.z[4:].tolist())])
    with pytest.raises(ValueError, match="fields 1 to 6"):
        core.fields(np.array(orbit.values)).solve_itinerary(
            np.array(long.fields, np.int32), 1025, False, z
        )
    monkeypatch.setattr(closed, "_LONGEST", 1)
    other = cs.orbits.solve_itinerary(orbit.parameters, orbit.itinerary, list(1.01 * orbit.z))
    assert other.system.monodromy is None
    assert other.z == pytest.approx(orbit.z, abs=1e-13)
