"""Orbits, branches and curves as tables of pandas."""

import numpy as np
import pytest

import capsule_sym as cs

pytest.importorskip("pandas")


@pytest.fixture(scope="module")
def orbit() -> cs.results.Orbit:
    found = cs.solve_orbit(cs.Parameters(alpha=0.93))
    assert found.success, found.message
    return found


@pytest.fixture(scope="module")
def branch(orbit: cs.results.Orbit) -> cs.results.Branch:
    return cs.continue_orbit(orbit, "alpha", 0.945, points=4)


def test_an_orbit_is_a_row_a_segment(orbit: cs.results.Orbit) -> None:
    frame = orbit.to_dataframe()
    assert tuple(frame["field"]) == orbit.motion.itinerary
    np.testing.assert_array_equal(frame["duration"], [float(h) for h in orbit.durations])


def test_a_branch_is_a_row_a_point(branch: cs.results.Branch) -> None:
    frame = branch.to_dataframe()
    assert len(frame) == len(branch.points) > 1
    for (_, row), point in zip(frame.iterrows(), branch.points, strict=True):
        assert row["alpha"] == point.value == point.orbit.parameters.alpha
        assert row["itinerary"] == str(point.orbit.itinerary)
        assert (row["x_r"], row["v_r"], row["v_c"]) == tuple(map(float, point.orbit.z[:3]))
        largest = float(np.abs(cs.orbits.floquet_multipliers(point.orbit)).max())
        assert row["largest_multiplier"] == pytest.approx(largest, rel=1e-6)


def test_a_curve_is_a_row_a_point(branch: cs.results.Branch) -> None:
    first = branch.bifurcations[0]
    curve = cs.continue_bifurcation(first, "gamma", ((0.9, 0.96), (3.29, 3.31)), points=2)
    assert isinstance(curve, cs.results.Curve)
    frame = curve.to_dataframe()
    assert len(frame) == len(curve.points) > 1
    for (_, row), point in zip(frame.iterrows(), curve.points, strict=True):
        assert (row["alpha"], row["gamma"]) == point.values
        assert (row["line"], row["status"]) == (point.line, point.status)


def test_a_branch_without_points_is_an_empty_table(branch: cs.results.Branch) -> None:
    empty = cs.results.Branch(branch.axis, (), (), branch.status, "")
    assert len(empty.to_dataframe()) == 0


def test_tables_of_a_device_are_in_si_units(branch) -> None:
    names = ("M_m", "M_c", "k1", "k2", "c", "G", "P_d", "Omega", "mu")
    values = (0.5, 1.65, 50.0, 75.0, 0.5, 0.0017, 3.0, 8.0, 0.2)
    device = cs.PhysicalParameters(**dict(zip(names, values, strict=True)))
    length = 0.2 * 2.15 * 9.81 / 50.0  # m; times are in units of 1/10 s
    plain, si = branch.to_dataframe(), branch.to_dataframe(device)
    for name, scale in (
        ("progression", length),
        ("average_velocity", 10 * length),
        ("x_r", length),
        ("phase", 0.1),
    ):
        if name in plain:
            assert si[name].values == pytest.approx(plain[name].values * scale, rel=1e-14)
    assert {"progression", "average_velocity"} <= set(plain)
    assert (si["alpha"].values == plain["alpha"].values).all()
