"""The survey of an optimisation: places in batches, a population, what starts lead to."""

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._design.cells import Cells, evaluate
from capsule_sym._design.evaluation import _start_of, attracting, settle_many
from capsule_sym._design.optimise import program_of
from capsule_sym._design.polish import BASIN
from capsule_sym._design.survey import Survey
from capsule_sym.orbits import floquet_multipliers

DEVICE = cs.PhysicalParameters(
    M_m=0.5, M_c=1.65, k1=50.0, k2=75.0, c=0.5, G=0.0017, P_d=3.0, Omega=8.0, mu=0.2
)
# The motion from rest is another one below omega = 1.22824, where the best one is lost.
BESIDE = cs.Parameters(alpha=1.5, delta=0.0, zeta=0.02, beta=20.0)
NARROW = {"omega": (1.2, 1.26)}
PROBLEMS = {
    "capsule": ("velocity/work", {"alpha": (0.6, 1.2), "beta": (1.0, 3.0)}, cs.Parameters()),
    "device": ("speed_per_work", {"P_d": (3.0, 5.0), "k1": (40.0, 60.0)}, DEVICE),
    "cost": ("cost_of_transport", {"mu": (0.15, 0.25), "Omega": (7.0, 9.0)}, DEVICE),
    "function": (
        lambda m: m["speed"] * 2 - m["power"],
        {"alpha": (0.6, 1.2)},
        cs.Parameters(),
    ),
    "slope": ("velocity", {"alpha": (0.6, 1.2)}, cs.scenes.slope.Parameters()),
    "prototype": ("peak_force", {"alpha": (1.6, 2.4)}, cs.scenes.prototype.Parameters(delta_2=2.0)),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_values_of_many_motions_are_those_of_each(name: str) -> None:
    metric, over, base = PROBLEMS[name]
    program = program_of(metric, over, base, True, ("work <= 1",), 0.01)
    u = np.random.default_rng(2).uniform(size=(6, len(over)))
    found, seen = evaluate(program, u), 0
    for i, v in enumerate(u):
        place = program.begin(v)
        if place is None or found.numbers[i] <= 0:
            continue
        seen += 1
        assert found.objective[i] == pytest.approx(place.objective, rel=1e-9, abs=1e-12)
        assert found.slacks[i] == pytest.approx(place.slacks, rel=1e-9, abs=1e-12)
    assert seen >= 3


def test_places_beyond_a_limit_rank_after_all_within_and_lost_ones_last() -> None:
    program = program_of("alpha", {"alpha": (0, 1)}, None, False, ("alpha >= 1",), None)
    objective = np.array([1e9, -1.0, -2.0, np.nan])
    slacks = np.array([[0.0], [-1.0], [-2.0], [np.inf]])
    cells = Cells(np.zeros((4, 1)), objective, slacks, np.array([1, 1, 2, -1]))
    assert np.argsort(cells.merit(program)).tolist() == [0, 1, 2, 3]
    assert cells.unknown == 1
    assert cells.beyond(program).tolist()[:3] == [0.0, 1.0, 2.0]


def test_a_place_from_which_a_run_is_chaotic_has_no_objective() -> None:
    base = cs.Parameters(alpha=1.88, omega=0.32, delta=0.03, beta=17.57, gamma=7.47)
    over, limits = {"zeta": (0.05, 0.9)}, ("work <= 9",)
    program = program_of("peak_force", over, base, False, limits, 0.01)
    found = evaluate(program, np.array([[0.0], [1.0]]))
    assert found.numbers.tolist() == [0, 1]
    assert np.isnan(found.objective).tolist() == [True, False]
    assert np.isinf(found.slacks).tolist() == [[True, True], [False, False]]
    assert np.isinf(found.merit(program)).tolist() == [True, False]


def test_searches_start_at_places_that_no_neighbour_betters() -> None:
    """Two wells: the best place of each, the deeper one first, and none twice."""
    program = program_of("alpha", {"alpha": (0, 1)}, None, False, (), None)
    survey = Survey(program)
    u = np.linspace(0.0, 1.0, 101)[:, None]
    wells = np.minimum(abs(u[:, 0] - 0.2), abs(u[:, 0] - 0.7) - 0.1)
    survey.cells = Cells(u, wells, np.empty((101, 0)), np.ones(101, int))
    assert [one[0] for one in survey.starts(5)] == pytest.approx([0.7, 0.2])


def test_a_population_evolves_to_better_places_and_all_are_kept() -> None:
    over = {"alpha": (0.2, 2.0), "delta": (0.0, 0.5), "beta": (0.0, 20.0)}
    survey = Survey(program_of("cost_of_transport", over, None, False, (), None))
    survey.run(64, 0)
    assert len(survey.cells) == 64
    before = survey.cells.merit(survey.program).min() * survey.program.unit
    survey.evolve()
    merit = survey.cells.merit(survey.program)
    after = merit.min() * survey.program.unit
    assert len(survey.cells) > 64
    # One optimum, 1.389140, is at (0.431, 0, 0.094) of the bounds, another, 1.372649, at (0.332, 0,
    # 1): the population meets the bounds themselves.
    assert 1.372648 < after < 1.38915 < 1.4 < before
    assert survey.cells.u[merit.argmin(), 1] == 0.0
    assert abs(survey.cells.u - 0.5).max() <= 0.5


def test_motions_of_several_periods_are_closed_with_their_numbers() -> None:
    p = cs.Parameters(alpha=1.5, zeta=0.02, beta=20.0)
    systems = [p.replace(omega=w, delta=d) for w in (0.5, 0.9, 1.3, 1.7) for d in (0.0, 0.1, 0.4)]
    rows = np.array([list(one.to_dict().values()) for one in systems])
    found = settle_many(rows, (0.0, 0.0, 0.0), scene=p.scene)
    numbers = []
    for i, one in enumerate(systems):
        orbit = cs.solve_orbit(one)
        if orbit.success and found.period_numbers[i]:
            numbers.append(orbit.itinerary.period_number)
            assert found.period_numbers[i] == numbers[-1]
            work = float(found.found["work"][i])
            assert np.isfinite(work)
    assert len(set(numbers)) > 1


@pytest.mark.long
def test_the_best_that_starts_lead_to_ends_at_the_edge_of_where_they_do() -> None:
    found = cs.optimise("speed_per_work", NARROW, BESIDE, samples=128)
    assert (found.status, found.bifurcation) == ("optimal-at-border", BASIN)
    assert found.success
    assert found.value == pytest.approx(0.869758, abs=1e-5)
    own, beyond = (
        cs.solve_orbit(found.system.replace(omega=found.system.omega + way))
        for way in (1e-5, -1e-4)
    )
    assert own.itinerary.period_number == found.orbit.itinerary.period_number
    assert beyond.itinerary != own.itinerary


def test_a_motion_that_is_closed_and_unstable_is_not_one_on_which_starts_settle() -> None:
    p = cs.Parameters(3.0, 2.4322047, 0.77, 0.047036956, 25.71881, 1.7228395)
    branch = cs.continue_orbit(cs.solve_orbit(p), "delta", 0.7)
    lost = [one.orbit for one in branch.points if abs(floquet_multipliers(one.orbit)[0]) > 1.05]
    rows = np.array([[*one.parameters.to_dict().values()] for one in lost])
    starts, phases = zip(*(_start_of(one, one.parameters) for one in lost), strict=True)
    found = cs.performance_many(rows, cs.simulate_many(rows, starts, phases, 1).states, 2)
    assert found.closed.sum() > 5
    assert not attracting(found).any()
