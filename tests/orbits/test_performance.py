"""Energies, velocities and peak forces of orbits, and their gradients along the branch."""

import math
from collections.abc import Callable

import numpy as np
import pytest
import sympy as sp
from mpmath import mp, mpf
from scipy.integrate import quad

import capsule_sym as cs
from capsule_sym._orbits.metrics import performance as module
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._parameters import scene
from capsule_sym._symbolic.model import model
from capsule_sym._symbolic.model import symbols as s
from capsule_sym.orbits import solve_itinerary
from capsule_sym.results import Itinerary, Performance
from tests.orbits.branches import settled

_DEVICE = {"M_m": 0.5, "M_c": 1.65, "k1": 50, "c": 0.5, "P_d": 6, "Omega": 8, "mu": 0.2}
SLOPED = {
    "slope": {"k2": 75, "G": 0.0017},
    "prototype": {
        **{"k_front": 75, "k_back": 60, "G_front": 0.004, "G_back": 0.003, "P_low": -4, "duty": 0.4}
    },
}
ALPHAS = (0.005, 0.3, 0.45, 0.7, 1.2, 1.5, 1.9)
METRICS = tuple(name for name in Performance.__dataclass_fields__ if name != "imbalance")


@pytest.mark.parametrize("index", range(1, 7))
def test_energy_changes_by_work_less_losses_in_every_segment(index: int) -> None:
    """Along Eqs. (7)-(12): bodies and springs gain alpha cos v_m - 2 zeta v_r^2 - f_b |v_c|."""
    segment = model.segment(index)
    drift = segment.drift
    v_c = drift * sp.Symbol("speed", positive=True) if drift else sp.Integer(0)
    energy = (s.v_r + s.v_c) ** 2 / 2 + s.gamma * s.v_c**2 / 2 + s.x_r**2 / 2
    energy += s.beta * (s.x_r - s.delta) ** 2 / 2 * int(segment.contact)
    gained = sum(sp.diff(energy, q) * rate for q, rate in zip(s.STATE, segment.field, strict=True))
    drive = s.alpha * sp.cos(s.omega * s.tau) * (s.v_r + s.v_c)
    expected = drive - 2 * s.zeta * s.v_r**2 - s.f_b * sp.Abs(s.v_c)
    assert sp.expand((gained - expected).subs(s.v_c, v_c)) == 0


@pytest.mark.parametrize("alpha", ALPHAS)
def test_energy_balance_closes_to_rounding(alpha: float) -> None:
    found = cs.performance(settled(alpha=alpha))
    # The springs' energy is rounded too, which matters most if the work is small beside it.
    stored = found.peak_force.value**2 / 2
    assert abs(found.imbalance) < 8 * 2.0**-53 * (found.work.value + stored)


def test_balance_shows_a_quadrature_that_is_too_coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_nodes", lambda: np.polynomial.legendre.leggauss(5))
    assert abs(cs.performance(settled(alpha=0.7)).imbalance) > 1e-9


def test_the_balance_has_the_work_of_a_constant_load(monkeypatch: pytest.MonkeyPatch) -> None:
    orbit = settled(alpha=0.7)
    constants = type(orbit.system.flows[0].c)
    monkeypatch.setattr(constants, "lift_force", lambda _: -0.25)
    found = cs.performance(orbit)
    assert found.imbalance == pytest.approx(0.25 * found.progression.value, rel=1e-12)


@pytest.mark.parametrize("slope", [0.04, -0.02])
@pytest.mark.parametrize("name", SLOPED)
def test_on_a_slope_friction_and_lift_are_those_of_coulomb_and_of_gravity(name, slope) -> None:
    """By weight, ways and slope in SI units, and the balance, gradients as well."""
    given = _DEVICE | SLOPED[name] | {"mu_back": 0.12, "slope": slope}
    device = scene(name).PhysicalParameters(**given)
    orbit = cs.solve_orbit(device.dimensionless())
    found = cs.performance(orbit)
    advances = [device.scale("x_r") * one.advance for one in orbit.motion.segments]
    weight = (device.M_m + device.M_c) * device.g / math.hypot(1, slope)
    loss = sum(weight * (device.mu if a > 0 else device.mu_back) * abs(a) for a in advances)
    turns = orbit.itinerary.period_number
    assert device.scale("work") * found.friction_loss.value == pytest.approx(loss / turns, rel=1e-9)
    lift = weight * slope * sum(advances) / turns
    assert device.scale("work") * found.lift.value == pytest.approx(lift, rel=1e-9)
    assert max(advances) > 0 > min(advances)
    parts = found.damper_loss, found.friction_loss, found.lift
    assert abs(found.imbalance) < 1e-13
    for parameter, slope in found.work.gradient.items():
        assert slope == pytest.approx(sum(one.gradient[parameter] for one in parts), abs=1e-9)


def test_balance_holds_over_several_periods_of_excitation() -> None:
    parameters = cs.Parameters(alpha=2.96, omega=0.8, delta=0.5, zeta=0.01, beta=50.0, gamma=5.0)
    orbits = [cs.solve_orbit(parameters, (x, 0.0, 0.0)) for x in (-1.0, 0.0, 1.0, 2.0)]
    found = next(o for o in orbits if o.success and o.itinerary.period_number == 3)
    assert abs(cs.performance(found).imbalance) < 1e-14 * cs.performance(found).work.value


@pytest.mark.long
@pytest.mark.parametrize("zeta", [3.0, 100.0, 9e3])
def test_strong_damping_takes_few_nodes(zeta: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its fast mode decays: the panels are short at a segment's start alone."""
    p, calls = cs.Parameters(alpha=5.0, zeta=zeta), []
    run = ClosedForms.run
    monkeypatch.setattr(ClosedForms, "run", lambda *given: calls.append(0) or run(*given))
    found = cs.performance(cs.solve_orbit(p))
    assert abs(found.imbalance) < 1e-14 * found.work.value
    assert len(calls) < 2000  # panels of one length would be 34,000, of 16 nodes each
    ends = [
        cs.performance(cs.solve_orbit(p.replace(zeta=zeta * by))) for by in (1 - 1e-5, 1 + 1e-5)
    ]
    slope = (ends[1].damper_loss.value - ends[0].damper_loss.value) / (2e-5 * zeta)
    assert found.damper_loss.gradient["zeta"] == pytest.approx(slope, rel=1e-7)


@pytest.mark.long
def test_strong_damping_is_exact_in_50_digits() -> None:
    p = cs.Parameters(alpha=0.001, zeta=3.0)
    found = cs.performance(solve_itinerary(p, Itinerary.parse("2"), backend="mpmath"))
    with mp.workdps(60):
        omega, zeta = mpf(p.omega), mpf(p.zeta)
        amplitude = mpf(p.alpha) / mp.sqrt((1 - omega**2) ** 2 + (2 * zeta * omega) ** 2)
        loss = 2 * mp.pi * zeta * amplitude**2 * omega
        assert abs(found.work.value / loss - 1) < mpf("1e-48")
        assert abs(found.damper_loss.value / loss - 1) < mpf("1e-48")


@pytest.mark.parametrize(
    "alpha", [1.9, *(pytest.param(a, marks=pytest.mark.long) for a in (0.45, 1.5))]
)
def test_terms_are_the_integrals_that_adaptive_quadrature_gives(alpha: float) -> None:
    orbit = settled(alpha=alpha)
    parameters, trajectory = orbit.parameters, orbit.trajectory()
    period = parameters.period

    def total(integrand: Callable[[float, list[float]], float]) -> float:
        result = 0.0
        for segment in trajectory.segments:
            start = segment.start.period * period + segment.start.phase
            end = start + segment.duration
            safe = end * (1 - 1e-15) if segment is trajectory.segments[-1] else end
            result += quad(
                lambda t: integrand(t, trajectory(t).tolist()), start, safe, epsabs=1e-11
            )[0]
        return result

    found = cs.performance(orbit)
    drive = total(lambda t, x: parameters.alpha * math.cos(parameters.omega * t) * (x[1] + x[2]))
    assert found.work.value == pytest.approx(drive, abs=1e-9)
    damper = total(lambda t, x: 2 * parameters.zeta * x[1] ** 2)
    assert found.damper_loss.value == pytest.approx(damper, abs=1e-9)
    assert found.friction_loss.value == pytest.approx(total(lambda t, x: abs(x[2])), abs=1e-9)
    advance = total(lambda t, x: x[2])
    assert found.progression.value == pytest.approx(advance, abs=1e-9)
    assert found.velocity.value == pytest.approx(advance / period, abs=1e-9)


@pytest.mark.parametrize("alpha", [0.45, 1.5, 1.9])
def test_peaks_are_those_of_dense_samples(alpha: float) -> None:
    orbit = settled(alpha=alpha)
    p, trajectory = orbit.parameters, orbit.trajectory()
    start = trajectory.segments[0].start.phase
    x_r, v_r, _ = trajectory(np.linspace(start, start + 0.9999 * p.period, 40_000)).T
    spring = p.beta * np.maximum(x_r - p.delta, 0)
    found = cs.performance(orbit)
    # A parabola's top is missed by the step squared, times half its curvature.
    missed = 1e-6
    largest = np.max(abs(x_r + 2 * p.zeta * v_r + spring))
    assert largest <= found.peak_force.value + 1e-14 < largest + missed
    assert np.max(spring) <= found.peak_contact.value + 1e-14 < np.max(spring) + missed


@pytest.mark.parametrize("omega", [0.8, 1.0, 1.0 + 1e-9])
def test_figures_of_stick_are_those_of_the_oscillator(omega: float) -> None:
    """At resonance too: v_r = omega A sin, P = A (cos, 2 zeta omega sin)."""
    p = cs.Parameters(alpha=0.001, omega=omega)
    orbit = solve_itinerary(p, Itinerary.parse("2"))
    assert orbit.success, orbit.message
    found, amplitude = cs.performance(orbit), p.alpha / math.hypot(1 - omega**2, 2 * p.zeta * omega)
    loss = p.zeta * (omega * amplitude) ** 2 * p.period
    assert found.damper_loss.value == pytest.approx(loss, rel=1e-13)
    assert found.work.value == pytest.approx(loss, rel=1e-13)
    peak = amplitude * math.hypot(1, 2 * p.zeta * omega)
    assert found.peak_force.value == pytest.approx(peak, rel=1e-13)
    assert found.peak_contact.value == found.progression.value == found.friction_loss.value == 0


@pytest.mark.long
@pytest.mark.parametrize(
    "alpha", [0.3, *(pytest.param(a, marks=pytest.mark.long) for a in (0.7, 1.9))]
)
def test_gradients_are_the_slopes_along_the_branch(alpha: float) -> None:
    """Against orbits in 50 digits, along a direction with a part in every parameter."""
    orbit = settled(alpha=alpha)
    found = cs.performance(orbit)
    with mp.workdps(60):
        along = np.array([mpf(i) / 5 - 1 for i in (1, 2, 3, 4, 6, 7, 8)])
        step, ends = mpf("1e-15"), []
        for side in (1, -1):
            values = [mpf(v) + side * step * d for v, d in zip(orbit.values, along, strict=True)]
            moved = solve_itinerary(values, orbit.itinerary, list(orbit.z), backend="mpmath")
            assert moved.success, moved.message
            ends.append(cs.performance(moved))
        assert all(abs(end.imbalance) < mpf("1e-55") for end in ends)
        for name in METRICS:
            one, two = (getattr(end, name).value for end in ends)
            gradient = np.array([*getattr(ends[0], name).gradient.values()]) @ along
            # Taken at one end: a step times the second derivative off.
            assert abs((one - two) / (2 * step) - gradient) < mpf("1e-12"), name
            rounded = np.array([*getattr(found, name).gradient.values()]) @ along
            assert abs(rounded - gradient) < 1e-11, name
