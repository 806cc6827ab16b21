"""Optima in the interior, at bifurcations found by continuation, and at basin boundaries."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from capsule_sym import Parameters, continue_orbit, solve_orbit
from capsule_sym._design import polish as polish_module
from capsule_sym._design import search as search_module
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.optimise import program_of
from capsule_sym._design.optimum import optimum_of
from capsule_sym._design.pieces import Piece
from capsule_sym._design.polish import MARGIN, bifurcation_of, polish, with_limit
from capsule_sym._design.program import Program
from capsule_sym._design.search import Optimisation
from capsule_sym._design.stationary import local_search
from capsule_sym._design.survey import Survey
from capsule_sym._orbits.continuation.kinds import FOLD as FOLD_TYPE
from capsule_sym._orbits.continuation.kinds import NEIMARK_SACKER, PERIOD_DOUBLING
from capsule_sym.results import Status

FOLD = Parameters(
    alpha=0.88065606, omega=2.5, delta=0.2, zeta=0.0310785, beta=4.2171892, gamma=2.789994
)
FLIP = Parameters(
    alpha=3.0, omega=2.4322047, delta=0.77, zeta=0.047036956, beta=25.71881, gamma=1.7228395
)


def drive_power(t, x):
    return FOLD.alpha * np.cos(FOLD.omega * t) * (x[1] + x[2])


def integral(orbit, rate):
    """Integral per excitation period, by quadrature: at a fold metrics have no gradient."""
    trajectory, period = orbit.trajectory(), orbit.parameters.period
    total = 0.0
    for segment in trajectory.segments:
        begin = segment.start.period * period + segment.start.phase
        end = (begin + segment.duration) * (1 - 1e-15)
        total += quad(lambda t: rate(t, trajectory(t).tolist()), begin, end, epsabs=1e-12)[0]
    return total / orbit.itinerary.period_number


def at(metric, over, base, maximise, margin=None, u=0.5):
    """The program, and the best place of a search from the motion that rest leads to."""
    program = program_of(metric, over, base, maximise, (), margin)
    return program, local_search(program, program.begin(np.atleast_1d(u)))[0]


@pytest.mark.parametrize(
    ("kind", "metric", "base", "bounds", "end", "maximise"),
    [
        pytest.param(
            *("fold", "velocity/work", FOLD, (0.15, 0.65), 0.6, True), marks=pytest.mark.long
        ),
        ("period doubling", "velocity", FLIP, (0.70, 0.84), 0.7, False),
    ],
)
@pytest.mark.parametrize("margin", [pytest.param(None, marks=pytest.mark.long), 0.05])
def test_at_a_border_of_stability_the_limit_is_that_of_the_bifurcation(
    kind, metric, base, bounds, end, maximise, margin
) -> None:
    branch = continue_orbit(solve_orbit(base), "delta", end)
    event = next(one for one in branch.bifurcations if one.type == kind)
    there = integral(event.orbit, lambda t, x: x[2]) / event.orbit.parameters.period
    there /= integral(event.orbit, drive_power) if "work" in metric else 1.0
    u = (base.delta - bounds[0]) / (bounds[1] - bounds[0])
    best = polish(*at(metric, {"delta": bounds}, base, maximise, margin, u))
    found = optimum_of(with_limit(best))
    assert (found.status, found.bifurcation) == ("optimal-at-border", kind)
    assert found.limit == pytest.approx(there, rel=1e-6)
    assert found.multiplier == pytest.approx(1 - (margin or MARGIN), abs=1e-9)
    # It is on the branch, short of the bifurcation, and worse than what is approached there.
    assert (found.limit - found.value) * (1 if maximise else -1) > 0
    assert abs(found.over["delta"] - event.value) < 0.1


@pytest.mark.parametrize(
    ("multiplier", "kind"),
    [(1.0, FOLD_TYPE), (-1.0, PERIOD_DOUBLING), (0.6 + 0.8j, NEIMARK_SACKER)],
)
def test_a_loss_of_stability_is_named_by_where_the_multiplier_leaves(
    monkeypatch, multiplier, kind
) -> None:
    orbit = solve_orbit(Parameters())
    monkeypatch.setattr(polish_module, "floquet_multipliers", lambda one: [multiplier])
    assert bifurcation_of(Motion(orbit.parameters, None, orbit=orbit)) == kind


def test_a_margin_that_the_best_keeps_by_itself_bounds_nothing() -> None:
    program, place = at("speed_per_work", {"alpha": (0.5, 1.2)}, Parameters(), True, 0.05)
    found = optimum_of(polish(program, place))
    assert (found.status, found.bifurcation) == ("optimal", "")
    assert np.isnan(found.limit)


def test_slacks_on_a_piece_change_as_differences_say_and_those_of_borders_are_distances() -> None:
    over = {"alpha": (0.6, 1.2), "zeta": (0.05, 0.2)}
    program = program_of("velocity", over, Parameters(), True, ("work <= 2",), 0.05)
    u = np.array([0.4, 0.5])
    piece = Piece(program, program.begin(u))
    here = piece.at(u)
    slopes = program.by_u(here.slacks_by)
    assert len(slopes) > 4
    assert np.linalg.norm(slopes[2:], axis=1) == pytest.approx(np.ones(len(slopes) - 2), rel=1e-9)
    for k, step in enumerate(1e-5 * np.eye(2)):
        change = (piece.at(u + step).slacks - piece.at(u - step).slacks) / 2e-5
        assert slopes[:, k] == pytest.approx(change, rel=1e-5, abs=1e-7)


def test_an_optimum_close_to_a_border_is_one_inside() -> None:
    """A segment of contact begins by a graze, 5e-5 of the bounds away."""
    base = Parameters(
        alpha=1.0923904, zeta=0.049819912, beta=11.732544, gamma=3.784114, omega=0.55, delta=0.94
    )
    over = {"delta": (0.92, 0.96), "omega": (0.55, 0.565)}
    program, place = at("velocity/work", over, base, False, u=[0.55, 0.51])
    best = polish(program, place)
    found = optimum_of(best)
    assert (found.status, found.border) == ("optimal", None)
    assert found.residual < 1e-9
    for way in np.vstack([np.eye(2), -np.eye(2)]):
        beside = program.begin(best.place.u + 1e-4 * way)
        assert beside.objective > best.place.objective


@pytest.mark.long
def test_where_a_border_holds_a_place_the_pieces_beyond_are_looked_at() -> None:
    base = Parameters(omega=0.594, delta=0.2535, zeta=0.09, beta=3.83, gamma=2.47)
    program = program_of("velocity", {"alpha": (0.975, 0.995)}, base, False, (), None)
    program = replace(program, unit=1e-3)  # as by a survey
    cells = [program.begin(np.array([u])) for u in np.linspace(0.01, 0.99, 50)]
    best = min(cells, key=lambda place: place.objective)
    far = next(one for one in cells if one.motion.itinerary != best.motion.itinerary)
    held = polish(program, far)
    assert held is not None
    assert held.kkt_satisfied
    assert held.place.objective <= best.objective
    assert len(held.border) >= 2


@pytest.mark.long
def test_slopes_by_fixed_parameters_hold_at_a_margin() -> None:
    def solved(base):
        program, place = at("velocity/work", {"delta": (0.15, 0.65)}, base, True, 0.05, u=0.1)
        return optimum_of(polish(program, place))

    slopes = solved(FOLD).slopes
    assert set(slopes) >= {"alpha", "omega", "zeta", "beta", "gamma"}
    for name, slope in slopes.items():
        value, step = getattr(FOLD, name), 1e-5 * getattr(FOLD, name)
        above, below = (solved(FOLD.replace(**{name: value + by})) for by in (step, -step))
        assert above.multiplier == pytest.approx(0.95, abs=1e-8)
        assert slope == pytest.approx((above.value - below.value) / (2 * step), abs=1e-7)


def test_the_start_has_to_lead_to_the_motion_of_an_optimum() -> None:
    base = Parameters(alpha=2.5, omega=0.41, delta=0.41, zeta=0.025, beta=12.0, gamma=2.2)
    over, u = {"alpha": (2.4, 2.6)}, np.array([0.5])
    first, second = (
        program_of("velocity", over, base, True, (), None, start)
        for start in ((0.5, -0.9, -0.9), (0.4, 0.9, 0.1))
    )
    place, other = first.begin(u), second.begin(u)
    assert place.objective * other.objective < 0
    assert Optimisation(Survey(first)).settles_there(place)
    assert not Optimisation(Survey(first)).settles_there(other)


def test_motions_differ_by_limits_and_by_small_changes_of_a_large_objective(monkeypatch) -> None:
    program = program_of("speed", SMOOTH, None, True, ("work <= 2",), None)
    search, place = Optimisation(Survey(program)), program.begin(np.array([0.5]))
    far = replace(place, objective=1e7)
    monkeypatch.setattr(Program, "begin", lambda self, u: far)
    assert search.settles_there(far)
    assert not search.settles_there(replace(far, objective=1e7 + 1e-5))
    assert not search.settles_there(replace(far, slacks=far.slacks + 1e-5))


SMOOTH = {"alpha": (0.9, 1.0)}  # on one branch of smooth orbits


@cache
def smooth_best() -> float:
    """The alpha of the greatest progression over work, by quadrature along solved orbits."""

    def merit(alpha: float) -> float:
        orbit = solve_orbit(Parameters(alpha=alpha))
        work = integral(orbit, lambda t, x: alpha * np.cos(0.8 * t) * (x[1] + x[2]))
        return -abs(integral(orbit, lambda t, x: x[2])) / work

    return float(minimize_scalar(merit, bounds=SMOOTH["alpha"], method="bounded").x)


def smooth_search():
    """Search with a place off the optimum of a smooth problem, and one next to it."""
    program = program_of("speed_per_work", SMOOTH, None, True, (), None)
    search = Optimisation(Survey(replace(program, unit=2.0**-12)))
    off, near = (search.program.begin(np.array([u])) for u in (0.2, 0.64))
    return search, off, near


def test_a_place_is_at_no_basin_boundary_if_the_start_settles_where_it_is_better() -> None:
    search, off, _ = smooth_search()
    found = search.unsolved(off)
    assert found.bifurcation == "kink"
    assert found.program.system_at(found.place.u).alpha == pytest.approx(smooth_best(), abs=1e-3)


def test_a_place_is_at_a_basin_boundary_if_it_is_better_where_the_start_settles_elsewhere(
    monkeypatch,
) -> None:
    """Beyond 0.4 of the bounds, where the metric is better still, the start settles on nothing."""
    search, off, _ = smooth_search()
    begin = Program.begin
    monkeypatch.setattr(Program, "begin", lambda self, u: begin(self, u) if u[0] < 0.4 else None)
    found = search.unsolved(off)
    assert found.bifurcation == "basin boundary"
    assert 0.4 - 1e-6 <= found.place.u[0] < 0.4
    assert found.limit == found.place.objective < off.objective


def test_a_place_is_at_no_basin_boundary_if_the_start_settles_on_a_better_motion_beyond(
    monkeypatch,
) -> None:
    """Beyond 0.4 of the bounds the start settles on a motion with twice the metric."""
    search, off, _ = smooth_search()
    begin = Program.begin

    def twice(self, u):
        place = begin(self, u)
        return place if u[0] < 0.4 else replace(place, objective=2 * place.objective)

    monkeypatch.setattr(Program, "begin", twice)
    found = search.unsolved(off)
    assert found.bifurcation != "basin boundary"
    assert found.place.u[0] > 0.4
    assert found.place.objective < 1.9 * off.objective < 0


@pytest.mark.parametrize(("modulus", "kind"), [(0.995, PERIOD_DOUBLING), (0.98, "kink")])
def test_a_place_without_better_ones_is_at_a_bifurcation_if_a_multiplier_is_near_the_circle(
    monkeypatch, modulus, kind
) -> None:
    search, off, _ = smooth_search()
    off.motion.__dict__["multiplier"] = modulus
    monkeypatch.setattr(search_module, "local_search", lambda program, place: [place])
    monkeypatch.setattr(polish_module, "floquet_multipliers", lambda orbit: [-modulus])
    found = search.unsolved(off)
    assert (found.bifurcation, found.place, found.limit) == (kind, off, off.objective)
    search.survey.program = replace(search.program, margin=0.001)
    assert search.unsolved(search.program.begin(off.u)).bifurcation == "kink"


def test_a_place_whose_orbit_is_not_solved_is_at_a_kink(monkeypatch) -> None:
    search, off, _ = smooth_search()
    off.motion.__dict__["multiplier"] = 0.995
    monkeypatch.setattr(search_module, "local_search", lambda program, place: [place])
    monkeypatch.setattr(type(off.motion), "orbit", None)
    assert search.unsolved(off).bifurcation == "kink"


@pytest.mark.parametrize(
    ("limit", "status", "said"),
    [
        ("speed <= 10", Status.NOT_CONVERGED, "are the metric's derivatives finite"),
        ("speed >= 10", Status.INFEASIBLE, "was found to satisfy speed >= 10"),
    ],
)
def test_a_search_without_places_says_whether_limits_can_hold(limit, status, said) -> None:
    search = Optimisation(Survey(program_of("speed", SMOOTH, None, True, (limit,), None)))
    search.survey.run(4, 0)
    found = search.conclude()
    assert found.status is status
    assert said in found.message


def test_the_time_limit_keeps_an_optimum_that_was_found() -> None:
    search, off, near = smooth_search()
    search.kept = [off]
    search.optima = [search.solved(near)]
    found = search.result
    assert found.status == "time-limit"
    assert found.over["alpha"] == pytest.approx(smooth_best(), abs=1e-4)


def test_without_a_margin_the_limit_is_the_value_at_the_loss_of_stability() -> None:
    """A margin of 0 is no margin to go to 0: the best is at the bifurcation itself."""
    best = polish(*at("velocity", {"delta": (0.70, 0.84)}, FLIP, False, 0.0, 0.5))
    found = optimum_of(with_limit(best))
    assert (found.status, found.bifurcation) == ("optimal-at-border", "period doubling")
    assert found.multiplier == pytest.approx(1.0, abs=1e-9)
    assert found.limit == found.value
