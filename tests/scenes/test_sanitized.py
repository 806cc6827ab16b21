"""The C library of scenes, under sanitizers, beside the integrator: runs, orbits, derivatives."""

import random
import shutil
from collections.abc import Callable

import pytest

from tests.scenes import Form, Integrator, Run, Start, grouped, random_starts
from tests.scenes.library import FORMS, SANITIZED, Library, library
from tests.scenes.orbits import Within, compared
from tests.secondmodel.test_second_model import random_starts as gentle_starts

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

PERIODS = 4


def varied(form: Form) -> list[Start]:
    """Random starts, fifty after the other of one linear flow; of every other one the pulses are
    very short or long, or of levels that are equal or opposite."""
    r, starts = random.Random(30), grouped(random_starts(form, 1000), 50)
    for i, start in enumerate(starts):
        given = start.parameters
        if i % 2:
            short = r.choice([1e-6, 10 ** r.uniform(-6, -1)])
            given["D"] = r.choice([short, 1 - short])
            given["alpha_low"] = r.choice([1, -1, given["alpha_low"]]) * given["alpha"]
    return starts


def between(form: Form) -> list[Start]:
    """Random starts, every fifth on the surface of a stop, every sixth with narrow gaps.

    Of twenty each linear flows are the same, so that they run side by side.
    """
    r, found = random.Random(2), list[Start]()
    for k, start in enumerate(grouped(random_starts(form, 1000), 20)):
        given = dict(start.parameters)
        x_r, v_r, v_c = start.state
        if k % 6 == 1:
            given["delta_1"], given["delta_2"] = 0.01, r.choice([0.01, 0.0])
        if k // 20 % 6 == 2:
            given["beta_1"] = given["beta_2"] = 900.0
        if k % 5 == 1:
            x_r = given["delta_1"]
        if k % 5 == 2:
            x_r = -given["delta_2"]
        if given["delta_1"] + given["delta_2"] > 0:
            found.append(Start(given, (x_r, v_r, v_c), start.phase))
    return found


def reacting(form: Form) -> list[Start]:
    return grouped(random_starts(form, 300), 8)


def level(form: Form) -> list[Start]:
    return [Start(p, state) for p, state, _ in random_starts(form, 300, 29)]


STARTS: dict[str, tuple[Callable[[Form], list[Start]], float]] = {
    "pulsed": (varied, 10),
    "two_stops": (between, 10),
    "biased": (level, 32),
    "reaction": (reacting, 32),
    "reaction_pulse": (reacting, 32),
}
"""Starts, and the largest error of a final state, in units of a run's rounding errors."""
LIBRARIES: dict[str, Library] = {}
"""Those that are compiled, by scene."""


@pytest.fixture(scope="module", params=STARTS)
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> str:
    name: str = request.param
    LIBRARIES[name] = library(name, tmp_path_factory.mktemp(name), *SANITIZED)
    return name


@pytest.fixture(scope="module")
def judged(scene: str, judge: Integrator) -> tuple[list[Start], list[Run]]:
    """Starts whose runs the integrator decides."""
    given = STARTS[scene][0](FORMS[scene])
    runs = judge.runs(FORMS[scene], given, PERIODS)
    decided = [run.status == "done" for run in runs]
    assert all(decided) or (scene == "two_stops" and sum(decided) > 0.99 * len(given))
    events = {one.event for run in runs for one in run.segments}
    assert events >= {"F", "V", "U", "L"} | ({"B"} if scene == "two_stops" else set())
    pairs = [
        one for one, known in zip(zip(given, runs, strict=True), decided, strict=True) if known
    ]
    return [start for start, _ in pairs], [run for _, run in pairs]


@pytest.mark.parametrize("way", ["as needed", "doubles", "106 bits", 4, 8])
def test_runs_are_those_of_the_integrator(way, scene, judged) -> None:
    """Every field passed, edges among their ends, and final states to a few roundings."""
    starts, runs = judged
    within, undecided = STARTS[scene][1], 0
    if isinstance(way, int):
        found = LIBRARIES[scene].many(starts, way, PERIODS)
    else:
        precision = ("as needed", "doubles", "106 bits").index(way)
        found = LIBRARIES[scene].runs(starts, PERIODS, precision=precision)
    if (scene, way) == ("pulsed", "106 bits"):
        within = 2
    for one, run in zip(found, runs, strict=True):
        if way == "doubles" and one.stop == "open":  # doubles alone cannot decide some
            undecided += 1
            continue
        assert one.stop == "done"
        assert isinstance(way, int) or one.fields == run.fields
        assert run.off(one.state[:3]) < within
    assert undecided < 0.02 * len(starts)


def damped(form: Form) -> list[Start]:
    return [s for s in random_starts(form, 200, 7) if s.parameters["zeta"] > 0]


def soft(form: Form) -> list[Start]:
    """Contacts of stiffness 900 enlarge rounding too much for differences."""
    return [s for s in random_starts(form, 150) if s.parameters["beta"] < 100]


def near_stops(form: Form) -> list[Start]:
    r, found = random.Random(5), list[Start]()
    for _ in range(60):
        drawn = (r.uniform(1, 2.5), r.uniform(0.6, 1.6), r.uniform(0.1, 0.6), r.uniform(0.1, 0.6))
        rest = (r.choice([0.05, 0.2]), r.uniform(1, 8), r.uniform(1, 8), r.uniform(0.5, 4), 0.5)
        names = ("alpha", "omega", "delta_1", "delta_2", "zeta", "beta_1", "beta_2", "gamma", "f_b")
        found.append(Start(dict(zip(names, (*drawn, *rest), strict=True)), (0.1, 0.0, 0.0)))
    return found


COMPARED: dict[str, tuple[Callable[[Form], list[Start]], Within, int]] = {
    "pulsed": (damped, Within(2.0**-16, 1e-9, 1e-7), 15),
    "two_stops": (near_stops, Within(1e-4, 1e-8, 1e-6), 10),
    "biased": (soft, Within(), 10),
    "reaction": (soft, Within(2.0**-12), 10),
}
"""Starts of orbits, what differences leave of their slopes, and the least number compared."""


@pytest.mark.parametrize("scene", COMPARED, indirect=True)
def test_orbits_and_what_they_depend_on_are_those_of_the_integrator(scene, judge) -> None:
    """Derivatives by share, levels and frequency are among them."""
    starts, within, least = COMPARED[scene]
    made = LIBRARIES[scene]
    assert compared(made, judge, starts(made.form), long=True, within=within) >= least
    if scene == "biased":  # also of motions of two periods
        assert compared(made, judge, gentle_starts(60), 2) >= 2
