"""Pareto fronts: no cell of a survey beats them, and their slopes are what their points say."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._design.front_search import FrontPoint, FrontSearch
from capsule_sym._design.functions import function_of
from capsule_sym._design.optimise import program_of
from capsule_sym._design.program import KEPT
from capsule_sym._design.survey import FrontSurvey, trade_offs
from tests.design.cells import metrics_of

BOUNDS = {"alpha": (0.3, 2.0), "omega": (0.6, 1.2)}
DAMPED = cs.Parameters(zeta=0.5, delta=20.0)  # soon settled


@pytest.fixture(scope="module")
def front() -> cs.results.Front:
    return cs.pareto(
        "speed", "cost_of_transport", BOUNDS, points=8, samples=64, max_seconds=math.inf
    )


@pytest.mark.long
def test_every_point_is_an_optimum_and_none_beats_another(front: cs.results.Front) -> None:
    assert front.success
    assert len(front.points) >= 7
    assert all(point.success and point.residual < 1e-9 for point in front.points)
    assert np.all(np.diff(front.costs) > 0)
    assert np.all(np.diff(front.values) > 0)


@pytest.mark.long
def test_no_cell_of_a_survey_is_faster_at_no_more_cost(front: cs.results.Front) -> None:
    draw = np.random.default_rng(4)
    low, high = np.array(list(BOUNDS.values())).T
    cells = [
        cs.Parameters(*(low + draw.uniform(size=2) * (high - low)).tolist()) for _ in range(600)
    ]
    near = 0
    for one in metrics_of(cells):
        if one and one["progression"]:
            speed = abs(one["velocity"])
            cost = one["work"] / abs(one["progression"])
            above = int(np.searchsorted(front.costs, cost))
            if above < len(front.costs):
                assert speed < front.values[above]  # at the bound next above this cost
                near += speed > 0.8 * front.values[above]
    assert near > 5


@pytest.mark.long
def test_the_multiplier_of_the_bound_is_the_slope_of_the_front(front: cs.results.Front) -> None:
    slopes = front.columns["slope"][1:-1]
    assert np.all(slopes > 0)
    assert np.isnan(front.columns["slope"][[0, -1]]).all()
    chords = np.diff(front.values) / np.diff(front.costs)
    # A concave front has at each point a slope between those of the chords beside it.
    smooth = slice(2, len(chords) - 1)
    assert np.all(np.diff(slopes)[:2] < 0)
    assert slopes[smooth.start - 1] == pytest.approx(
        chords[smooth.start - 1 : smooth.start + 1].mean(), rel=0.2
    )


@pytest.mark.long
def test_a_front_is_a_table_and_a_record(front: cs.results.Front) -> None:
    frame = front.to_dataframe()
    assert list(frame.columns)[:4] == ["speed", "cost_of_transport", "alpha", "omega"]
    assert len(frame) == len(front.points)
    assert json.loads(json.dumps(front.to_dict()))["status"] == "optimal"
    assert repr(front).startswith("<Front of speed against cost_of_transport")


def drawn(base, over: dict, count: int) -> np.ndarray:
    """Speeds and costs of transport (n, 2) of random cells from rest, by the core alone."""
    facts, draw = base.scene.facts, np.random.default_rng(12)
    rows = np.tile([*base.to_dict().values()], (count, 1))
    for name, ends in over.items():
        rows[:, facts.PARAMETERS.index(name)] = draw.uniform(*ends, size=count)
    rows = rows[np.argsort(rows[:, facts.PARAMETERS.index("omega")])]
    ended = cs.simulate_many(rows, periods=150, scene=base.scene)
    found = cs.performance_many(rows, ended.states, scene=base.scene)
    along, work = found["progression"], found["work"]
    still = abs(found.multipliers[:, 0]) < 1
    good = found.closed & still & (abs(found.states - ended.states).max(axis=1) < 1e-3)
    bounds = [rows[:, facts.PARAMETERS.index(facts.BOUNDS[way])] for way in (1, -1)]
    with np.errstate(divide="ignore"):
        costs = work / (abs(along) * np.where(along > 0, *bounds))
    return np.column_stack([abs(found["velocity"]), costs])[good & (abs(along) > 1e-9)]


def worse_between(front: cs.results.Front, last: int, over: dict[str, tuple[float, float]]) -> bool:
    """True if a drive between two neighbouring points is worse than one of them in both metrics."""
    ends = [front.points[i] for i in (last, last + 1)]
    for share in np.linspace(0.0, 1.0, 41)[1:-1]:
        drive = {
            name: (1 - share) * ends[0].over[name] + share * ends[1].over[name] for name in over
        }
        orbit = cs.solve_orbit(ends[0].system.replace(**drive))
        speed = abs(orbit.average_velocity) if orbit.success else 0.0
        if speed == 0.0:
            return True
        found = cs.performance(orbit)
        bound = orbit.parameters.scene.facts.BOUNDS[1 if orbit.average_velocity > 0 else -1]
        friction = getattr(orbit.parameters, bound)
        cost = found.work.value / (friction * abs(found.progression.value))
        for value, own in zip(
            front.values[last : last + 2], front.costs[last : last + 2], strict=True
        ):
            if speed < value * (1 - 1e-6) and cost > own * (1 + 1e-6):
                return True
    return False


@pytest.mark.parametrize(
    ("scene", "count"),
    [
        pytest.param("slope", 100_000, marks=pytest.mark.long),
        pytest.param("prototype", 100_000, marks=pytest.mark.long),
    ],
)
def test_a_front_in_parts_has_all_of_its_points_and_no_cell_beats_one(scene, count) -> None:
    base = getattr(cs.scenes, scene).Parameters()
    over = {"alpha": (0.1, 2.0), "omega": (0.5, 1.5)}
    found = cs.pareto("speed", "cost_of_transport", over, base, points=20, max_seconds=math.inf)
    assert len(found.parts) >= 3
    assert len(found.points) == 20
    speeds, costs = drawn(base, over, count).T
    ranges = np.ptp(found.values), np.ptp(found.costs)
    for value, cost in zip(found.values, found.costs, strict=True):
        assert speeds[costs <= cost].max(initial=0.0) < value * (1 + 1e-6)
    steps = np.diff(found.values) / ranges[0] + np.diff(found.costs) / ranges[1]
    gaps = [part.last for part in found.parts[:-1]]
    assert [part.first for part in found.parts[1:]] == [last + 1 for last in gaps]
    assert np.delete(steps, gaps).max() < 0.25  # evenly: no hole but the gaps
    for last in gaps:
        assert worse_between(found, last, over)
    assert "part" in found.columns


@pytest.mark.long
def test_a_branch_on_which_few_cells_are_good_is_on_the_front() -> None:
    base, over = cs.Parameters(zeta=0.02, beta=10.0), {"alpha": (0.2, 3.0), "omega": (0.3, 2.5)}
    found = cs.pareto("speed", "peak_force", over, base, points=20, max_seconds=math.inf)
    assert found.success
    drives = [(a, o) for a in np.linspace(1.9, 2.4, 21) for o in np.linspace(0.386, 0.392, 13)]
    cells = [one for one in metrics_of([base.replace(alpha=a, omega=o) for a, o in drives]) if one]
    assert len(cells) > 100
    # Basins are riddled at the edge of this branch: places near to a point may be slightly better.
    riddled = 1e-3 * np.ptp(found.values)
    for value, cost in zip(found.values, found.costs, strict=True):
        cheaper = [abs(one["velocity"]) for one in cells if one["peak_force"] <= cost]
        assert max(cheaper, default=0.0) < value + riddled


@pytest.mark.long
def test_one_point_may_be_best_in_both() -> None:
    how = {"points": 5, "samples": 4, "max_seconds": math.inf}
    found = cs.pareto("speed", "peak_force - speed*100", {"alpha": (0.7, 0.9)}, **how)
    assert len(found.points) == 1


@pytest.mark.long
@pytest.mark.parametrize(
    "changed",
    [
        {"subject_to": ["cost_of_transport <= 2.5", "peak_force <= 4"]},
        pytest.param({"start": (0.1, 0, 0)}, marks=pytest.mark.long),
    ],
)
def test_the_slope_is_that_of_the_front_whatever_else_holds(changed) -> None:
    how = {"points": 5, "samples": 16, "max_seconds": math.inf} | changed
    found = cs.pareto("speed", "cost_of_transport", BOUNDS, **how)
    assert len(found.points) == 5
    slopes = found.columns["slope"]
    chords = np.diff(found.values) / np.diff(found.costs)
    assert np.isnan(slopes[[0, -1]]).all()
    # This front is concave: a slope lies between those of the chords beside it.
    assert np.all(chords[1:] < slopes[1:-1])
    assert np.all(slopes[1:-1] < chords[:-1])


@pytest.mark.long
def test_the_end_of_least_cost_is_the_optimum_of_the_cost() -> None:
    how = {"points": 2, "samples": 8, "max_seconds": math.inf}
    found = cs.pareto("speed", "work", {"alpha": (0.5, 0.9)}, **how)
    assert len(found.points) == 2
    end = found.points[0]
    assert end.over["alpha"] == 0.5
    assert (end.metric, end.maximised) == ("work", False)
    assert end.value == pytest.approx(found.costs[0], rel=1e-12)
    assert end.metrics["speed"] == pytest.approx(found.values[0], rel=1e-12)
    assert (found.points[1].metric, found.points[1].value) == ("speed", found.values[1])


@pytest.mark.parametrize(
    ("changed", "field"),
    [({"points": 1}, "points"), ({"samples": 0}, "samples"), ({"against": "joy"}, "against")],
)
def test_what_is_not_allowed_is_refused(changed, field) -> None:
    given = {"metric": "speed", "against": "work", "over": BOUNDS} | changed
    with pytest.raises(cs.InvalidInput) as caught:
        cs.pareto(**given)
    assert caught.value.field == field


@pytest.mark.long
def test_a_metric_that_is_not_finite_at_the_end_of_a_front_is_told() -> None:
    """The least force does not move the capsule, whose cost of transport is infinite."""
    how = {"points": 5, "maximise": False, "samples": 32, "max_seconds": math.inf}
    with pytest.raises(
        cs.InvalidInput, match=r"metric = 'cost_of_transport': must be finite where"
    ):
        cs.pareto("cost_of_transport", "peak_force", BOUNDS, **how)
    found = cs.pareto(
        "cost_of_transport", "peak_force", BOUNDS, subject_to=["speed >= 0.05"], **how
    )
    assert len(found.points) == 5


def searched(limits: tuple[str, ...] = ()) -> FrontSearch:
    """An empty front of alpha, to maximise, against omega over the unit square, and its survey."""
    over = {"alpha": (0.0, 1.0), "omega": (1.0, 2.0)}
    program = program_of("alpha", over, DAMPED, True, limits, None)
    program = replace(program, limit_units=(1.0,) * len(limits))
    found = FrontSearch(program, function_of("against", "omega", program.system), 4)
    found.survey = FrontSurvey(program, found.searches[1].program.function, 1.0, 0)
    return found


def test_a_front_has_no_place_that_another_one_betters() -> None:
    both = np.array([[3.0, 0.0], [1.0, 1.0], [2.0, 1.0], [1.0, 2.0], [0.0, 3.0], [2.5, 0.5]])
    assert trade_offs(both).tolist() == [0, 5, 1, 4]
    assert trade_offs(both[2:5]).tolist() == [0, 1, 2]


def test_places_of_a_survey_are_within_limits_and_beget_better_ones() -> None:
    survey = searched(("alpha <= 0.5",)).survey
    assert survey.values(np.array([[0.25, 0.5], [0.75, 0.5]])).tolist() == [
        [-0.25, 1.5],
        [np.inf, np.inf],
    ]
    survey.look(np.random.default_rng(0).uniform(size=(16, 2)))
    before = survey.front
    survey.evolve()
    values, costs = survey.front.T
    assert len(survey.cells) > 16
    least = -0.5 - KEPT  # a violation by less counts as none
    assert np.all(values >= least)
    assert (
        least
        <= values[costs <= 1.001].min()
        < -0.49
        < before[before[:, 1] <= 1.001, 0].min(initial=0.0)
    )


def test_a_point_starts_at_the_best_place_of_each_branch_within_its_bound() -> None:
    """Of places on two lines of equal cost and other values, those that cost at most 1.5."""
    survey = searched().survey
    lines = [np.column_stack([np.full(41, a), np.linspace(0.0, 1.0, 41)]) for a in (0.2, 0.8)]
    survey.look(np.vstack(lines))
    starts = survey.bounded(1.5).starts(100)
    assert starts[0][0] == 0.8
    assert {float(one[0]) for one in starts} == {0.2, 0.8}
    assert all(one[1] <= 0.5 for one in starts)


@pytest.mark.parametrize(
    ("low", "high", "field", "metric", "best"),
    [
        ((0.0, 1.0), (-1.0, np.inf), "against", "omega", "alpha"),
        ((np.inf, 1.0), (-1.0, 2.0), "metric", "alpha", "omega"),
    ],
)
def test_a_metric_without_a_number_at_an_end_is_named(low, high, field, metric, best) -> None:
    """The low end is the best of omega, the high one that of alpha."""
    ends = (FrontPoint(np.full(2, 0.5), np.array(both), None) for both in (low, high))
    with pytest.raises(cs.InvalidInput, match=f"finite where {best} is best") as caught:
        searched().between(*ends, 1, 0)
    assert (caught.value.field, caught.value.value) == (field, metric)


@pytest.mark.parametrize(
    ("low", "high", "left"),
    [
        ((-1.0, 1.0), (-1.0, 2.0), 0),  # as good at a lower cost
        ((-1.0, 1.0), (-2.0, 1.0), 1),  # better at the same cost
        ((-2.0, 1.0), (-1.0, 2.0), 0),  # better and cheaper
        ((-1.0, 2.0), (-2.0, 1.0), 1),
    ],
)
def test_of_two_ends_one_is_the_whole_front_if_it_betters_the_other(low, high, left) -> None:
    search = searched()
    survey = search.survey
    ends = [FrontPoint(np.full(2, 0.5), np.array(both), None) for both in (low, high)]
    search.between(*ends, 1, 0)
    assert search.points == [ends[left]]
    assert search.survey is survey  # nothing is looked for between them


def test_a_point_is_kept_if_none_betters_it_and_none_that_it_betters() -> None:
    search = searched()
    u = np.array([0.5, 0.5])

    def point(value: float, cost: float) -> FrontPoint:
        return FrontPoint(u, np.array([-value, cost]), None)

    low, high = search.points = [point(0, 0), point(1, 1)]
    search.add(None)
    search.add(middle := point(0.5, 0.5))
    search.add(point(0.4, 0.6))
    search.add(point(0.5, 0.5))
    assert search.points == [low, middle, high]
    search.add(better := point(0.6, 0.4))
    assert search.points == [low, better, high]
    search.add(best := point(1.0, 0.9))
    assert search.points == [low, better, best]


def test_the_next_point_is_the_place_of_the_survey_that_is_farthest_from_all() -> None:
    search, asked = searched(), []
    both = np.array([[0.0, 0.0], [-0.2, 0.2], [-0.5, 0.4], [-1.0, 1.0]])
    low, high = (FrontPoint(np.full(2, cost), np.array([-cost, cost]), None) for cost in (0.0, 1.0))
    search.points = [low, high]
    search.survey = SimpleNamespace(front=both)
    search.point = asked.append  # finds nothing
    search.fill()
    assert asked == [0.4, 0.2]


def test_a_gap_of_a_front_is_where_the_theory_says() -> None:
    """A cubic rises to 0.016 at 0.8, and is there again at 1.4."""
    found = cs.pareto(
        "(alpha-1)**3-0.12*(alpha-1)",
        "alpha",
        {"alpha": (0.5, 1.5)},
        DAMPED,
        points=6,
        samples=4,
        max_seconds=math.inf,
    )
    assert found.success
    (first, second), drives = found.parts, found.costs - 1
    assert (first.first, second.last) == (0, len(found.points) - 1)
    assert found.costs[[0, first.last, -1]] == pytest.approx([0.5, 0.8, 1.5], abs=1e-8)
    assert 1.4 < found.costs[second.first] < 1.5
    assert found.values == pytest.approx(drives**3 - 0.12 * drives, abs=1e-9)
    inner = ~np.isnan(found.slopes)
    assert np.flatnonzero(~inner).tolist() == [0, first.last, len(drives) - 1]
    assert found.slopes[inner] == pytest.approx(3 * drives[inner] ** 2 - 0.12, abs=1e-6)


def test_a_front_jumps_to_another_branch_where_the_theory_says() -> None:
    """Of two valleys the one at omega 0.7 costs alpha / 2, the one at 1.1 0.36 + alpha / 10."""
    cost = "300*(omega-0.7)**2*(omega-1.1)**2+alpha*(1.2-omega)+0.9*(omega-0.7)"
    over = {"alpha": (0.5, 1.5), "omega": (0.6, 1.2)}
    found = cs.pareto("alpha", cost, over, DAMPED, points=6, samples=16, max_seconds=math.inf)
    first, second = found.parts
    ends = found.values[[first.last, second.first]]
    assert ends[0] < 0.9 < ends[1]
    omegas = np.array([one.over["omega"] for one in found.points])
    assert (omegas < 0.9).tolist() == (found.values < 0.9).tolist()
    grid = np.linspace(0.6, 1.2, 60_001)
    valley, slope = 300 * (grid - 0.7) ** 2 * (grid - 1.1) ** 2, 0.9 * (grid - 0.7)
    for value, own in zip(found.values[:-1], found.costs[:-1], strict=True):
        assert own == pytest.approx((valley + value * (1.2 - grid) + slope).min(), abs=1e-7)


@pytest.mark.long
def test_a_front_has_the_slow_drives_of_little_power() -> None:
    base, over = (
        cs.Parameters(alpha=1.5, zeta=0.03, beta=10.0),
        {"omega": (0.4, 2), "delta": (0, 1)},
    )
    found = cs.pareto("speed", "power", over, base, points=20, max_seconds=math.inf)
    slow = (found.values > 0) & (found.values < 0.22)
    assert slow.sum() >= 10
    assert np.all((found.costs[slow] > 0.0299) & (found.costs[slow] < 0.2831))
    # `optimise` with at most this power finds 0.0623; the front is concave there.
    assert np.interp(0.17, found.costs, found.values) > 0.0618


def test_a_limit_that_is_active_along_a_front_makes_no_gaps() -> None:
    """The limit is omega <= 1 in doubles that round on either side; the best is at it."""
    found = cs.pareto(
        "alpha",
        "alpha**2+(omega-1.1)**2",
        {"alpha": (0.5, 1.5), "omega": (0.6, 1.2)},
        DAMPED,
        points=6,
        subject_to=["omega**2+omega*0.3 <= 1.3"],
        samples=16,
        max_seconds=math.inf,
    )
    assert found.parts == ((0, 5),)
    omegas = [one.over["omega"] for one in found.points[:-1]]
    assert omegas == pytest.approx(np.ones(5), abs=1e-9)
