"""Results of a cell against the reference map, and outcomes of cells that fail."""

from dataclasses import replace

import numpy as np
import pytest

from capsule_sym import Parameters, simulate, solve_orbit
from capsule_sym._attractors import neighbourhoods
from capsule_sym._native import Watch, core
from capsule_sym._parameters import CAPSULE, scene
from capsule_sym._sweeps import cells
from capsule_sym._sweeps.cells import compute
from capsule_sym._sweeps.itineraries import code
from capsule_sym._sweeps.quantities import VARIABLES, CellOutcome
from capsule_sym.generated.interface import OrbitStatus
from capsule_sym.inputs import Axis, Sweep
from capsule_sym.orbits import floquet_multipliers
from capsule_sym.results import Outcome, Performances, SteadyMotion
from tests.sweeps import chart

RANGES = {"alpha": (0.0, 3.0), "omega": (0.3, 3.0), "delta": (0.0, 1.0)}
RANGES |= {"zeta": (0.01, 0.5), "beta": (0.2, 30.0), "gamma": (0.2, 6.0)}
needs_core = pytest.mark.skipif(core is None, reason="the C core was not compiled")


def reference(sweep: Sweep, row: np.ndarray) -> tuple[SteadyMotion | None, Outcome]:
    run = simulate(Parameters(*row.tolist()), periods=sweep.periods, backend="numpy")
    return run.steady(sweep.tolerance), run.segments[-1].outcome


@pytest.mark.long
def test_words_multiples_and_progressions_are_those_of_the_reference_map() -> None:
    sweep = Sweep(
        (Axis.sobol(RANGES, 8, seed=5),),
        periods=33,
        tolerance=1e-8,
        compute=("itinerary", "progression"),
    )
    block = compute(sweep)
    texts = {number: text for text, (number, _) in block.itineraries.items()}
    periodic = 0
    for i, row in enumerate(sweep.columns()[0]):
        motion, last = reference(sweep, row)
        outcome = CellOutcome(block.columns["outcome"][i])
        assert (outcome is CellOutcome.NEVER_SWITCHES) == (last is Outcome.NEVER)
        if motion is None:  # Newton's method may have closed it
            assert (outcome is CellOutcome.NOT_SETTLED) == (block.columns["period_number"][i] == 0)
            continue
        periodic += 1
        assert outcome is not CellOutcome.NOT_SETTLED
        assert texts[block.columns["itinerary"][i]] == " ".join(motion.itinerary)
        assert block.columns["period_number"][i] == motion.period_number
        assert block.columns["progression"][i] == pytest.approx(motion.progression, abs=1e-7)
    assert periodic >= 5


def test_longer_multiples_are_found() -> None:
    # Known from the reference map: a motion that repeats after two excitation periods.
    parameters = Parameters(1.139284, 1.206085, 0.010034, 0.051889, 19.46037, 1.784594)
    starts = [(x_r, v_r) for x_r in (-1.5, 0.0, 1.5) for v_r in (-1.5, 0.6)]
    values = np.array(starts)
    sweep = Sweep((Axis("start", ("x_r", "v_r"), values),), parameters, compute=("itinerary",))
    period_numbers = compute(sweep).columns["period_number"].tolist()
    expected = []
    for x_r, v_r in starts:
        motion = simulate(parameters, (x_r, v_r, 0.0), periods=300).steady()
        expected.append(motion.period_number if motion else 0)
    assert period_numbers == expected
    assert 2 in period_numbers


UNDAMPED = Parameters(alpha=0.0, omega=0.77, delta=0.5, zeta=0.0)
"""x_r = 0.1 cos h beside a period of 2 pi/0.77: no number of periods up to 16 closes it."""


def test_rest_for_ever_is_an_outcome_of_its_own_periodic_or_not() -> None:
    # At alpha = 0.005 the forced response alone is below the gap: the proof of rest holds.
    block = compute(Sweep((Axis.of("alpha", [0.0, 0.005, 0.7]),), compute=("itinerary",)))
    names = [CellOutcome(outcome).name for outcome in block.columns["outcome"]]
    assert names == ["NEVER_SWITCHES", "NEVER_SWITCHES", "CONVERGED"]
    assert block.itineraries["F2"] == (code("F2"), 2)
    at_rest = Sweep(
        (Axis.of("x_r", [0.1]),), UNDAMPED, periods=40, compute=("itinerary", "lyapunov")
    )
    columns = compute(at_rest).columns
    assert columns["outcome"].tolist() == [CellOutcome.NEVER_SWITCHES]
    assert columns["period_number"].tolist() == [0]
    # It neither grows nor decays.
    assert columns["lyapunov"][0] == pytest.approx(0.0, abs=1e-3)


def test_what_double_precision_leaves_open_is_settled_and_said() -> None:
    # x_r = -0.5 cos h touches the gap 0.5 exactly, once a period; x_r = -0.4 cos h never does.
    parameters = Parameters(alpha=0.0, omega=1.0, delta=0.5, zeta=0.0)
    sweep = Sweep(
        (Axis.of("x_r", [-0.5, -0.4]),), parameters, periods=2, compute=("itinerary", "final")
    )
    block = compute(sweep)
    outcomes = [CellOutcome.ESCALATED, CellOutcome.NEVER_SWITCHES]
    assert block.columns["outcome"].tolist() == outcomes
    np.testing.assert_allclose(
        block.columns["final"], [[-0.5, 0.0, 0.0], [-0.4, 0.0, 0.0]], rtol=0, atol=1e-13
    )


def test_a_cell_that_fails_leaves_its_neighbours_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    sweep = chart(3, 3, compute=("itinerary", "final"), chunk=(3, 3))
    whole = compute(sweep)
    slow = cells._Cells.slow

    def failing(self: cells._Cells, i: int) -> None:
        if i == 4:
            raise ZeroDivisionError("division")
        slow(self, i)

    monkeypatch.setattr(cells, "core_of", lambda *_: None)
    monkeypatch.setattr(cells._Cells, "slow", failing)
    block = compute(sweep)
    assert block.columns["outcome"][4] == CellOutcome.FAILED
    assert block.reasons == {"4": "ZeroDivisionError: division"}
    others = np.arange(9) != 4
    for name in ("outcome", "itinerary", "period_number"):
        np.testing.assert_array_equal(block.columns[name][others], whole.columns[name][others])


@needs_core
def test_the_slow_way_gives_what_the_core_gives(monkeypatch: pytest.MonkeyPatch) -> None:
    sweep = chart(4, 3, periods=100, chunk=(4, 3))
    fast = compute(sweep)
    monkeypatch.setattr(cells, "core_of", lambda *_: None)
    slow = compute(sweep)
    for name in ("outcome", "itinerary", "period_number"):
        np.testing.assert_array_equal(fast.columns[name], slow.columns[name])
    for name in ("progression", "final"):
        np.testing.assert_allclose(fast.columns[name], slow.columns[name], rtol=0, atol=1e-7)
    assert fast.itineraries == slow.itineraries


def test_only_what_is_asked_for_is_there() -> None:
    assert set(compute(chart(2, 2, compute=("progression",))).columns) == {"outcome", "progression"}


def test_multipliers_and_exponents_are_those_of_the_closed_orbit() -> None:
    sweep = Sweep((Axis.of("alpha", [0.7, 1.2]),), compute=("multipliers", "lyapunov"))
    block = compute(sweep)
    for i, alpha in enumerate((0.7, 1.2)):
        orbit = solve_orbit(Parameters(alpha=alpha))
        found = floquet_multipliers(orbit)  # type: ignore[arg-type]
        np.testing.assert_allclose(block.columns["multipliers"][i], found, rtol=0, atol=1e-9)
        exponent = np.log(abs(found[0])) / Parameters().period
        assert block.columns["lyapunov"][i] == pytest.approx(exponent, abs=1e-9)


def test_energies_balance_and_the_velocity_is_that_of_the_progression() -> None:
    sweep = Sweep((Axis.of("alpha", [0.6, 0.9, 1.5]),), compute=("energies", "progression"))
    columns = compute(sweep).columns
    losses = columns["damper_loss"] + columns["friction_loss"]
    np.testing.assert_allclose(columns["work"], losses, rtol=1e-12)
    assert (columns["work"] > 0.01).all()
    expected = columns["progression"] / Parameters().period
    np.testing.assert_allclose(columns["velocity"], expected, rtol=0, atol=1e-9)


ORBITS = ("multipliers", "energies", "forces", "lyapunov")


SLOW = [
    ("capsule", {"alpha": (0.3, 0.5, 6), "gamma": (1.5, 4.0, 6)}, {}, 0),  # multipliers of -0.98
    ("capsule", {"alpha": (0.3, 3.0, 6), "delta": (0.0, 0.4, 6)}, {"zeta": 0.005}, 0),  # spirals
    ("slope", {"alpha": (0.05, 2.0, 6), "zeta": (0.003, 0.05, 6)}, {}, 1),
    ("reaction", {"alpha": (0.5, 2.5, 6), "zeta": (0.003, 0.05, 6)}, {}, 0),
    ("numpy", {"gamma": (2.0, 3.0, 2)}, {"alpha": 0.4}, 0),
]


@pytest.mark.parametrize(("name", "over", "fixed", "late"), SLOW)
def test_slow_motions_are_those_of_long_runs(name, over, fixed, late, monkeypatch) -> None:
    own = CAPSULE if name == "numpy" else scene(name)
    axes = tuple(Axis.linear(one, *values) for one, values in over.items())
    sweep = Sweep(axes, own.Parameters(**fixed), compute=("itinerary", "energies"), periods=60)
    long = compute(replace(sweep, periods=3000)).columns
    if name == "numpy":
        monkeypatch.setattr(cells, "core_of", lambda *_: None)
        monkeypatch.setattr(neighbourhoods, "core_of", lambda *_: None)
    short = compute(sweep).columns
    settled = short["outcome"] != CellOutcome.NOT_SETTLED
    assert (~settled).sum() == late
    for one in ("itinerary", "period_number"):
        np.testing.assert_array_equal(short[one][settled], long[one][settled])
    for one in ("velocity", "work"):
        np.testing.assert_allclose(short[one][settled], long[one][settled], atol=1e-9)


@needs_core
def test_orbits_closed_by_the_core_are_those_that_python_closes(monkeypatch) -> None:
    """In contact, sticking or never so, of several periods, at rest, and where there is none."""
    drawn = (Axis.sobol(RANGES, 12, seed=5),)
    random = Sweep(drawn, periods=200, tolerance=1e-8, compute=("itinerary", *ORBITS))
    charted = chart(4, 3, periods=100, chunk=(4, 3), compute=ORBITS)
    at_rest = Sweep((Axis.of("alpha", [0.0, 0.005, 0.7, 1.9]),), compute=ORBITS)
    for sweep in (random, charted, at_rest):
        fast = compute(sweep)
        with monkeypatch.context() as patched:
            patched.setattr(cells._Cells, "close_many", lambda *given: None)
            slow = compute(sweep)
        both = (fast.columns["outcome"] < CellOutcome.NOT_SETTLED) & (
            slow.columns["outcome"] < CellOutcome.NOT_SETTLED
        )
        assert both.sum() >= 2
        assert (fast.columns["outcome"] <= slow.columns["outcome"]).all()
        for quantity in ORBITS:
            for name in VARIABLES[quantity]:
                one, two = fast.columns[name][both], slow.columns[name][both]
                np.testing.assert_allclose(one, two, rtol=1e-10, atol=1e-10, err_msg=name)


def test_an_orbit_of_another_itinerary_is_not_taken() -> None:
    part = cells._Cells(Sweep((Axis.of("alpha", [0.7]),), compute=("energies",)), Watch())
    part.run(np.arange(1))
    part.columns["itinerary"][0] = code("F5 F2")
    part.close(0)
    assert part.columns["outcome"][0] == CellOutcome.FAILED
    assert part.reasons == {0: "the orbit's itinerary is F5 F4 F1 F2, its period number 1"}


@needs_core
def test_the_core_closes_nearly_every_periodic_cell(monkeypatch: pytest.MonkeyPatch) -> None:
    left = []
    monkeypatch.setattr(cells._Cells, "close", lambda self, i: left.append(self.order[i]))
    block = compute(chart(12, 12, periods=100, chunk=(12, 12), compute=("itinerary", *ORBITS)))
    periodic = block.columns["period_number"] > 0
    assert periodic.sum() > 100
    assert periodic[left].sum() < 3


@needs_core
def test_a_cell_whose_orbit_switches_otherwise_is_left_to_python(monkeypatch) -> None:
    many, left = cells.closed_many, []

    def other(*given: object, **more: object) -> Performances:
        found = many(*given, **more)  # type: ignore[arg-type]
        found.fields[1, 0] = 7 - found.fields[1, 0]
        found.records["status"][2] = OrbitStatus.CHANGED
        return found

    monkeypatch.setattr(cells, "closed_many", other)
    monkeypatch.setattr(cells._Cells, "close", lambda self, i: left.append(self.order[i]))
    compute(Sweep((Axis.of("alpha", [0.6, 0.9, 1.2, 1.5]),), compute=("energies",)))
    assert left == [1, 2]
