"""Optima of steady motions: by their conditions, by neighbours, and by what a survey finds."""

import json
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._design.evaluation import same_itinerary_at, settle
from capsule_sym._design.optimise import program_of
from capsule_sym._design.optimum import optimum_of
from capsule_sym._design.pieces import distances
from capsule_sym._design.stationary import balanced
from capsule_sym._orbits.quantities import dimensionless_slopes, of
from capsule_sym._units import METRIC_UNITS
from capsule_sym.results import Optimum, Status
from tests.design.cells import metrics_of

BOUNDS = {"alpha": (0.1, 2.0), "omega": (0.5, 1.5), "delta": (0.0, 0.5)}
DEVICE = cs.PhysicalParameters(
    M_m=0.5, M_c=1.65, k1=50.0, k2=75.0, c=0.5, G=0.0017, P_d=3.0, Omega=8.0, mu=0.2
)
# Here a stick between two drifts appears by grazing-sliding, and the velocity is least.
KINK = cs.Parameters(omega=0.594, delta=0.2535, zeta=0.09, beta=3.83, gamma=2.47)
# The best of 100,000 runs and of those near to them, `python -m benchmarks optima`, number 448.
LIGHTEST = 3.4415759310348726


def per_work(parameters: cs.Parameters) -> float:
    """Speed per work by the orbit that is reached from rest, in Python."""
    found = cs.performance(cs.solve_orbit(parameters))
    return float(abs(found.progression.value) / found.work.value)


@pytest.fixture(scope="module")
def economical() -> Optimum:
    return cs.optimise("speed_per_work", BOUNDS)


def test_the_most_economical_drive_is_the_known_one(economical: Optimum) -> None:
    assert economical.success
    assert economical.status is Status.OPTIMAL
    assert economical.residual < 1e-9
    told = {name: round(value, 3) for name, value in economical.over.items()}
    assert told == {"alpha": 0.966, "omega": 0.79, "delta": 0.0}
    assert economical.value == pytest.approx(per_work(economical.system), rel=1e-12)
    assert round(economical.value, 3) == 0.716
    assert set(economical.bounds) == {"delta"}


def test_no_neighbour_of_an_optimum_is_better(economical: Optimum) -> None:
    p = economical.system
    for da, dw, dd in product((-0.01, 0.0, 0.01), (-0.005, 0.0, 0.005), (0.0, 0.01)):
        if da or dw or dd:
            beside = p.replace(alpha=p.alpha + da, omega=p.omega + dw, delta=p.delta + dd)
            assert per_work(beside) < economical.value


def test_no_cell_of_a_survey_is_better(economical: Optimum) -> None:
    draw = np.random.default_rng(3)
    low, high = np.array(list(BOUNDS.values())).T
    cells = [
        cs.Parameters(*(low + draw.uniform(size=3) * (high - low)).tolist()) for _ in range(1000)
    ]
    found = metrics_of(cells)
    best = max(abs(one["progression"]) / one["work"] for one in found if one)
    assert 0.65 < best < economical.value


@pytest.mark.long
def test_the_optimum_moves_with_fixed_parameters_as_new_optima_do(economical: Optimum) -> None:
    for name in ("zeta", "beta"):
        step = 1e-3 * getattr(economical.system, name)
        ends = [
            cs.optimise(
                "speed_per_work",
                {"alpha": (0.9, 1.05), "omega": (0.75, 0.85), "delta": (0.0, 0.05)},
                cs.Parameters(**{name: getattr(economical.system, name) + by}),
                samples=1,
            ).value
            for by in (-step, step)
        ]
        slope = (ends[1] - ends[0]) / (2 * step)
        assert economical.slopes[name] == pytest.approx(slope, rel=1e-4)
    assert set(economical.slopes) == {"zeta", "beta", "gamma", "f_b"}


@pytest.mark.long
def test_an_active_limit_costs_its_multiplier() -> None:
    bounds, values = {"alpha": (0.5, 0.9), "omega": (0.7, 0.9)}, []
    for limit in (1.899, 1.9, 1.901):
        found = cs.optimise("velocity", bounds, subject_to=[f"peak_force <= {limit}"], samples=2)
        assert found.success
        values.append(found)
    (constraint,) = values[1].constraints
    assert constraint.active
    assert abs(constraint.slack) < 1e-9
    assert values[1].metrics["peak_force"] == pytest.approx(1.9, abs=1e-9)
    slope = (values[2].value - values[0].value) / 0.002
    assert constraint.multiplier == pytest.approx(slope, rel=1e-3)


def test_an_optimum_on_a_border_is_told_with_both_sides() -> None:
    found = cs.optimise(
        "velocity + 30*(omega - 0.596)**2",
        {"alpha": (0.95, 1.0), "omega": (0.57, 0.62)},
        KINK,
        maximise=False,
        samples=1,
    )
    assert found.status is Status.OPTIMAL_AT_BORDER
    assert found.success
    assert found.residual < 1e-9
    assert found.border is not None
    assert len({*found.border}) == 2
    assert (
        cs.simulate(found.system, periods=300).steady() is not None
    )  # on the border itself is none
    p, step = found.system, 1e-4
    values = {}
    for da, dw in product((-step, 0.0, step), repeat=2):
        there = p.replace(alpha=p.alpha + da, omega=p.omega + dw)
        velocity = float(cs.solve_orbit(there).average_velocity)
        values[da, dw] = velocity + 30 * (there.omega - 0.596) ** 2
    assert min(values, key=values.__getitem__) == (0.0, 0.0)
    # A smooth minimum would rise with the square of the step.
    assert values[step, 0.0] - values[0.0, 0.0] > 1e-3 * step
    assert values[-step, 0.0] - values[0.0, 0.0] > 1e-3 * step


@pytest.mark.parametrize("unit", [1.0, 8.0])
@pytest.mark.parametrize("maximise", [True, False])
def test_gains_are_those_of_a_linear_program_in_any_unit(unit: float, maximise: bool) -> None:
    """3 alpha - 2 zeta + 5 gamma is greatest where 2 alpha is at its limit and zeta is least."""
    base = cs.Parameters(zeta=0.5, delta=20.0)  # soon settled
    over, limits = {"alpha": (0.5, 1.5), "zeta": (0.4, 0.9)}, ("2*alpha <= 1.6", "alpha >= 0.1")
    metric = "3*alpha - 2*zeta + 5*gamma" if maximise else "2*zeta - 3*alpha - 5*gamma"
    program = program_of(metric, over, base, maximise, limits, None)
    program = replace(program, unit=unit, limit_units=(2 / unit, unit))
    place = program.begin(np.array([0.3, 0.0]))
    assert place is not None
    found = optimum_of(replace(balanced(program, place), limit=place.objective))
    sign = 1 if maximise else -1
    assert found.value == pytest.approx(sign * (1.6 + 5 * base.gamma))
    assert found.limit == pytest.approx(found.value)
    assert found.residual == pytest.approx(0.0, abs=1e-12)
    assert found.over == pytest.approx({"alpha": 0.8, "zeta": 0.4})
    held, free = found.constraints
    assert (held.active, held.multiplier) == (True, pytest.approx(1.5))
    assert (free.active, free.multiplier) == (False, 0.0)
    assert [held.slack, free.slack] == pytest.approx([0.0, 0.7], abs=1e-12)
    assert found.bounds == pytest.approx({"zeta": 2.0})
    fixed = dict.fromkeys(("omega", "delta", "beta", "f_b"), 0.0)
    assert found.slopes == pytest.approx(fixed | {"gamma": 5.0 * sign})


@pytest.mark.long
def test_a_margin_of_stability_holds() -> None:
    bounds = {"alpha": (0.5, 1.2), "omega": (0.7, 0.9)}
    free = cs.optimise("speed_per_work", bounds, samples=2)
    margin = 1 - 0.9 * free.multiplier
    held = cs.optimise("speed_per_work", bounds, margin=margin, samples=2)
    assert held.success
    assert held.multiplier <= 1 - margin + 1e-6
    assert held.value < free.value
    assert held.constraints[0].active


def lightest(samples: int, **how: Any) -> Optimum:
    """The least force of a device that drifts in a small part of the bounds."""
    base = cs.Parameters(omega=2.4595, delta=0.7147, gamma=5.0337, zeta=0.0361)
    over = {"alpha": (0.4823, 2.9136), "beta": (1.6987, 21.8732)}
    how |= {"maximise": False, "subject_to": ("speed >= 0.00495",)}
    return cs.optimise("peak_force", over, base, samples=samples, **how)


@pytest.mark.long
def test_places_that_keep_a_limit_are_found_where_the_objective_is_far_less_beyond_it() -> None:
    found = lightest(128)  # nothing drifts over most of the bounds, at a small force
    assert found.status is Status.OPTIMAL
    assert found.value == pytest.approx(LIGHTEST, rel=1e-12)


def test_constraints_that_cannot_hold_are_named_with_how_far_they_fail() -> None:
    found = cs.optimise(
        "speed", {"alpha": (0.5, 0.9)}, subject_to=["peak_force <= 0.5", "speed <= 10"], samples=2
    )
    assert not found.success
    assert found.status is Status.INFEASIBLE
    assert "peak_force <= 0.5 by " in found.message
    assert "speed" not in found.message
    least = min(
        float(cs.performance(cs.solve_orbit(cs.Parameters(alpha=a))).peak_force.value)
        for a in np.linspace(0.5, 0.9, 9)
    )
    assert float(found.message.rsplit(" ", 1)[1]) == pytest.approx(least - 0.5, abs=0.01)


@pytest.mark.parametrize(("over", "samples"), [(("alpha",), 256), (("alpha", "omega"), 1024)])
def test_few_variables_have_a_small_survey(over, samples) -> None:
    found = cs.optimise("speed_per_work", {name: (0.9, 1.0) for name in over})
    assert found.success
    assert found.statistics["samples"] == samples


def test_the_slack_of_an_inactive_margin_is_the_distance_of_the_largest_multiplier() -> None:
    found = cs.optimise("speed_per_work", {"alpha": (0.9, 1.0)}, margin=0.01, samples=4)
    largest = abs(cs.solve_orbit(found.system).multipliers[0])
    (stability,) = found.constraints
    assert not stability.active
    assert stability.slack == pytest.approx(0.99 - largest, abs=1e-9)
    assert largest < 0.9


def test_a_search_may_meet_parameters_that_are_not_allowed_together() -> None:
    """Two stops need a distance between them: the corner of both bounds is no system."""
    base = cs.scenes.prototype.Parameters()
    over = {"delta_1": (0.0, 0.3), "delta_2": (0.0, 0.3)}
    found = cs.optimise("delta_1 + delta_2 + 0*work", over, base, maximise=False, samples=16)
    assert found.over["delta_1"] + found.over["delta_2"] > 0


def test_a_search_may_meet_a_corner_where_no_run_is_possible() -> None:
    """The best corner has zeta = c/(2 sqrt(k1 M_m)) above 1e4, though no bound alone has."""
    base = cs.PhysicalParameters(
        M_m=1.0, M_c=1.65, k1=0.5, k2=75.0, c=0.5, G=0.0017, P_d=3.0, Omega=8.0, mu=0.2
    )
    over = {"c": (0.0, 1e4), "k1": (0.2, 1.0)}
    found = cs.optimise("k1 - 1e-4*c", over, base, maximise=False, samples=64)
    assert found.over == pytest.approx({"c": 1e4, "k1": 0.25}, rel=1e-6)
    assert found.system.dimensionless().zeta <= 1e4


def test_a_device_has_its_optimum_in_its_own_units() -> None:
    found = cs.optimise(
        "speed_per_work", {"P_d": (3.0, 5.0), "Omega": (7.0, 9.0)}, DEVICE, samples=2
    )
    assert found.success
    p = found.system.dimensionless()
    orbit = cs.solve_orbit(p)
    metrics = cs.performance(orbit)
    joule = DEVICE.friction_force * DEVICE.length_scale
    assert found.metrics["work"] == pytest.approx(joule * metrics.work.value, rel=1e-12)
    assert found.metrics["speed"] == pytest.approx(
        DEVICE.scale("velocity") * float(metrics.velocity.value), rel=1e-12
    )
    way = DEVICE.scale("x_r") * float(metrics.progression.value)
    assert found.value == pytest.approx(way / found.metrics["work"], rel=1e-12)
    same = cs.optimise(
        lambda m: m["progression"] / m["work"],
        {"alpha": (0.7, 1.2), "omega": (0.7, 0.9)},
        DEVICE.dimensionless(),
        samples=2,
    )
    assert same.over["alpha"] == pytest.approx(p.alpha, rel=1e-7)
    assert same.over["omega"] == pytest.approx(p.omega, rel=1e-7)
    assert found.slopes["g"] * DEVICE.g == pytest.approx(
        found.slopes["mu"] * DEVICE.mu, rel=1e-9
    )  # both count by the friction force alone
    units = json.loads(json.dumps(found.to_dict()))["units"]
    assert [units[name] for name in ("speed_per_work", "P_d", "mu")] == ["m/J", "N", ""]
    assert repr(found).startswith("<Optimum: greatest speed_per_work")


def test_metrics_of_a_device_change_with_its_parameters_as_differences_say() -> None:
    motion = settle(DEVICE.dimensionless(), (0.0, 0.0, 0.0))
    assert motion is not None
    found = of(motion.metrics, DEVICE)
    for column, name in enumerate(type(DEVICE).__slots__):
        ends = []
        step = 1e-5 * getattr(DEVICE, name)
        for by in (-step, step):
            device = replace(DEVICE, **{name: getattr(DEVICE, name) + by})
            moved = same_itinerary_at(motion, device.dimensionless())
            assert moved is not None
            ends.append(of(moved.metrics, device))
        for metric in METRIC_UNITS:
            slope = (ends[1][metric].value - ends[0][metric].value) / (2 * step)
            assert found[metric].slope[column] == pytest.approx(slope, rel=1e-5, abs=1e-8)
    assert dimensionless_slopes(DEVICE).shape == (7, 10)


def test_distances_from_borders_change_as_differences_say() -> None:
    draw, kinds = np.random.default_rng(0), set()
    for _ in range(8):
        p = cs.Parameters(
            draw.uniform(0.3, 2),
            draw.uniform(0.5, 1.4),
            draw.uniform(0, 0.4),
            draw.uniform(0.02, 0.2),
        )
        motion = settle(p, (0.0, 0.0, 0.0))
        if motion is None or len(motion.orbit.itinerary) == 1:
            continue
        for k, name in enumerate(("alpha", "zeta")):
            step, ends = 1e-4, []
            for by in (-2 * step, -step, step, 2 * step):
                moved = same_itinerary_at(motion, p.replace(**{name: getattr(p, name) + by}))
                assert moved is not None
                ends.append(distances(moved.orbit))
            for key, (_, by) in distances(motion.orbit).items():
                values = [end[key][0] for end in ends if key in end]
                if len(values) < 4:
                    continue
                slope = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * step)
                column = 0 if name == "alpha" else 3
                assert by[column] == pytest.approx(slope, rel=1e-6, abs=1e-6), (k, key)
                kinds.add((key[0], key[2]))
    assert len(kinds) >= 5


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"metric": "happiness"}, "metric"),
        ({"metric": "velocity ** work"}, "metric"),
        ({"over": {}}, "over"),
        ({"over": {"phase": (0, 1)}}, "over"),
        ({"over": {"alpha": (2, 1)}}, "bounds of alpha"),
        ({"over": {"omega": (0, 1)}}, "bounds of omega"),
        ({"over": {"alpha": (0, float("inf"))}}, "bounds of alpha"),
        ({"subject_to": ["peak_force < 2"]}, "subject_to"),
        ({"subject_to": ["peak_force <= two"]}, "subject_to"),
        ({"subject_to": [("work", "<=", float("nan"))]}, "subject_to"),
        ({"margin": 1.0}, "margin"),
        ({"start": []}, "start"),
        ({"start": (0, 0)}, "start"),
        ({"samples": 0}, "samples"),
        ({"over": {"alpha": 1.0}}, "over"),
        ({"over": ["alpha"]}, "over"),
        ({"margin": "x"}, "margin"),
        ({"seed": -1}, "seed"),
        ({"start": "abc"}, "start"),
        ({"start": None}, "start"),
        ({"base": {"alpha": 1}}, "base"),
        ({"subject_to": 3}, "subject_to"),
        ({"over": {"omega": (1e-9, 1)}}, "bounds of omega"),
        ({"over": {"Omega": (1e-9, 10)}, "base": DEVICE}, "bounds of Omega"),
    ],
)
def test_what_is_not_allowed_is_refused_by_its_name(changed, field) -> None:
    given = {"metric": "velocity", "over": {"alpha": (0.5, 1.0)}} | changed
    with pytest.raises(cs.InvalidInput) as caught:
        cs.optimise(**given)
    assert caught.value.field == field
    assert "\n" not in str(caught.value)
