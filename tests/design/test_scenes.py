"""Sensitivities, fits and optima of scenes other than the paper's."""

import math

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._design.pieces import distances
from capsule_sym._orbits.quantities import dimensionless_slopes

SLOPE = cs.scenes.slope
RUN = SLOPE.Parameters(alpha=0.8, s=-0.05)
STEP = 1e-6


RUNS = {
    "slope": RUN,
    "reaction": cs.scenes.reaction.Parameters(alpha=1.3, delta=0.1),
    "reaction_pulse": cs.scenes.reaction_pulse.Parameters(alpha=1.8, delta=0.1, D=0.4),
    "prototype": cs.scenes.prototype.Parameters(alpha=6.0, delta_1=3.0, delta_2=2.0),
}


@pytest.mark.parametrize("scene", RUNS)
def test_derivatives_of_a_run_are_differences_of_runs(scene) -> None:
    given, time = RUNS[scene], [15.0]
    run, names = cs.simulate(given, periods=3), given.scene.facts.PARAMETERS
    found = cs.sensitivities(run, time)
    assert found.columns[4:] == names
    for name in names:
        up, down = (
            cs.simulate(given.replace(**{name: getattr(given, name) + way * STEP}), periods=4)
            for way in (1, -1)
        )
        differences = (up(time, position=True) - down(time, position=True)) / (2 * STEP)
        size = 1 + np.abs(found.by(name)).max()
        assert found.by(name) == pytest.approx(differences, abs=1e-6 * size), name
    with pytest.raises(cs.InvalidInput, match=r"^name = 'none': must be one of x_r"):
        found.by("none")


def test_a_device_has_derivatives_of_all_its_ratios() -> None:
    device = SLOPE.PhysicalParameters(
        M_m=0.5,
        M_c=1.65,
        k1=50,
        k2=75,
        c=0.5,
        G=0.0017,
        P_d=3,
        Omega=8,
        mu=0.2,
        mu_back=0.3,
        slope=-0.03,
    )
    found, values = dimensionless_slopes(device), device.to_dict()
    for k, (name, value) in enumerate(values.items()):
        step = STEP * (abs(value) + 1e-3)
        up, down = (device.replace(**{name: value + way * step}).ratios() for way in (1, -1))
        differences = [(up[one] - down[one]) / (2 * step) for one in SLOPE.facts.PARAMETERS]
        size = 1 + np.abs(differences).max()
        assert found[:, k] == pytest.approx(differences, abs=1e-7 * size), name


def test_a_bias_of_either_sign_is_fitted() -> None:
    run = cs.simulate(RUN, periods=2)
    times = np.linspace(0.0, 15.0, 60)
    states = run(times, position=True)
    data = {"t": times, "x_r": states[:, 0], "x_c": states[:, 3]}
    found = cs.fit(data, RUN.replace(s=0.01), ("s", "f_plus"))
    assert found.success
    assert found.values["s"] == pytest.approx(-0.05, abs=1e-9)
    assert found.values["f_plus"] == pytest.approx(RUN.f_plus, abs=1e-8)


def test_an_optimum_over_a_bias_is_within_its_bounds() -> None:
    bounds = {"s": (-0.1, 0.1), "alpha": (0.6, 0.9)}
    found = cs.optimise("velocity", bounds, RUN, samples=16, max_seconds=60.0)
    assert found.success
    assert found.over["s"] == pytest.approx(-0.1)  # gravity pulls the mass forward
    with pytest.raises(cs.InvalidInput, match=r"^over = 'f_b': must be one of alpha, "):
        cs.optimise("velocity", {"f_b": (1, 2)}, RUN)
    with pytest.raises(cs.InvalidInput, match=r"^bounds of f_plus = \(-1, 1\): must be .* above 0"):
        cs.optimise("velocity", {"f_plus": (-1, 1)}, RUN)
    with pytest.raises(cs.InvalidInput, match=r"^bounds of s = \(1, -1\): must be two ascending"):
        cs.optimise("velocity", {"s": (1, -1)}, RUN)


@pytest.mark.parametrize("scene", ["slope", "reaction", "reaction_pulse"])
def test_distances_to_other_itineraries_have_exact_derivatives(scene: str) -> None:
    given = RUNS[scene]
    orbit = cs.solve_orbit(given)
    assert orbit.success
    rows = distances(orbit)
    names = given.scene.facts.PARAMETERS
    assert len(rows) >= len(orbit.itinerary)

    def near(name: str, way: int) -> dict[tuple[object, ...], tuple[float, np.ndarray]]:
        changed = given.replace(**{name: getattr(given, name) + way * STEP})
        moved = cs.orbits.solve_itinerary(changed, orbit.itinerary, [float(one) for one in orbit.z])
        return distances(moved)

    for k, name in enumerate(names):
        up, down = near(name, 1), near(name, -1)
        for key, (_, by) in rows.items():
            if key in up and key in down:
                slope = (up[key][0] - down[key][0]) / (2 * STEP)
                size = 1 + np.abs(by).max()
                assert by[k] == pytest.approx(slope, abs=1e-5 * size), (name, key)


@pytest.mark.long
def test_an_optimum_beyond_which_the_start_leads_elsewhere_names_the_boundary() -> None:
    """Between two folds: beyond some frequency rest leads to the slow motion, no more the fast."""
    device = cs.scenes.prototype.PhysicalParameters(
        M_m=0.0018, M_c=0.0017, k1=62, k_front=54000, k_back=28000, c=0.016, G_front=0.0016,
        G_back=0.00015, P_d=0.0091, P_low=0, duty=0.6, Omega=260, mu=0.23, mu_back=0.23,
    )  # fmt: skip
    found = cs.optimise("velocity", {"Omega": (250, 300)}, device, samples=16, max_seconds=math.inf)
    assert (found.status, found.bifurcation) == ("optimal-at-border", "basin boundary")
    assert found.limit == pytest.approx(found.value, rel=1e-12)

    def from_rest(frequency: float) -> float:
        system = device.replace(Omega=frequency)
        motion = cs.simulate(system.dimensionless(), periods=600).steady()
        assert motion is not None
        return system.scale("x_r") * motion.progression * frequency / (2 * np.pi)

    best = found.over["Omega"]
    assert from_rest(best) == pytest.approx(found.value, rel=1e-9)
    assert from_rest(best * (1 + 1e-6)) < 0.9 * found.value
    assert found.value > max(from_rest(one) for one in np.linspace(250, 300, 51))


@pytest.mark.long
def test_a_search_ends_where_the_drive_drags_the_device() -> None:
    """The velocity grows with the mean force, alpha D, up to friction, 1: there is no best."""
    bounds = {"D": (0.2, 0.9)}
    found = cs.optimise(
        "velocity", bounds, cs.scenes.prototype.Parameters(alpha=2), max_seconds=math.inf
    )
    assert (found.status, 2 * found.system.D > 0.99) == ("optimal-at-border", True)
