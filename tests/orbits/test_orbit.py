"""Newton's method on the orbit equations, what an orbit gives, and typed failures."""

import dataclasses
import math
import pickle

import numpy as np
import pytest
from mpmath import mp, mpf

import capsule_sym as cs
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.itinerary import ItinerarySegment
from capsule_sym._orbits.shooting.orbit import _UNSOLVED
from capsule_sym.generated.interface import Solving
from capsule_sym.orbits import solve_itinerary
from capsule_sym.results import Itinerary, Orbit, Status
from tests.orbits.branches import settled

# One motion of each kind between the bifurcations of the case study; the itineraries are the
# paper's.
WORDS = {
    0.005: "F2",
    0.3: "F5 F2",
    0.45: "F5 F4 F5 F2",
    0.7: "F5 F4 F1 F2",
    1.2: "F5 F4 F1 F2 F3 F2",
    1.5: "F5 F4 F1 F2 F3 F6",
    1.9: "F4 F1 F3 F6",
}


@pytest.mark.parametrize("alpha", WORDS)
def test_orbit_closes_with_the_printed_word(alpha: float) -> None:
    orbit = settled(alpha=alpha)
    assert str(orbit.itinerary) == WORDS[alpha]
    assert orbit.residual <= 1e-14
    assert sum(orbit.durations) == pytest.approx(orbit.parameters.period, rel=1e-15)


@pytest.mark.parametrize("alpha", [0.7, 1.5])
def test_orbit_is_where_a_long_run_goes(alpha: float) -> None:
    parameters = cs.Parameters(alpha=alpha)
    orbit, run = settled(alpha=alpha), cs.simulate(parameters, periods=300)
    motion = run.steady()
    assert motion is not None
    assert orbit.motion.global_map == motion.global_map
    assert orbit.progression == pytest.approx(motion.progression, abs=1e-12)
    assert orbit.average_velocity == pytest.approx(motion.progression / parameters.period)
    # The run has come to the orbit up to the last digits; at any time both give the same state.
    trajectory = orbit.trajectory()
    start = trajectory.segments[0].start.phase
    times = np.linspace(start, start + 0.999 * parameters.period, 50)
    reached = run(times + 290 * parameters.period)
    assert np.max(abs(trajectory(times) - reached)) < 1e-11


def test_refined_orbit_has_fifty_digits() -> None:
    orbit = settled(alpha=1.2)
    fine = orbit.refined()
    assert fine.success, fine.message
    with mp.workdps(60):
        assert fine.residual < mpf("1e-50")
        assert max(abs(fine.z - orbit.z)) < 1e-14
        (_, final), first = simulate_exactly(fine), fine.z
        assert max(abs(float(a - b)) for a, b in zip(final, first[:3], strict=True)) < 1e-14


def simulate_exactly(orbit: Orbit) -> tuple[str, tuple[mpf, ...]]:
    """The 50-digit map over one period from the orbit's rounded start."""
    start = [float(value) for value in orbit.z[:3]]
    phase = float(orbit.z[3]) / orbit.parameters.omega
    run = cs.simulate(orbit.parameters, start, phase, 2, backend="mpmath")
    again = [s for s in run.segments if s.start.period == 1]
    return "mpmath", next(s.start_state for s in again if s.field == orbit.itinerary.fields[0])


def test_stick_without_impact_is_the_forced_response() -> None:
    """x_r = alpha cos(omega tau - phi) / |1 - omega^2 + 2 i zeta omega|, capsule at rest."""
    parameters = cs.Parameters(alpha=0.005)
    orbit = solve_itinerary(parameters, Itinerary.parse("2"))
    assert orbit.success, orbit.message
    response = parameters.alpha / complex(
        1 - parameters.omega**2, 2 * parameters.zeta * parameters.omega
    )
    assert orbit.z[0] == pytest.approx(response.real, rel=1e-14)
    assert orbit.z[1] == pytest.approx(-parameters.omega * response.imag, rel=1e-14)
    assert orbit.z[2] == orbit.z[3] == orbit.progression == 0
    assert orbit.motion.global_map == "Id_{Σ2,F2,Σ2}"


def test_equilibrium_is_at_rest() -> None:
    orbit = solve_itinerary(cs.Parameters(alpha=0.0), Itinerary.parse("2"))
    assert orbit.success, orbit.message
    assert not np.any(orbit.z[:4])


@pytest.mark.long
def test_derivative_by_the_parameters_is_that_of_the_branch() -> None:
    """Along a direction with a part in every parameter."""
    orbit = settled(alpha=0.7).refined()
    assert orbit.success, orbit.message
    with mp.workdps(60):
        along = np.array([mpf(i) / 4 - 1 for i in (1, 2, 3, 5, 6, 7, 8)])
        ends = []
        for step in (mpf("1e-18"), -mpf("1e-18")):
            values = [value + step * part for value, part in zip(orbit.values, along, strict=True)]
            moved = solve_itinerary(values, orbit.itinerary, list(orbit.z), backend="mpmath")
            assert moved.success, moved.message
            ends.append(moved.z)
        slope = (ends[0] - ends[1]) / mpf("2e-18")
        assert max(abs(slope - orbit.by_parameter @ along)) < mpf("1e-30")


def test_undamped_resonance_is_singular() -> None:
    found = solve_itinerary(cs.Parameters(alpha=0.1, zeta=0.0, omega=1.0), Itinerary.parse("2"))
    assert not found.success
    assert found.status is Status.SINGULAR


def test_word_without_orbit_does_not_converge() -> None:
    """Below the grazing no motion touches the second spring and leaves it again."""
    found = solve_itinerary(
        cs.Parameters(alpha=0.003), Itinerary.parse("52"), [0.02, 0.001, 0.0, 0.2, 0.5, 7.0]
    )
    assert (not found.success) or min(found.durations) < 0


def test_guess_that_overflows_is_typed() -> None:
    itinerary = Itinerary.parse("52")
    found = solve_itinerary(cs.Parameters(), itinerary, [1e308, 1e308, 0.0, 0.0, 1.0, 1.0])
    assert not found.success
    assert found.status is Status.NOT_FINITE
    assert found.itinerary is itinerary
    assert found.message


def test_motion_that_does_not_settle_is_typed() -> None:
    found = cs.solve_orbit(cs.Parameters(alpha=0.7, omega=0.8, zeta=0.0, delta=0.5), periods=2)
    assert not found.success


@pytest.mark.parametrize("guess", [None, [0.0] * 5, [0.0] * 7])
def test_guess_of_the_wrong_size_is_refused(guess: list[float] | None) -> None:
    with pytest.raises(cs.InvalidInput, match="guess"):
        solve_itinerary(cs.Parameters(), Itinerary.parse("52"), guess)


@pytest.mark.parametrize("backend", ["numpy", "mpmath"])
@pytest.mark.parametrize("omega", [-0.8, 0.0, math.nan])
def test_values_that_parameters_cannot_have_are_refused(omega: float, backend: str) -> None:
    orbit = settled(alpha=0.9)
    values = [0.9, omega, *orbit.values[2:]]
    with pytest.raises(cs.InvalidInput) as caught:
        solve_itinerary(values, orbit.itinerary, orbit.z, backend=backend)
    assert (caught.value.field, repr(caught.value.value)) == ("omega", repr(omega))


@pytest.mark.parametrize("backend", ["numpy", "mpmath"])
@pytest.mark.parametrize("fields", [(9, 2), (5, 1), (2**40, 2), (5.7, 2), ()])
@pytest.mark.parametrize("guess", [None, [0.0] * 5, [0.0] * 6])
def test_a_handmade_itinerary_of_impossible_fields_is_refused(fields, guess, backend: str) -> None:
    itinerary = Itinerary(tuple(ItinerarySegment(field, Guard.GAP) for field in fields))
    with pytest.raises(cs.InvalidInput, match=r"(itinerary|fields) = "):
        solve_itinerary(cs.Parameters(), itinerary, guess, backend=backend)


@pytest.mark.parametrize("backend", ["numpy", "mpmath"])
def test_a_half_in_contact_with_the_single_stop_is_refused(backend: str) -> None:
    half = Itinerary((ItinerarySegment(5, Guard.GAP),), 1, True)
    with pytest.raises(cs.InvalidInput, match="without contact"):
        solve_itinerary(cs.Parameters(alpha=0.9), half, [0.0] * 5, backend=backend)


def test_guess_may_be_rough() -> None:
    """Ten per cent off in every unknown, Newton's method comes to the same orbit."""
    orbit = settled(alpha=0.7)
    again = solve_itinerary(orbit.parameters, orbit.itinerary, [1.1 * value for value in orbit.z])
    assert again.success, again.message
    assert max(abs(again.z[:3] - orbit.z[:3])) < 1e-13
    turns = (again.z[3] - orbit.z[3]) / (2 * math.pi)
    assert turns == pytest.approx(round(turns), abs=1e-13)


def test_what_is_no_orbit_says_so_whatever_is_asked_of_it() -> None:
    none = solve_itinerary(cs.Parameters(alpha=0.003), Itinerary.parse("52"), [np.nan] * 6)
    assert (none.success, none.status) == (False, Status.NOT_FINITE)
    for name in ("z", "system", "progression", "durations"):
        with pytest.raises(AttributeError, match=r"there is no orbit, and so no .*not finite"):
            getattr(none, name)
    assert repr(none).startswith("<NoOrbit (not-finite)")
    again = pickle.loads(pickle.dumps(none))
    assert (again.status, again.message, again.success) == (none.status, none.message, False)


def test_an_orbit_says_how_it_was_found() -> None:
    orbit = settled(alpha=1.2)
    assert (orbit.success, orbit.status) == (True, Status.CONVERGED)
    moved = dataclasses.replace(
        orbit, system=dataclasses.replace(orbit.system, residual=orbit.system.residual + 1e-3)
    )
    assert (moved.success, moved.status) == (False, Status.NOT_CONVERGED)
    assert "not small" in moved.message


def test_each_way_to_leave_the_equations_unsolved_has_a_status() -> None:
    assert {*_UNSOLVED} == {*Solving} - {Solving.SOLVED}
