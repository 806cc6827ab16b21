"""The integrator of the scenes against itself, closed forms, and symmetries of the equations."""

import shutil
from collections.abc import Iterator
from fractions import Fraction

import pytest
from mpmath import mp, mpf

from tests.scenes import SCENES, UNIT, Form, Integrator, Run, Start, integrator, random_starts

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

TINY = 1e-28
TWO_STOPS = Form(stops=2, pulsed=True, reacts=True, biased=True)
"""All terms at once."""

FORMS = {**SCENES, "all terms": TWO_STOPS}


@pytest.fixture(scope="module")
def halved(tmp_path_factory: pytest.TempPathFactory) -> Integrator:
    return integrator(tmp_path_factory.mktemp("halved"), "-DSHORTER=2")


@pytest.fixture(autouse=True)
def digits() -> Iterator[None]:
    with mp.workdps(40):
        yield


def difference(first: Run, second: Run) -> float:
    return max(abs(float(a - b)) for a, b in zip(first.state, second.state, strict=True))


@pytest.mark.parametrize("name", FORMS)
def test_energy_is_balanced_and_halved_steps_change_nothing(name, judge, halved) -> None:
    """Errors are those of 113 bits, enlarged by what the run does to rounding errors."""
    starts = random_starts(FORMS[name], 10)
    events = set()
    for run, again in zip(*(way.runs(FORMS[name], starts) for way in (judge, halved)), strict=True):
        assert run.status == again.status == "done"
        assert run.fields == again.fields
        assert abs(run.energy) < TINY
        assert difference(run, again) < TINY * max(1, *run.unit)
        events |= {segment.event for segment in run.segments}
    ends = {"R", "D"} if FORMS[name].pulsed else {"E"}
    assert events == {"F", "V", "U", "L"} | ends | ({"B"} if FORMS[name].stops == 2 else set())


def started(form: Form, state: tuple[float, float, float], **given: float) -> Start:
    plain = {
        **{"alpha": 0.0, "omega": 1.0, "zeta": 0.0, "gamma": 1.0, "delta": 1.0, "beta": 3.0},
        **{"delta_1": 1.0, "beta_1": 3.0, "delta_2": 1.5, "beta_2": 8.0, "alpha_low": 0.0},
        **{"f_b": 10.0, "s": 0.0, "f_plus": 10.0, "f_minus": 10.0, "D": 0.5, **given},
    }
    return Start({name: plain[name] for name in form.names}, state)


def close(found: Fraction, expected: mpf, tolerance: float = TINY) -> bool:
    return bool(abs(mpf(found.numerator) / found.denominator - expected) < tolerance)


def test_a_resting_capsule_s_mass_is_an_oscillator_between_two_stops(judge: Integrator) -> None:
    """Undamped, from x_r = 0 at speed 2: it meets the front stop at a speed of sqrt(3).

    In contact x_r = 3/4 + cos(2 h)/4 + sin(2 h) sqrt(3)/2. Beyond x_r = -3/2 it turns about -4/3.
    """
    form = Form(stops=2)
    (run,) = judge.runs(form, [started(form, (0.0, 2.0, 0.0), f_b=100.0)], periods=1, most=4)
    assert run.fields == (2, 5, 2, 8)
    free, front, across, back = (segment.duration for segment in run.segments)
    assert close(free, mp.asin(mpf(1) / 2))
    assert close(front, (mp.pi - 2 * mp.atan2(mpf(1) / 4, mp.sqrt(3) / 2)) / 2)
    assert close(across, mp.asin(mpf(1) / 2) + mp.asin(mpf(3) / 4))
    assert close(back, (mp.pi - 2 * mp.atan2(mpf(1) / 6, mp.sqrt(mpf(7) / 4) / 3)) / 3)


def test_a_forced_mass_moves_as_the_closed_form(judge: Integrator) -> None:
    """x_r = alpha (cos(omega tau) - cos(tau)) / (1 - omega^2), undamped, off resonance."""
    form = Form()
    start = started(form, (0.0, 0.0, 0.0), alpha=0.5, omega=0.5, delta=10.0)
    (run,) = judge.runs(form, [start._replace(phase=0.0)], periods=1)
    end = 4 * mp.pi
    assert close(run.state[0], mpf(0.5) * (1 - mp.cos(end)) / mpf(0.75))
    (run,) = judge.runs(form, [start._replace(state=(0.1, 0.0, 0.0), phase=3.0)], periods=1)
    h, x = 4 * mp.pi - 3, mpf(0.1)
    particular = mpf(0.5) / mpf(0.75)
    a, b = x - particular * mp.cos(mpf(1.5)), particular * mpf(0.5) * mp.sin(mpf(1.5))
    assert close(run.state[0], particular + a * mp.cos(h) + b * mp.sin(h))


def test_a_pulse_that_reacts_breaks_rest_at_its_edge(judge: Integrator) -> None:
    """From rest Q = P - u: at the fall to -3, above the bound of 2, the capsule slips forward.

    Before, x_r = (1 - cos tau) / 2; with gamma = 1 the slip begins with v_c' = P + 3 - 2.
    """
    form = Form(reacts=True, pulsed=True)
    start = started(form, (0.0, 0.0, 0.0), alpha=0.5, alpha_low=-3.0, f_b=2.0, D=0.25, delta=9.0)
    (run,) = judge.runs(form, [start], periods=1, most=2)
    assert run.fields == (2, 7)
    assert [segment.event for segment in run.segments[:1]] == ["D"]
    assert close(run.segments[0].duration, mp.pi / 2)
    # Momentum of both bodies: v_r + 2 v_c changes by friction alone, at rate -2.
    h = run.segments[1].duration
    (free,) = judge.runs(form, [start._replace(phase=0.0)], periods=1, most=1)
    v_r = free.state[1]
    whole = run.state[1] + 2 * run.state[2]
    assert abs(float(whole - v_r + 2 * h)) < TINY


def test_what_drives_both_bodies_alone_is_not_felt_with_reaction(judge: Integrator) -> None:
    """In drift with eps = 1 both bodies together feel friction and bias, not the drive."""
    form = Form(reacts=True, biased=True)
    start = started(
        form, (0.0, 0.3, 5.0), alpha=1.5, gamma=3.0, delta=9.0, s=0.25, f_plus=0.5, f_minus=0.5
    )
    (run,) = judge.runs(form, [start], periods=1, most=1)
    (segment,) = run.segments
    whole = run.state[1] + 4 * run.state[2] - Fraction(0.3) - 20
    assert abs(float(whole + Fraction(3, 4) * segment.duration)) < TINY


def test_the_mirror_image_of_a_run_is_the_mirror_s_run(judge: Integrator) -> None:
    """Stops, bounds and levels exchanged, with the signs of drive, bias and state turned."""
    swaps = {"delta_1": "delta_2", "beta_1": "beta_2", "f_plus": "f_minus"}
    swaps |= {two: one for one, two in swaps.items()}
    mirrored = []
    starts = random_starts(TWO_STOPS, 10, seed=5)
    for start in starts:
        p = {swaps.get(name, name): value for name, value in start.parameters.items()}
        p |= {name: -p[name] for name in ("alpha", "alpha_low", "s")}
        mirrored.append(Start(p, tuple(-z for z in start.state), start.phase))
    for run, image in zip(*(judge.runs(TWO_STOPS, s) for s in (starts, mirrored)), strict=True):
        assert run.status == image.status == "done"
        for a, b in zip(run.state, image.state, strict=True):
            assert abs(float(a + b)) < TINY
        events = "".join(segment.event for segment in image.segments)
        other = "".join(segment.event for segment in run.segments)
        assert events == other.translate(str.maketrans("FBUL", "BFLU"))


def test_the_unit_of_a_run_is_what_a_rounded_start_comes_to(judge: Integrator) -> None:
    """It counts every segment's: one rounding of v_r at the start moves the end less."""
    compared = 0
    for form in FORMS.values():
        starts = random_starts(form, 4, seed=11)
        moved = [
            s._replace(state=(s.state[0], s.state[1] * (1 + 1e-10), s.state[2])) for s in starts
        ]
        for run, away in zip(judge.runs(form, starts), judge.runs(form, moved), strict=True):
            if run.fields == away.fields:
                compared += 1
                assert away.off([float(z) for z in run.state]) < 1e-10 / UNIT
    assert compared > 16


def test_a_graze_and_a_corner_are_told_apart_from_switches(judge: Integrator) -> None:
    """x_r = -cos(tau)/2 only touches delta = 1/2; exactly so in doubles, nothing is decided."""
    form = Form()
    (run,) = judge.runs(form, [started(form, (-0.5, 0.0, 0.0), delta=0.5)], periods=1)
    assert run.status in {"undecided", "corner"}
    for gap, fields in ((0.5 - 2**-50, (2, 5, 2)), (0.5 + 2**-50, (2,))):
        (run,) = judge.runs(form, [started(form, (-0.5, 0.0, 0.0), delta=gap)], periods=1)
        assert run.status == "done"
        assert run.fields == fields


def test_a_bias_is_a_shift_of_gaps_and_bounds(judge: Integrator) -> None:
    """With x_r + s for x_r, s is 0: gaps are delta_1 + s and delta_2 - s, bounds f_plus + s, ..."""
    starts = [
        start._replace(parameters={**start.parameters, "s": s, "delta_2": 0.5, "f_minus": 1.0})
        for start in random_starts(TWO_STOPS, 6, seed=6)
        for s in (-0.25, 0.25)
    ]
    shifted = []
    for start in starts:
        p, s = start.parameters, Fraction(start.parameters["s"])
        signs = {"delta_1": s, "delta_2": -s, "f_plus": s, "f_minus": -s, "s": -s}
        new = {name: float(value + signs.get(name, 0)) for name, value in p.items()}
        rounded = any(Fraction(new[k]) - Fraction(p[k]) != v for k, v in signs.items())
        x_r = start.state[0] + float(s)
        if new["delta_1"] < 0 or rounded or Fraction(x_r) - Fraction(start.state[0]) != s:
            continue
        shifted.append((start, Start(new, (x_r, *start.state[1:]), start.phase)))
    assert len(shifted) > 2
    runs = [judge.runs(TWO_STOPS, column) for column in zip(*shifted, strict=True)]
    for (start, _), run, other in zip(shifted, *runs, strict=True):
        assert run.fields == other.fields
        assert abs(float(other.state[0] - run.state[0]) - start.parameters["s"]) < TINY
        assert abs(float(other.state[3] - run.state[3])) < TINY
