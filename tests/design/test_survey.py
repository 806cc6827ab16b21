"""The survey of an optimisation: cells in batches, searches side by side, what starts lead to."""

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._design import survey
from capsule_sym._design.climb import climb, places_of
from capsule_sym._design.optimise import program_of
from capsule_sym._design.overview import overview
from capsule_sym._design.polish import BASIN
from capsule_sym._design.settled import settle_many

START = ((0.0, 0.0, 0.0),)
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
        lambda m: m["speed"] * 2 - m["power"] if m["work"].value > 0 else m["speed"],
        {"alpha": (0.6, 1.2)},
        cs.Parameters(),
    ),
    "slope": ("velocity", {"alpha": (0.6, 1.2)}, cs.scenes.slope.Parameters()),
    "prototype": ("peak_force", {"alpha": (1.6, 2.4)}, cs.scenes.prototype.Parameters(delta_2=2.0)),
}


@pytest.mark.parametrize("name", PROBLEMS)
def test_values_of_many_motions_are_those_of_each(name: str) -> None:
    metric, over, base = PROBLEMS[name]
    tolerances = {next(iter(over)): 0.01}
    program = program_of(metric, over, base, True, ("work <= 1",), None, START, tolerances)
    u = np.random.default_rng(2).uniform(size=(6, len(over)))
    found = overview(program, u)
    motions = [
        cs.performance_many(
            np.array([list(_plain(one.system(program.system_at(v))).values()) for v in u]),
            settled.found.states,
            np.maximum(settled.period_numbers, 1),
            gradients=True,
            scene=base.scene,
        )
        for one, settled in zip(program.scenarios, found.motions, strict=True)
    ]
    numbers = np.stack([one.period_numbers for one in found.motions], axis=1)
    places, seen = places_of(program, u, motions, numbers), 0
    for i, v in enumerate(u):
        place = program.begin(v)
        if place is None or not numbers[i].all():
            continue
        seen += 1
        assert found.worst[i] == pytest.approx(place.worst, rel=1e-9, abs=1e-12)
        assert places.worst[i] == pytest.approx(place.worst, rel=1e-9, abs=1e-12)
        assert found.slacks[i, 0] == pytest.approx(place.slacks.min(), rel=1e-9, abs=1e-12)
        by = program.by_u(place.objective_by)[int(np.argmax(place.objective))]
        if place.slacks.min() > 0:
            assert places.slope[i] == pytest.approx(by, rel=1e-7, abs=1e-9 * abs(by).max())
    assert seen >= 3


def _plain(system):
    return (system if hasattr(system, "alpha") else system.dimensionless()).to_dict()


def test_searches_side_by_side_come_to_the_optimum() -> None:
    over = {"alpha": (0.2, 2.0), "delta": (0.0, 0.5), "beta": (0.0, 20.0)}
    program = program_of("cost_of_transport", over, None, False, (), None, START, None)
    u = np.array([[0.4, 0.2, 0.7], [0.3, 0.5, 0.5], [0.6, 0.1, 0.9]])
    (settled,) = overview(program, u).motions
    rows = np.array([list(program.system_at(v).to_dict().values()) for v in u])
    numbers = settled.period_numbers
    found = cs.performance_many(rows, settled.found.states, numbers, gradients=True)
    ends = climb(program, places_of(program, u, [found], numbers[:, None]), 60, 0.1)
    assert ends.worst.min() == pytest.approx(1.372648972, rel=1e-8)
    assert ends.u[ends.worst.argmin()] == pytest.approx([0.33227, 0.0, 1.0], abs=1e-4)


@pytest.mark.long
def test_searches_begin_at_few_places_of_one_branch(monkeypatch: pytest.MonkeyPatch) -> None:
    over = {"omega": (0.3, 3.0), "alpha": (0.2, 3.0)}
    program = program_of("velocity", over, BESIDE, True, (), None, START, None)
    branches, cap = [], survey._ALIKE
    for most in (cap, 1):
        monkeypatch.setattr(survey, "_ALIKE", most)
        found = survey.Surveyor(program).candidates(survey.Survey(512, 0, 32))
        branches.append([(m.period_number, m.itinerary) for one in found for m in one.motions])
    assert 1 < max(map(branches[0].count, branches[0])) <= cap
    assert len(set(branches[1])) == len(branches[1]) == len(set(branches[0])) > 1


def test_motions_of_several_periods_are_closed_with_their_numbers() -> None:
    p = cs.Parameters(alpha=1.5, zeta=0.02, beta=20.0)
    systems = [p.replace(omega=w, delta=d) for w in (0.5, 0.9, 1.3, 1.7) for d in (0.0, 0.1, 0.4)]
    rows = np.array([list(one.to_dict().values()) for one in systems])
    found = settle_many(rows, START[0], first=64, most=1024, scene=p.scene)
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
    assert own.itinerary.period_number == found.orbits[0].itinerary.period_number
    assert beyond.itinerary != own.itinerary


def test_among_stable_motions_a_better_one_counts_that_rest_does_not_lead_to() -> None:
    found = cs.optimise("speed_per_work", NARROW, BESIDE, among="stable", samples=128)
    assert found.success
    assert found.value > 0.8705
    assert found.multiplier < 1
    at_rest = cs.solve_orbit(found.system)
    assert not at_rest.success or at_rest.itinerary != found.orbits[0].itinerary


def test_what_motions_count_is_one_of_two() -> None:
    with pytest.raises(
        cs.InvalidInput, match=r"^among = 'all': must be one of starts, stable"
    ) as told:
        cs.optimise("speed", NARROW, among="all")
    assert told.value.field == "among"
