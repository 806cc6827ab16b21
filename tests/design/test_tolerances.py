"""Tolerances beside the theory of Sobol's indices, and beside motions followed one by one."""

import json
import math

import numpy as np
import pytest

import capsule_sym
from capsule_sym import InvalidInput, Parameters, PhysicalParameters, tolerances

SAMPLES = 1024
BASE = Parameters()
_SHARES = {"alpha": 0.05, "beta": 0.2}


def _relative(share: float) -> float:
    """Variance of an even distribution of a share about its value, over the value squared."""
    return share**2 / 3


@pytest.mark.long
def test_indices_of_a_sum_are_shares_of_the_variance() -> None:
    found = tolerances("10*alpha + beta", _SHARES, BASE, samples=SAMPLES)
    (one,) = found.metrics
    variances = np.array([_relative(0.05) * (10 * BASE.alpha) ** 2, _relative(0.2) * BASE.beta**2])
    expected = variances / variances.sum()
    np.testing.assert_allclose(one.first, expected, atol=0.02)
    np.testing.assert_allclose(one.total, expected, atol=0.02)
    assert one.mean == pytest.approx(10 * BASE.alpha + BASE.beta, rel=1e-3)
    assert one.deviation == pytest.approx(math.sqrt(variances.sum()), rel=5e-3)
    assert one.numbers == 1.0


@pytest.mark.long
def test_indices_of_a_product_have_an_interaction() -> None:
    shares = {"alpha": 0.1, "beta": 0.8}
    a, b = (_relative(share) for share in shares.values())
    (one,) = tolerances("alpha * beta", shares, BASE, samples=SAMPLES).metrics
    whole = (1 + a) * (1 + b) - 1
    np.testing.assert_allclose(one.first, [a / whole, b / whole], atol=0.02)
    np.testing.assert_allclose(one.total, [a * (1 + b) / whole, b * (1 + a) / whole], atol=0.02)


def test_a_distribution_of_scipy_is_sampled_as_it_is() -> None:
    stats = pytest.importorskip("scipy.stats")
    own = stats.truncnorm(-2, 2, loc=0.5, scale=0.01)
    found = tolerances(("alpha", "speed"), {"alpha": own}, BASE, samples=SAMPLES)
    one, speed = found.metrics
    assert one.mean == pytest.approx(0.5, rel=1e-4)
    assert one.deviation == pytest.approx(own.std(), rel=5e-3)
    np.testing.assert_allclose(one.quantiles, own.ppf([0.025, 0.25, 0.5, 0.75, 0.975]), rtol=1e-3)
    np.testing.assert_allclose([speed.first, speed.total], 1.0, atol=0.02)
    nearest = int(np.argmin(abs(found.parameters[:, 0] - 0.5)))
    motion = capsule_sym.solve_orbit(BASE.replace(alpha=float(found.parameters[nearest, 0])))
    assert found.values[nearest, 1] == pytest.approx(abs(motion.average_velocity), rel=1e-9)


def test_a_device_is_in_si_units() -> None:
    device = PhysicalParameters(M_m=1, M_c=3, k1=1, k2=1, c=0.1, G=0.02, P_d=1, Omega=1, mu=0.1)
    found = tolerances("velocity", {"k1": 0.01, "c": 0.1}, device, samples=64)
    orbit = capsule_sym.solve_orbit(device.dimensionless())
    velocity = device.scale("velocity") * orbit.average_velocity
    assert found.metrics[0].nominal == pytest.approx(velocity)


COEXISTING = Parameters(alpha=1.2, omega=1.2, zeta=0.02, beta=20.0, delta=0.1)


@pytest.mark.long
def test_other_itineraries_are_those_of_motions_found_one_by_one() -> None:
    found = tolerances("velocity", {"omega": 0.2}, COEXISTING, samples=64)
    first = capsule_sym.solve_orbit(COEXISTING)
    changed, without = 0, 0
    for (omega,) in found.parameters.tolist():
        reached = capsule_sym.solve_orbit(COEXISTING.replace(omega=omega))
        without += not reached.success
        changed += not reached.success or str(reached.itinerary) != str(first.itinerary)
    assert found.periodic.value == 1 - without / 64
    assert found.changed.value == pytest.approx(changed / 64, abs=1e-12)
    assert 0 < changed < 64


def test_small_tolerances_keep_the_motion_and_the_result_repeats() -> None:
    one, other = (tolerances("speed", {"alpha": 0.01}, BASE, samples=64, seed=3) for _ in range(2))
    assert one.changed.value == 0.0
    assert one.periodic.value == 1.0
    assert json.dumps(one.to_dict()) == json.dumps(other.to_dict())
    assert one.success


def test_a_time_limit_ends_it() -> None:
    found = tolerances("speed", {"alpha": 0.01}, BASE, max_seconds=1e-9)
    assert (found.success, found.metrics, found.status) == (False, (), "time-limit")


@pytest.mark.parametrize(
    ("over", "how", "told"),
    [
        ({}, {}, "over = {}"),
        ({"x": 0.1}, {}, "over = 'x'"),
        ({"alpha": 1.5}, {}, "tolerance of alpha = 1.5"),
        ({"zeta": 0.1, "delta": 0.0}, {}, "tolerance of delta = 0.0"),
        ({"alpha": 0.1}, {"samples": 100}, "samples = 100: must be a power of two"),
        ({"alpha": 0.1}, {"seed": -1}, "seed = -1"),
        ({"alpha": 0.1}, {"start": (0.0, 0.0)}, "start = (0.0, 0.0)"),
    ],
)
def test_what_is_refused(over: dict[str, float], how: dict[str, object], told: str) -> None:
    with pytest.raises(InvalidInput) as error:
        tolerances("speed", over, BASE, **how)  # type: ignore[arg-type]
    assert told in str(error.value)


def test_a_distribution_that_leaves_the_range_is_refused() -> None:
    stats = pytest.importorskip("scipy.stats")
    with pytest.raises(InvalidInput, match="tolerance of zeta"):
        tolerances("speed", {"zeta": stats.norm(0.01, 0.01)}, BASE, samples=64)
    with pytest.raises(InvalidInput, match="tolerance of alpha"):
        tolerances("speed", {"alpha": stats.uniform(0.3, 0.0)}, BASE, samples=64)


def test_the_picture_has_the_indices() -> None:
    found = tolerances(("speed", "peak_force"), _SHARES, BASE, samples=64)
    figure = capsule_sym.figures.plot_tolerances(found)
    for k, one in enumerate(found.metrics):
        bars = [bar.get_width() for bar in figure.axes[2 * k + 1].patches]
        np.testing.assert_allclose(bars, [*one.first, *one.total])
        counted = sum(bar.get_height() for bar in figure.axes[2 * k].patches)
        assert counted == found.samples


def test_the_command_prints_and_refuses(call) -> None:
    status, out, err = call(
        *("tolerances", "--tolerance", "alpha=0.05", "--normal", "zeta=0.01"),
        *("--metric", "speed", "--samples", "64", "--json"),
    )
    assert (status, err) == (0, [])
    shown = json.loads(out)
    assert shown["names"] == ["alpha", "zeta"]
    assert shown["metrics"][0]["metric"] == "speed"
    status, out, err = call("tolerances", "--tolerance", "alpha=0.05", "--samples", "64")
    assert "changed" in out
    assert "elsewhere" not in out
    status, out, err = call("tolerances", "--normal", "delta=1")
    assert (status, len(err)) == (2, 1)
    status, out, err = call(
        "tolerances", "--normal", "alpha=0.1", "--tolerance", "alpha=0.1", "--samples", "64"
    )
    assert (status, len(err)) == (2, 1)
