"""Metric, limits and units of an optimisation."""

import math
from functools import partial

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._design import cells as cells_module
from capsule_sym._design import evaluation
from capsule_sym._design.cells import evaluate
from capsule_sym._design.optimise import program_of
from capsule_sym._design.pieces import Piece
from capsule_sym._design.stationary import balanced, stationary
from capsule_sym._native import core
from capsule_sym._orbits.quantities import of
from capsule_sym._processes import sobol
from tests.design.cells import metrics_of
from tests.design.clock import LIMIT, Clock

BOUNDS = {"alpha": (0.1, 2.0), "omega": (0.5, 1.5)}
DEVICE = cs.PhysicalParameters(
    M_m=0.5, M_c=1.65, k1=50.0, k2=75.0, c=0.5, G=0.0017, P_d=3.0, Omega=8.0, mu=0.2
)


def surveyed(limit: float) -> float:
    """The greatest speed in the survey's own cells at which the peak force is within a limit."""
    program = program_of("speed", BOUNDS, None, True, (), None)
    found = metrics_of([program.system_at(u) for u in sobol(2, 256, 0)])
    return max(abs(one["velocity"]) for one in found if one and one["peak_force"] <= limit)


@pytest.mark.long
def test_no_optimum_is_worse_than_a_place_that_is_known_to_be_within_the_limits() -> None:
    found = cs.optimise("speed", BOUNDS, subject_to=["peak_force <= 1.8"])
    best = surveyed(1.8)
    assert best > 0.042  # where a search that leaves it comes to 0.041165
    assert found.success
    assert found.value > best
    assert found.metrics["peak_force"] <= 1.8 * (1 + 1e-7)
    # At the least frequency and the limit: beside it nothing within both is better.
    assert found.over["omega"] == 0.5
    draw = np.random.default_rng(5)
    beside = [
        found.system.replace(
            alpha=found.over["alpha"] + 1e-3 * a, omega=found.over["omega"] + 1e-3 * abs(w)
        )
        for a, w in draw.uniform(-1, 1, (200, 2)).tolist()
    ]
    near = metrics_of(beside)
    values = [abs(m["velocity"]) for m in near if m and m["peak_force"] <= 1.8]
    assert len(values) > 50
    assert found.value - 1e-3 < max(values) < found.value


@pytest.mark.long
@pytest.mark.parametrize(
    "function",
    [
        lambda m: m["speed"].value,
        lambda m: None,
        lambda m: m["joy"],
        lambda m: abs(m["velocity"]),
        lambda m: max(m["speed"], m["work"]),
        lambda m: np.sqrt(m["speed"]),
        lambda m: 1 / 0 * m["speed"],
        lambda m: m["speed"] * float("nan"),
        "3",
        "velocity/0",
    ],
)
def test_a_function_that_has_no_derivatives_or_no_number_is_refused(function) -> None:
    with pytest.raises(cs.InvalidInput, match=r"a function that|arithmetic") as caught:
        cs.optimise(function, BOUNDS, samples=8)
    assert caught.value.field == "metric"
    with pytest.raises(cs.InvalidInput, match=r"a function that|arithmetic") as caught:
        cs.pareto("speed", function, BOUNDS, samples=8, points=3)
    assert caught.value.field in ("metric", "against")


def test_limits_that_have_no_number_are_named() -> None:
    slow = {"alpha": (0.01, 0.3)}  # the capsule stands still, and goes at no cost
    for limit in ("cost_of_transport <= 1", (lambda m: m["speed"] * float("nan"), "<=", 1.0)):
        found = cs.optimise("speed", slow, subject_to=[limit], samples=16)
        assert found.status is cs.results.Status.INFEASIBLE
        assert found.message.endswith(" <= 1")


def test_where_a_function_has_no_number_others_are_taken() -> None:
    found = cs.optimise("progression/progression*alpha", {"alpha": (0.0, 1.5)}, samples=16)
    assert found.success
    assert found.over["alpha"] == pytest.approx(1.5)


@pytest.mark.long
@pytest.mark.parametrize(
    ("metric", "limits", "shift", "scale"),
    [
        ("speed + 1e10", [], 1e10, 1.0),
        *(
            pytest.param(*one, marks=pytest.mark.long)
            for one in (
                ("1e6*speed", ["peak_force <= 2.5", "work <= 1.5"], 0.0, 1e6),
                ("1e-14*speed", ["peak_force <= 2.5"], 0.0, 1e-14),
                ("speed", [("1e-6*peak_force - 2.5e-6", "<=", 0.0)], 0.0, 1.0),
            )
        ),
    ],
)
def test_units_of_a_metric_or_a_limit_decide_nothing(metric, limits, shift, scale) -> None:
    plain = cs.optimise(
        "speed", BOUNDS, samples=16, subject_to=["peak_force <= 2.5"] if limits else []
    )
    found = cs.optimise(metric, BOUNDS, samples=16, subject_to=limits)
    assert plain.success
    assert found.success
    for name, value in plain.over.items():
        assert found.over[name] == pytest.approx(value, abs=1e-6)
    assert found.value == pytest.approx(shift + scale * plain.value, rel=1e-9)
    assert found.slopes["gamma"] == pytest.approx(scale * plain.slopes["gamma"], rel=1e-5)


def test_a_metric_may_be_least_where_it_is_zero() -> None:
    found = cs.optimise("peak_contact", {"alpha": (0.001, 0.5)}, maximise=False, samples=32)
    assert found.status is cs.results.Status.OPTIMAL
    assert found.value == 0.0


def test_multipliers_of_the_wrong_sign_make_no_minimum() -> None:
    program = program_of("speed", {"alpha": (0.5, 0.9)}, None, True, ["peak_force <= 5"], None)
    u = np.array([0.0])  # the speed rises from this bound on
    place = program.begin(u)
    assert balanced(program, place).bounds[0] < 0
    piece = Piece(program, place)
    found = stationary(piece, piece.at(place.u))
    assert found is None or not found.kkt_satisfied or found.place.u[0] > 0


def test_bounds_may_be_arrays() -> None:
    given = {"alpha": np.array([1, 2])}
    assert cs.optimise("alpha - speed", given, samples=4).over["alpha"] == pytest.approx(2)


@pytest.fixture
def closings(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The orbits that the optimiser had closed, by what closed them: the core, or Python."""
    made = list[str]()
    for kind, name in (("core", "performance_many"), ("python", "solve_itinerary")):

        def counted(real, kind, *given, **more):
            made.append(kind)
            return real(*given, **more)

        monkeypatch.setattr(evaluation, name, partial(counted, getattr(evaluation, name), kind))
    return made


@pytest.mark.skipif(core is None, reason="counts what the core does")
def test_a_margin_that_cannot_hold_takes_bounded_work(closings) -> None:
    found = cs.optimise("speed", BOUNDS, margin=0.9, samples=1)
    assert found.status is cs.results.Status.INFEASIBLE
    # During the search differences of multipliers are computed by the core.
    assert closings.count("python") < 50
    assert closings.count("core") <= 100 * (found.statistics["followed"] + 1)


@pytest.mark.skipif(core is None, reason="counts what the core does")
def test_a_motion_that_is_slow_to_settle_is_closed_a_few_times(closings) -> None:
    p = cs.Parameters(alpha=1.703, omega=2.148, delta=0.191, zeta=0.077, beta=3.0, gamma=9.908)
    assert evaluation.settle(p, (0.0, 0.0, 0.0)) is not None
    assert closings.count("core") <= 12  # not for every length that is about a turn


@pytest.mark.parametrize("by", ["orbit", "core"])
def test_the_guess_of_a_continued_motion_is_on_the_tangent_of_its_branch(monkeypatch, by) -> None:
    """Its error is a quarter at half the step."""
    p, guesses, errors = cs.Parameters(), [], []
    motion = evaluation.settle(p, (0.0, 0.0, 0.0))
    name = {"orbit": "solve_itinerary", "core": "performance_many"}[by]
    solve = getattr(evaluation, name)

    def noted(row, *given, **how):
        guesses.append(np.array(given[by == "orbit"], dtype=float))
        return solve(row, *given, **how)

    monkeypatch.setattr(evaluation, name, noted)
    for step in (2e-3, 1e-3):
        moved = p.replace(alpha=p.alpha + step)
        if by == "orbit":
            found = evaluation.same_itinerary_at(motion, moved).orbit.z
        else:
            found = evaluation.continue_motion(motion, moved).found.states[0]
        errors.append(float(abs(np.asarray(found, dtype=float) - guesses[-1]).max()))
    assert len(guesses) == 2
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.02)


def test_newton_gives_nothing_that_has_no_number_to_lapack(capfd) -> None:
    def half(found):
        return found["speed"] if found["alpha"].value <= 0.9 else found["speed"] * np.nan

    over = {"alpha": (0.8, 1.0)}
    program = program_of(half, over, None, True, (), None)
    place = program.begin(np.array([0.5]))
    piece = Piece(program, place)
    found = stationary(piece, piece.at(place.u))
    assert found is None or not found.kkt_satisfied
    assert capfd.readouterr() == ("", "")  # LAPACK prints where it is given a nan


def test_without_contact_or_stiffness_nothing_drifts() -> None:
    # Two motions never move apart, and the mirror image of one drifts the other way.
    draw = np.random.default_rng(5)
    for k in range(40):
        alpha, omega, gamma = 10 ** draw.uniform(-0.5, 0.5, 3)
        delta, beta = (1e3, 1.5) if k % 2 else (0.02, 0.0)
        p = cs.Parameters(alpha, omega, delta, draw.uniform(0.01, 0.5), beta, gamma)
        motion = evaluation.settle(p, (0.0, 0.0, 0.0))
        for name in ("velocity", "progression"):
            assert motion.metrics[name].value == 0.0
            assert not motion.metrics[name].slope.any()
        assert motion.metrics["work"].value > 0 or motion.itinerary == ("F2",)
        program = program_of("progression", {"zeta": (p.zeta, 1.0)}, p, True, (), None)
        (about,) = evaluate(program, np.zeros((1, 1))).objective
        assert np.isnan(about) or about == 0.0


def test_drift_below_its_rounding_is_none_and_above_it_is_kept() -> None:
    # Beside a symmetric motion the drift is in proportion to the stiffness of the stop.
    def drift(beta: float, alpha: float = 1.2) -> float:
        p = cs.Parameters(alpha=alpha, beta=beta)
        return evaluation.settle(p, (0.0, 0.0, 0.0)).metrics["progression"].value

    slope = drift(1e-4) / 1e-4
    assert abs(slope) > 0.01
    assert drift(1e-8) == pytest.approx(1e-8 * slope, rel=1e-3)
    assert not any(drift(1e-18, alpha) for alpha in np.linspace(1.0, 1.9, 10))
    p = cs.Parameters()
    whole = cs.performance(cs.solve_orbit(p)).progression.value
    assert evaluation.settle(p, (0, 0, 0)).metrics["progression"].value == pytest.approx(whole)


def test_a_metric_without_a_number_where_nothing_drifts_is_refused() -> None:
    with pytest.raises(cs.InvalidInput, match="metric = 'cost_of_transport'"):
        cs.optimise("cost_of_transport", {"alpha": (0.8, 1.0)}, cs.Parameters(delta=9.0), samples=2)


@pytest.mark.parametrize("at", ["survey", pytest.param("search 1", marks=pytest.mark.long)])
def test_an_optimisation_that_is_out_of_time_has_the_best_that_was_found(monkeypatch, at) -> None:
    clock = Clock(monkeypatch, at)
    how = {"samples": 16, "progress": clock.progress}
    found = cs.optimise("speed", {"alpha": (0.5, 1.5)}, max_seconds=LIMIT, **how)
    assert (found.status, found.success) == ("time-limit", False)
    if at == "survey":
        unknown = "16 of 16 places are unknown: allow more time, or smaller bounds"
        message = f"time limit reached, and no place was found; {unknown}"
        assert (found.over, found.message) == ({}, message)
        return
    assert 0.1 < found.value < 0.3
    orbit = cs.solve_orbit(found.system)  # from rest, as the survey's runs
    assert found.value == pytest.approx(abs(cs.performance(orbit).velocity.value), rel=1e-9)


def test_a_survey_that_is_out_of_time_looks_at_no_further_cells(monkeypatch) -> None:
    clock, looked, settle = Clock(monkeypatch, "over"), [], cells_module.settle_many

    def limited(rows, *given, **how):
        looked.append(len(rows))
        found = settle(rows, *given, **how)
        clock.progress("over")
        return found

    monkeypatch.setattr(cells_module, "settle_many", limited)
    monkeypatch.setattr(cells_module, "_BLOCK", 4)
    found = cs.optimise("speed", {"alpha": (0.5, 1.5)}, samples=100, max_seconds=LIMIT)
    assert looked == [4]
    unknown = "96 of 100 places are unknown: allow more time, or smaller bounds"
    assert found.message == f"time limit reached: this is the best place so far; {unknown}"
    orbit = cs.solve_orbit(found.system)
    assert found.value == pytest.approx(abs(cs.performance(orbit).velocity.value), rel=1e-6)


@pytest.mark.parametrize("bounds", [{1: "f_b", -1: "gamma"}, {1: "f_b"}, {}])
def test_metrics_know_no_friction_bound_but_those_of_the_model(monkeypatch, bounds) -> None:
    """One where the capsule goes forward may be another than where it goes back, or none at all."""
    monkeypatch.setattr(cs.Parameters.scene.facts, "BOUNDS", bounds)
    for delta, way in ((1.0, 1), (0.02, -1)):
        p = cs.Parameters(alpha=0.9, delta=delta, gamma=0.5, f_b=0.8)
        metrics = of(evaluation.settle(p, (0.0, 0.0, 0.0)).metrics, p)
        gone, cost = (metrics[name].value for name in ("progression", "cost_of_transport"))
        assert gone * way > 0.1
        if way in bounds:
            bound = getattr(p, bounds[way])
            assert cost == pytest.approx(metrics["work"].value / (bound * abs(gone)), rel=1e-12)
        else:
            assert cost == math.inf


@pytest.mark.long
@pytest.mark.parametrize(
    ("at", "least", "most"),
    [("survey", 0, 8), ("between 3 points", 2, 8), ("between 6 points", 5, 8)],
)
def test_a_front_that_is_out_of_time_has_the_points_that_were_found(
    monkeypatch, at, least, most
) -> None:
    clock = Clock(monkeypatch, at)
    over = {"alpha": (0.8, 1.2), "omega": (0.7, 0.9)}
    how = {"samples": 8, "max_seconds": LIMIT, "progress": clock.progress}
    found = cs.pareto("speed", "cost_of_transport", over, points=9, **how)
    assert (found.status, found.success) == ("time-limit", False)
    assert least <= len(found.points) <= most
    for value, point in zip(found.values, found.points, strict=True):
        assert value == pytest.approx(abs(cs.performance(point.orbit).velocity.value))


@pytest.mark.long
def test_equal_peaks_at_a_bound_leave_no_optimum_undecided() -> None:
    """Without a second spring all peaks are equal, and any of them has the gradient at beta = 0."""
    p = cs.Parameters(alpha=0.73, omega=0.65, delta=0.43, zeta=0.06)
    for seed in range(3):
        found = cs.optimise(
            "peak_force",
            {"beta": (0.0, 30.0), "gamma": (0.5, 8.0)},
            p,
            maximise=False,
            samples=32,
            seed=seed,
        )
        assert found.success, found.message
        assert found.over["beta"] == 0.0
        assert found.bounds["beta"] > 0


def test_a_metric_that_nothing_changes_is_flat() -> None:
    found = cs.optimise("alpha", {"omega": (0.5, 1.0)}, samples=2)
    assert (found.status, found.success, found.over) == ("flat", False, {})
    assert found.message == "alpha is 0.7 at each of 2 surveyed places"
    for maximise in (True, False):
        found = cs.optimise("0*work-2", {"omega": (0.5, 1.0)}, maximise=maximise, samples=2)
        assert found.message == "0*work-2 is -2 at each of 2 surveyed places"
