"""Pulses that switch between attractors, beside runs of the map and quadrature."""

import csv
import json
import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad

import capsule_sym as cs
from capsule_sym._attractors.pulse import PulseWindow
from capsule_sym._attractors.pulses import PulseSearch
from capsule_sym._cli import main
from capsule_sym._native import Watch
from capsule_sym._orbits.metrics.performance import drive_force, drive_work
from capsule_sym.inputs import SceneParameters
from capsule_sym.results import Orbit, Pulse, Status
from tests.design.clock import LIMIT, Clock

# Two motions of about the same speed, backward and forward.
BOTH_WAYS = cs.Parameters(alpha=2.5, omega=0.41, delta=0.41, zeta=0.025, beta=12.0, gamma=2.2)
BACK, FORTH = (0.5, -0.9, -0.9), (0.4, 0.9, 0.1)
# From the second motion no pulse of fewer than four periods leads to the first.
LONG = cs.Parameters(alpha=0.85, omega=0.746, delta=0.375, zeta=0.035, beta=15.0, gamma=5.9)
LONG_STARTS = (0.5, -0.9, -0.9), (0.8, -0.4, -0.7)
# Motions of two periods, forward and backward.
DOUBLE = cs.Parameters(alpha=2.8, omega=1.146, delta=0.437, zeta=0.02, beta=24.0, gamma=4.8)
DOUBLE_STARTS = (-1.9, 1.3, 0.8), (0.5, -0.9, -0.9)
SETTLED = 300  # excitation periods after which the runs of these tests are at rest on an orbit


def motions(parameters: SceneParameters, *starts: tuple[float, float, float]) -> list[Orbit]:
    """The motions that starts settle on."""
    return [cs.solve_orbit(parameters, start) for start in starts]


def cycle(parameters: SceneParameters, start: tuple[float, ...], length: int) -> np.ndarray:
    """The states at phase 0 of the motion that a run from a start settles on."""
    run = cs.simulate(parameters, start, periods=SETTLED + length - 1, keep="stroboscopic")
    return np.array(run.stroboscopic[-length:])


def leads(
    system: SceneParameters,
    marks: np.ndarray,
    state: np.ndarray,
    name: str,
    values: np.ndarray,
    periods: int,
) -> np.ndarray:
    """Mask of pulses from a state that end on the motion with these states, by runs alone."""
    pulsed = [system.replace(**{name: value}) for value in values.tolist()]
    after = cs.simulate_many(pulsed, state, periods=periods).states
    ends = cs.simulate_many([system] * len(values), after, periods=SETTLED).states
    return abs(ends[:, None] - marks).max(axis=2).min(axis=1) < 1e-6


@pytest.fixture(scope="module")
def reversal() -> Pulse:
    """From backward to forward, the shortest pulse."""
    return cs.switch_by_pulse(*motions(BOTH_WAYS, BACK, FORTH))


class Line(PulseSearch):
    """Attractors by the value of a pulse: 1 in some ranges, 0 below 0.6, 2 above."""

    def __init__(self, *ranges):
        self.ranges = ranges

    def reached(self, window, values):
        leads = [any(low <= one <= high for low, high in self.ranges) for one in values]
        return np.where(leads, 1, np.where(values < 0.6, 0, 2)).astype(np.int16)

    def intervals(self, count):
        return [(one.low, one.high) for one in self.parts(PulseWindow(1, 0, 0.0, 1.0), count)]


def test_intervals_are_those_of_the_line_also_narrow_ones_between_two_basins():
    line = Line((0.33, 0.53), (0.6, 0.60001), (0.8, 0.9))
    assert np.array(line.intervals(40)) == pytest.approx(
        np.array([(0.33, 0.53), (0.6, 0.60001), (0.8, 0.9)]), abs=2e-9
    )
    few = Line((0.6, 0.60001)).intervals(3)
    assert few == [] or few[0][1] - few[0][0] <= 1e-5
    assert Line((2.0, 3.0)).intervals(9) == []


@pytest.mark.parametrize(
    ("ranges", "best"),
    [
        (((0.1, 0.49), (0.51, 0.95)), (0.51, 0.95)),  # a gap that the first values miss
        (((0.47, 0.49),), (0.47, 0.49)),  # an interval that four times as many values meet
    ],
)
def test_the_widest_interval_is_the_one_that_has_no_finer_gap(ranges, best) -> None:
    search, told = Line(*ranges), list[str]()
    search.known = SimpleNamespace(cycles=[[SimpleNamespace(states=np.zeros((1, 3)))]])
    search.name, search.windows, search.best = "alpha", [], None
    search.run((0.0, 1.0), 3, 12, told.append)
    assert search.status is Status.FOUND
    assert (search.best.low, search.best.high) == pytest.approx(best, abs=2e-9)
    assert [(one.low, one.high) for one in search.windows] == [
        pytest.approx(one, abs=2e-9) for one in ranges
    ]
    assert told == ["pulses of 1 of 3 periods"]


def test_a_pulse_reverses_the_direction_as_the_map_itself_does(reversal) -> None:
    assert reversal.success
    assert (
        float(reversal.start.average_velocity) < -0.1 < 0.1 < float(reversal.end.average_velocity)
    )
    low, high = reversal.interval
    assert reversal.value == pytest.approx((low + high) / 2)
    marks, state = cycle(BOTH_WAYS, FORTH, 1), cycle(BOTH_WAYS, BACK, 1)[0]
    assert reversal.state == pytest.approx(state, abs=1e-9)
    beside = np.array([low - 1e-6, low + 1e-6, reversal.value, high - 1e-6, high + 1e-6])
    found = leads(BOTH_WAYS, marks, state, "alpha", beside, reversal.periods)
    assert found.tolist() == [False, True, True, True, False]


def test_the_frequency_may_be_what_changes() -> None:
    found = cs.switch_by_pulse(*motions(BOTH_WAYS, FORTH, BACK), {"omega": (0.3, 0.6)})
    marks, state = cycle(BOTH_WAYS, BACK, 1), cycle(BOTH_WAYS, FORTH, 1)[0]
    low, high = found.interval
    values = np.array([low + 1e-7, found.value, high - 1e-7])
    assert leads(BOTH_WAYS, marks, state, "omega", values, found.periods).all()
    assert found.duration == pytest.approx(found.periods * math.tau / found.value)


@pytest.mark.parametrize(
    ("scene", "given", "starts"),
    [
        (
            "slope",
            dict(alpha=2.17, omega=0.478, zeta=0.031, beta=14.7, gamma=3.41, s=0.09),
            ((0.5, -0.9, -0.9), (1.2, -1.1, -0.9)),
        ),
        (
            "reaction",
            dict(alpha=2.55, omega=1.004, delta=0.31, zeta=0.043, beta=20.1, gamma=1.46),
            ((1.7, 1.3, -1.0), (0.5, -0.9, -0.9)),
        ),
        (
            "reaction_pulse",
            dict(alpha=2.93, D=0.42, omega=0.677, delta=0.54, zeta=0.053, beta=15.2, gamma=4.0),
            ((2.7, -1.1, -0.3), (0.1, 2.7, -1.4)),
        ),
        (
            "prototype",
            {"alpha": 1.77, "D": 0.47, "omega": 1.075, "delta_1": 0.13, "delta_2": 0.27}
            | {"zeta": 0.057, "beta_1": 10.6, "beta_2": 8.1, "gamma": 1.07, "s": 0.08},
            ((0.1, 2.7, -1.4), (-1.5, 1.6, -1.2)),
        ),
    ],
)
def test_pulses_switch_in_other_scenes(scene, given, starts) -> None:
    system = getattr(cs.scenes, scene).Parameters(**given)
    found = cs.switch_by_pulse(*motions(system, *starts))
    assert found.success
    marks = cycle(system, starts[1], found.end.itinerary.period_number)
    values, name = np.array([found.value, *found.interval]), found.parameter
    assert leads(system, marks, np.array(found.state), name, values, found.periods)[0]


@pytest.mark.long
def test_no_shorter_pulse_is_found_by_trying_all() -> None:
    found = cs.switch_by_pulse(*motions(LONG, *LONG_STARTS))
    marks, state = cycle(LONG, LONG_STARTS[1], 1), cycle(LONG, LONG_STARTS[0], 1)[0]
    values = np.linspace(0, 2 * LONG.alpha, 1001)
    shorter = [leads(LONG, marks, state, "alpha", values, n) for n in range(1, found.periods)]
    assert found.periods == 4
    assert not np.any(shorter)
    assert found.interval[1] - found.interval[0] < 0.003  # less than between two first values
    assert leads(LONG, marks, state, "alpha", np.array([found.value]), 4).all()


@pytest.mark.long
def test_of_a_motion_of_two_periods_the_pulse_begins_at_the_better_one() -> None:
    found = cs.switch_by_pulse(*motions(DOUBLE, *DOUBLE_STARTS))
    marks = cycle(DOUBLE, DOUBLE_STARTS[1], 2)
    widths = [0.0, 0.0]
    values = np.linspace(0, 2 * DOUBLE.alpha, 201)
    for begins in (0, 1):
        # The pulse begins at `found.state`, or a period later.
        state = found.state
        if begins:
            state = cs.simulate(DOUBLE, found.state, periods=1, keep="final").final[1]
        good = leads(DOUBLE, marks, np.array(state), "alpha", values, found.periods)
        runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], good, [0]]).astype(int))))[::2]
        widths[begins] = runs.max(initial=0) * values[1]
    low, high = found.interval
    assert high - low == pytest.approx(widths[0], abs=2 * values[1])
    assert widths[0] > widths[1]


@pytest.mark.parametrize("scene", ["capsule", "reaction", "prototype"])
def test_work_and_force_of_the_drive_are_those_of_a_quadrature(scene) -> None:
    system = getattr(cs.scenes, scene).Parameters(alpha=1.3)
    run = cs.simulate(system, (0.2, 0.1, 0.0), 0.3, periods=3)
    ends = run.span[0] + np.cumsum([0.0, *run.records["duration"]])

    def force(time: float) -> float:
        if not system.scene.facts.PULSED:
            return system.alpha * math.cos(system.omega * time)
        return system.alpha if time % system.period < system.D * system.period else system.alpha_low

    def power(time: float) -> float:
        _, v_r, v_c = run(time)
        return force(time) * (v_r if system.scene.facts.REACTS else v_r + v_c)

    parts = [quad(power, a, b, epsabs=1e-13)[0] for a, b in pairwise(ends)]
    assert drive_work(run) == pytest.approx(sum(parts), abs=1e-11)
    times = np.linspace(*run.span, 50)[1:-1]
    assert drive_force(run, times) == pytest.approx([force(time) for time in times], abs=1e-12)


def test_where_no_pulse_leads_that_is_said() -> None:
    found = cs.switch_by_pulse(
        *motions(LONG, *LONG_STARTS), {"alpha": (0.8, 0.9)}, most_periods=2, values=50
    )
    assert found.status is Status.NO_PULSE
    assert "at most 2 periods with alpha from 0.8 to 0.9" in found.message
    assert math.isnan(found.value)
    with pytest.raises(cs.InvalidInput, match="pulse = <Pulse: no-pulse>: must be a result with"):
        _ = found.runs
    record = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert (record["value"], record["interval"], record["state"]) == (None, 2 * [None], 3 * [None])


def test_a_search_that_is_out_of_time_says_so(monkeypatch) -> None:
    ends = motions(LONG, *LONG_STARTS)
    clock = Clock(monkeypatch, "pulses of 2")
    found = cs.switch_by_pulse(*ends, max_seconds=LIMIT, progress=clock.progress)
    assert (found.status, found.success, found.periods) == ("time-limit", False, 0)
    assert (found.windows, found.columns["time"].size) == ((), 0)


def test_an_interrupted_search_keeps_the_pulse_it_has(monkeypatch) -> None:
    parts, asked = PulseSearch.parts, []

    def interrupt(*given):
        asked.append(given)
        if len(asked) == 2:  # the first window is to be confirmed
            monkeypatch.setattr(Watch, "interrupted", True)
        return parts(*given)

    monkeypatch.setattr(PulseSearch, "parts", interrupt)
    ends = motions(BOTH_WAYS, BACK, FORTH)
    found = cs.switch_by_pulse(*ends, most_periods=2, values=200, max_seconds=1e6)
    assert (found.status, found.success, found.periods) == ("time-limit", False, 1)
    monkeypatch.undo()
    run = cs.simulate(found.drives[1], found.state, periods=found.periods)
    assert found.work == pytest.approx(drive_work(run), rel=1e-9)


def test_a_device_has_its_pulse_in_its_units(reversal) -> None:
    device = cs.PhysicalParameters(
        M_m=0.5, M_c=1.1, k1=50, k2=600, c=0.25, G=0.0, P_d=1.0, Omega=4.1, mu=0.1
    )
    unit = device.friction_force, device.length_scale, device.natural_frequency
    device = device.replace(P_d=2.5 * unit[0], G=0.41 * unit[1], Omega=0.41 * unit[2])
    same = device.dimensionless()
    assert same.to_dict() == pytest.approx(BOTH_WAYS.to_dict(), rel=1e-9)
    found = cs.switch_by_pulse(*motions(same, BACK, FORTH), base=device)
    assert found.parameter == "P_d"
    assert found.value == pytest.approx(reversal.value * unit[0], rel=1e-6)
    assert found.work == pytest.approx(reversal.work * unit[0] * unit[1], rel=1e-6)
    assert found.duration == pytest.approx(reversal.duration / unit[2], rel=1e-9)
    with pytest.raises(cs.InvalidInput, match=r"device = .*: must be None"):
        found.to_dataframe(device)
    mine, its = found.columns, reversal.columns
    shown = [text.get_text() for text in cs.plot(found).legends[0].get_texts()]
    assert shown[0].startswith("pulse: $P_d$ (N) ")
    for name, scale in (("time", 1 / unit[2]), ("drive", unit[0]), ("x_r", unit[1])):
        early = slice(0, 250)
        assert mine[name][early] == pytest.approx(its[name][early] * scale, abs=1e-4 * scale)


def test_columns_follow_the_motion_through_the_pulse(reversal) -> None:
    columns = reversal.columns
    begin, end, arrived = reversal.times
    during = (columns["time"] >= begin - 1e-9) & (columns["time"] < end - 1e-9)
    assert set(columns["alpha"][during]) == {reversal.value}
    assert set(columns["alpha"][~during]) == {BOTH_WAYS.alpha}
    drive = columns["alpha"] * np.cos(BOTH_WAYS.omega * columns["time"])
    assert columns["drive"] == pytest.approx(drive, abs=1e-9)
    assert columns["x_c"][np.argmin(abs(columns["time"]))] == pytest.approx(0, abs=1e-9)
    assert abs(np.diff(columns["x_c"])).max() < 0.5  # no step where runs meet
    at_end = np.interp(arrived, columns["time"], columns["x_r"])
    assert at_end == pytest.approx(cycle(BOTH_WAYS, FORTH, 1)[0][0], abs=5e-3)
    assert len(reversal.to_dataframe()) == len(columns["time"])
    assert json.loads(json.dumps(reversal.to_dict()))["periods"] == 1


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"most_periods": 0}, "most_periods"),
        ({"over": {"delta": (0.0, 1.0)}}, "over"),
        ({"over": {"alpha": (0.0, 1.0), "omega": (0.3, 0.5)}}, "over"),
        ({"over": {"alpha": (1.0, 0.5)}}, "bounds of alpha"),
        ({"over": {"alpha": (-1.0, 0.5)}}, "alpha"),
        ({"over": {"omega": (0.0, 0.5)}}, "omega"),
        ({"values": 2}, "values"),
        ({"base": cs.Parameters()}, "base"),
        ({"max_seconds": 0}, "max_seconds"),
    ],
)
def test_what_is_not_allowed_is_named(reversal, given, field) -> None:
    with pytest.raises(cs.InvalidInput) as caught:
        cs.switch_by_pulse(reversal.start, reversal.end, **given)
    assert caught.value.field == field


def test_orbits_that_are_one_or_elsewhere_are_refused(reversal) -> None:
    (again,) = motions(BOTH_WAYS, BACK)
    with pytest.raises(cs.InvalidInput, match="another orbit than the start"):
        cs.switch_by_pulse(reversal.start, again)
    (other,) = motions(cs.Parameters(), (0.0, 0.0, 0.0))
    with pytest.raises(cs.InvalidInput, match="at the same parameters"):
        cs.switch_by_pulse(reversal.start, other)
    with pytest.raises(cs.InvalidInput, match="an Orbit, as solve_orbit"):
        cs.switch_by_pulse(reversal.start, None)  # type: ignore[arg-type]


SYSTEM = (
    *("--alpha", "2.5", "--omega", "0.41", "--delta", "0.41"),
    *("--zeta", "0.025", "--beta", "12", "--gamma", "2.2"),
)


@pytest.fixture
def call(capfd, tmp_path, monkeypatch):
    """Runs the command in a folder; gives status, stdout and the lines of stderr."""
    monkeypatch.chdir(tmp_path)

    def run(line: str):
        with pytest.raises(SystemExit) as done:
            main(["pulse", *SYSTEM, *line.split()])
        shown = capfd.readouterr()
        return done.value.code, shown.out, shown.err.splitlines()

    return run


def test_the_command_writes_what_it_finds(call, tmp_path, reversal) -> None:
    line = "--state 0.5 -0.9 -0.9 --to 0.4 0.9 0.1 --json --out found"
    status, out, err = call(line)
    assert status == 0
    assert err == ["wrote found/pulse.json, found/pulse.csv, found/pulse.svg"]
    assert json.loads(out)["interval"] == pytest.approx(reversal.interval)
    rows = list(csv.DictReader((tmp_path / "found/pulse.csv").read_text().splitlines()))
    assert list(rows[0]) == ["time", "alpha", "drive", "x_r", "x_c"]
    assert len(rows) == len(reversal.columns["time"])


@pytest.mark.long
def test_the_command_takes_numbers_of_attractors(call) -> None:
    box = "--x-r -2:2 --v-r -2:2"
    shown = {call(f"{box} --between 0 1")[1], call(f"{box} --between 1 0")[1]}
    assert len(shown) == 2
    assert all("found: the pulse leads to the other attractor" in text for text in shown)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("--to 0.5 -0.9 -0.9 --state 0.5 -0.9 -0.9", "--to = "),
        ("--to 0.4 0.9 0.1 --max-periods 0", "1<=x<=1000"),
        ("--to 0.4 0.9 0.1 --over delta=0:1", "bounds of one of alpha, omega"),
        ("--x-r -2:2 --between 0 9", "--between"),
        ("--between 0 1", "a range of starts"),
        ("", "--to X_R V_R V_C"),
    ],
)
def test_the_command_refuses_in_one_line(call, line, said) -> None:
    status, out, err = call(line)
    assert (status, out) == (2, "")
    assert said in err[-1]
    assert len(err) == 1


def test_a_pulse_that_was_not_found_has_no_picture() -> None:
    none = cs.switch_by_pulse(*motions(LONG, *LONG_STARTS), most_periods=1, values=9)
    with pytest.raises(cs.InvalidInput, match="a pulse that was found"):
        cs.plot(none)
