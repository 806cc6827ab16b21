"""Fits to synthetic measurements, whose truth is known."""

import math
from dataclasses import replace

import numpy as np
import pandas
import pytest
from scipy.stats import binom

from capsule_sym import (
    InvalidInput,
    Parameters,
    PhysicalParameters,
    fit,
    scenes,
    sensitivities,
    simulate,
)
from capsule_sym._design import misfit as misfit_module
from capsule_sym._design.least_squares import least
from capsule_sym._design.measured import measured
from capsule_sym._design.misfit import Misfit, drawn, limits_of
from capsule_sym._orbits.quantities import dimensionless_slopes, varied
from capsule_sym._parameters import names_of
from capsule_sym._systems import values_of
from capsule_sym.inputs import read_measured
from capsule_sym.results import Status
from tests.design.clock import LIMIT, Clock
from tests.sampling import many, sampled

TRUE = Parameters(alpha=0.83, delta=0.03, zeta=0.06, beta=1.7, gamma=3.3)
START, PHASE = (0.1, 0.2, 0.3), 0.4
DEVICE_TRUE = PhysicalParameters(
    M_m=0.02, M_c=0.066, k1=40.0, k2=60.0, c=0.1, G=2e-4, P_d=0.2, Omega=45.0, mu=0.25
)


def series(parameters=TRUE, count=400, noise=0.0, seed=0, names=("x_m", "x_c"), periods=8):
    """Measurements at irregular times from the start on."""
    draw = np.random.default_rng(seed)
    times = np.concatenate(
        [[PHASE], PHASE + np.sort(draw.uniform(0, 1, count - 1)) * periods * parameters.period]
    )
    x_r, v_r, v_c, x_c = simulate(parameters, START, PHASE, periods + 1)(times, position=True).T
    of = {"x_r": x_r, "v_r": v_r, "v_c": v_c, "x_c": x_c, "x_m": x_r + x_c, "v_m": v_r + v_c}
    return {"t": times} | {name: of[name] + noise * draw.normal(size=count) for name in names}


def physical(device=DEVICE_TRUE, **options):
    """The same in SI units, with the start there."""
    p, data = device.dimensionless(), None
    data = series(p, **options)
    for name in data:
        scale = device.scale("duration") if name == "t" else device.scale("x_r")
        data[name] = data[name] * (device.scale("velocity") if name.startswith("v") else scale)
    units = (device.scale(name) for name in ("x_r", "v_r", "v_c"))
    state = tuple(unit * value for unit, value in zip(units, START, strict=True))
    return data, state, device.scale("duration") * PHASE


def problem_of(data, system, unknown, state, phase):
    given = dict(zip(("x_r", "v_r", "v_c"), state, strict=True)) | {"phase": phase}
    return Misfit(measured(data), system, unknown, given)


def test_units_change_as_differences_say() -> None:
    for device in (DEVICE_TRUE, replace(DEVICE_TRUE, c=0.0, G=0.0, k2=0.0, P_d=0.0)):
        slopes, own = (
            dimensionless_slopes(device),
            varied(device.scene, values_of(device), names_of(device)),
        )
        length, rate = own.length_scale, own.natural_frequency
        for column, name in enumerate(names_of(device)):
            value = getattr(device, name)
            step = 1e-6 * (value or 1.0)
            up, down = (
                replace(device, **{name: value + s}) for s in (step, 0.0 if not value else -step)
            )
            width = step * (2 if value else 1)
            pairs = zip(
                up.dimensionless().to_dict().values(),
                down.dimensionless().to_dict().values(),
                strict=True,
            )
            change = np.array([(a - b) / width for a, b in pairs])
            assert slopes[:, column] == pytest.approx(change, rel=1e-8, abs=1e-9)
            lengths = math.log(up.length_scale / down.length_scale) / width
            assert length.slope[column] / length.value == pytest.approx(lengths, rel=1e-8, abs=1e-9)
            rates = math.log(up.natural_frequency / down.natural_frequency) / width
            assert rate.slope[column] / rate.value == pytest.approx(rates, rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("si", [False, True])
def test_the_jacobian_is_that_of_the_residuals(si) -> None:
    if si:
        data, state, phase = physical(names=("x_m", "v_c"))
        system = replace(DEVICE_TRUE, mu=0.26)
        names = "M_m M_c k1 k2 c G P_d Omega mu x_r v_r v_c phase x_c"
    else:
        data, state, phase, system = (
            series(names=("x_r", "v_m")),
            START,
            30.0,
            TRUE.replace(alpha=0.8),
        )
        names = "alpha omega delta zeta beta gamma f_b x_r v_r v_c phase x_c"
    unknown = tuple(names.split())
    for name in data:
        data[name][0] = data[name][0] if name == "t" else math.nan
    problem = problem_of(data, system, unknown, state, phase)
    at = problem.guess
    jacobian = problem.jacobian(at)
    for k, name in enumerate(unknown):
        step = np.zeros(len(at))
        step[k] = 1e-7 * (abs(at[k]) or 1e-3)
        change = (problem.residuals(at + step) - problem.residuals(at - step)) / (2 * step[k])
        assert jacobian[:, k] == pytest.approx(change, abs=2e-6 * np.abs(change).max()), name


def test_without_noise_the_truth_is_found() -> None:
    found = fit(
        series(),
        TRUE.replace(alpha=0.8, delta=0.05, beta=1.5),
        ("alpha", "delta", "beta", "x_r", "v_r", "phase"),
        state=(0.12, 0.15, 0.3),
        phase=0.45,
    )
    assert found.success
    truth = {"alpha": 0.83, "delta": 0.03, "beta": 1.7, "x_r": 0.1, "v_r": 0.2, "phase": 0.4}
    assert found.values == pytest.approx(truth, abs=1e-9)
    assert found.system == Parameters(
        **TRUE.to_dict() | {k: found.values[k] for k in ("alpha", "delta", "beta")}
    )
    assert found.noise < 1e-9


def test_a_device_is_fitted_in_si_units() -> None:
    data, state, phase = physical(noise=1e-3)
    guess = replace(DEVICE_TRUE, mu=0.27, c=0.12)
    found = fit(data, guess, ("mu", "c", "G"), state=state, phase=phase)
    assert found.success
    for name, value in found.values.items():
        assert abs(value - getattr(DEVICE_TRUE, name)) < 4 * found.standard_errors[name]


@sampled
def test_standard_errors_hold() -> None:
    """Of many fits, as many as should lie within three standard deviations."""
    sets, inside = many(200, 8), 0
    unknown = ("alpha", "delta", "zeta", "beta")
    for seed in range(sets):
        found = fit(
            series(noise=2e-3, seed=seed),
            TRUE.replace(alpha=0.85),
            unknown,
            state=START,
            phase=PHASE,
        )
        inside += all(
            abs(found.values[name] - getattr(TRUE, name)) < 3 * found.standard_errors[name]
            for name in unknown
        )
    # 0.9892 by theory for four; fewer than this happen once in a million.
    assert inside >= binom.ppf(1e-6, sets, 0.9892)


def test_outliers_are_told_by_a_robust_loss() -> None:
    data = series(noise=1e-3)
    data["x_c"][::17] += 0.5
    unknown = ("alpha", "beta")
    plain, robust = (
        fit(data, TRUE.replace(alpha=0.85), unknown, state=START, phase=PHASE, loss=loss)
        for loss in ("linear", "cauchy")
    )
    assert abs(robust.values["alpha"] - 0.83) < 0.1 * abs(plain.values["alpha"] - 0.83)
    assert abs(robust.values["alpha"] - 0.83) < 4 * robust.standard_errors["alpha"]


def test_a_robust_loss_accepts_a_guess_without_residuals() -> None:
    found = fit(series(count=60), TRUE, ("alpha", "zeta"), state=START, phase=PHASE, loss="cauchy")
    assert found.status == "converged"
    assert found.noise < 1e-12


def test_errors_of_a_robust_loss_are_those_of_huber() -> None:
    """Robust Statistics (1981), section 7.6, with Cauchy's influence r/(1 + r^2)."""
    data = series(noise=0.01, count=30, names=("x_m",))
    data["x_m"][::6] += 0.3
    problem = problem_of(data, TRUE, ("alpha", "zeta"), START, PHASE)
    found = least(problem, problem.guess, limits_of(problem, {}), "cauchy", 200)
    residuals, jacobian = problem.residuals(found.x), problem.jacobian(found.x)
    r, n, p = residuals / found.scale, 30, 2
    influence, slope = r / (1 + r**2), (1 - r**2) / (1 + r**2) ** 2
    factor = 1 + p / n * slope.var() / slope.mean() ** 2
    size = factor**2 * (influence @ influence) / (n - p) / slope.mean() ** 2
    expected = found.scale**2 * size * np.linalg.inv(jacobian.T @ jacobian)
    whole = fit(data, TRUE, ("alpha", "zeta"), state=START, phase=PHASE, loss="cauchy")
    assert whole.covariance == pytest.approx(expected, rel=1e-6)


def test_a_far_guess_is_found_by_many_starts() -> None:
    guess = TRUE.replace(alpha=1.6, beta=6.0, delta=0.2)
    starts = np.int64(64)
    found = fit(
        series(), guess, ("alpha", "beta", "delta"), state=START, phase=PHASE, starts=starts
    )
    assert found.success
    assert found.values == pytest.approx({"alpha": 0.83, "beta": 1.7, "delta": 0.03}, abs=1e-8)


def test_guesses_fill_their_bounds_or_half_to_twice_a_guess_or_a_period() -> None:
    problem = problem_of(series(count=60), TRUE, ("alpha", "omega", "phase"), START, PHASE)
    limits = limits_of(problem, {"omega": (0.5, 1.5)})
    found = np.array(drawn(problem, limits, 256, 0))
    low, high = np.array([(0.415, 1.66), (0.5, 1.5), (0.0, TRUE.period)]).T
    share = (found - low) / (high - low)
    assert share.shape == (256, 3)
    assert np.all((share >= 0) & (share <= 1))
    assert share.mean(axis=0) == pytest.approx(0.5, abs=0.01)
    assert np.ptp(share, axis=0) == pytest.approx(1.0, abs=0.02)


def test_few_steps_leave_a_fit_short_of_its_minimum() -> None:
    guess = TRUE.replace(alpha=0.85)
    options = {"state": START, "phase": PHASE}
    assert fit(series(), guess, ("alpha",), **options).success
    short = fit(series(), guess, ("alpha",), steps=1, **options)
    assert not short.success
    assert short.status is Status.NOT_CONVERGED


def test_what_measurements_cannot_tell_is_named() -> None:
    # The capsule rests: its mass and friction have no effect.
    p = Parameters(alpha=0.01, delta=2.0)
    times = np.linspace(0, 60, 200)
    data = {"t": times, "x_r": simulate(p, (0.1, 0.0, 0.0), 0.0, 12)(times)[:, 0]}
    found = fit(data, p, ("alpha", "gamma"), state=(0.1, 0.0, 0.0))
    assert found.status == "not-identifiable"
    assert not found.success
    assert math.isinf(found.standard_errors["gamma"])
    assert found.standard_errors["alpha"] < 1e-6
    (lost,) = found.open_combinations
    assert abs(lost["gamma"]) == pytest.approx(1.0)
    alone = fit(data, p, ("gamma",), state=(0.1, 0.0, 0.0))
    assert (alone.status, alone.standard_errors) == ("not-identifiable", {"gamma": math.inf})
    assert [{"gamma": abs(one["gamma"])} for one in alone.open_combinations] == [{"gamma": 1.0}]


def times_1000(*names):
    return lambda data: data | {name: 1000 * data[name] for name in names}


def noise_alone(data):
    return {"t": data["t"], "x_m": np.random.default_rng(1).normal(size=len(data["t"]))}


@pytest.mark.parametrize(
    ("spoil", "poor"),
    [
        (times_1000("x_m", "x_c"), {"x_m", "x_c"}),
        (times_1000("x_c"), {"x_c"}),
        (lambda data: data | {"x_m": data["x_c"], "x_c": data["x_m"]}, {"x_m", "x_c"}),
        (noise_alone, {"x_m"}),
    ],
)
def test_a_fit_that_explains_nothing_says_so_by_column(spoil, poor) -> None:
    data = spoil(series(count=60, noise=2e-3))
    found = fit(data, TRUE.replace(alpha=0.85), ("alpha", "zeta"), state=START, phase=PHASE)
    assert (found.status, found.success) == ("unexplained", False)
    assert {name for name, by in found.noise_by_column.items() if by >= 0.5} >= poor
    assert all(f"of the spread of {name}" in found.message for name in poor)
    assert "starts" in found.message
    assert "units" in found.message


@pytest.mark.parametrize("omega", [0.4, 0.6, 1.1, 1.7])
def test_a_poor_guess_of_the_frequency_comes_from_the_spectrum(omega) -> None:
    data = series(count=150, noise=2e-3)
    found = fit(data, TRUE.replace(omega=omega), ("omega", "alpha"), state=START, phase=PHASE)
    assert found.status == "converged"
    assert found.values["omega"] == pytest.approx(TRUE.omega, abs=1e-3)


@pytest.mark.parametrize(("guess", "ends"), [(0.9, (0.831, 1.0)), (0.8, (0.7, 0.829))])
def test_an_unknown_at_its_bound_is_a_status(guess, ends) -> None:
    how = {"state": START, "phase": PHASE, "bounds": {"alpha": ends}}
    found = fit(series(count=60), TRUE.replace(alpha=guess), ("alpha",), **how)
    assert (found.status, found.success) == ("at-bound", False)
    assert "alpha at a bound" in found.message


def test_gaps_in_a_file_are_left_out(tmp_path) -> None:
    data = series(count=60)
    lines = ["t, x_m, x_c"]
    for i, (t, x_m, x_c) in enumerate(zip(*data.values(), strict=True)):
        lines.append(
            f"{float(t)!r},{'' if i % 7 == 3 else repr(float(x_m))},"
            f"{'nan' if i % 5 == 2 else repr(float(x_c))}"
        )
    file = tmp_path / "data.csv"
    file.write_text("\n".join(lines))
    read = read_measured(file)
    assert list(read) == ["t", "x_m", "x_c"]
    found = measured(read)
    assert len(found.values) == 120 - len(range(3, 60, 7)) - len(range(2, 60, 5))
    assert fit(read, TRUE.replace(alpha=0.8), ("alpha",), state=START, phase=PHASE).values[
        "alpha"
    ] == pytest.approx(0.83, abs=1e-9)


def masked(values, mask):
    return np.ma.array(np.where(mask, 9.0, values), mask=mask)


def with_na(values, mask):
    return pandas.Series([pandas.NA if gap else v for v, gap in zip(values, mask, strict=True)])


@pytest.mark.parametrize("spoilt", [masked, with_na])
def test_what_is_masked_or_missing_is_left_out(spoilt) -> None:
    data = series(count=60)
    gaps = np.arange(60) % 4 == 0  # at the start, too: the motion begins there all the same
    for name in ("x_m", "x_c"):
        data[name] = spoilt(data[name], gaps)
    found = fit(data, TRUE.replace(alpha=0.8), ("alpha",), state=START, phase=PHASE)
    assert found.values["alpha"] == pytest.approx(0.83, abs=1e-9)
    data["t"] = spoilt(data["t"], gaps)
    with pytest.raises(InvalidInput, match="t in row 1"):
        measured(data)


def test_a_column_that_stands_twice_is_refused(tmp_path) -> None:
    file, data = tmp_path / "data.csv", series(count=60)
    file.write_text("\ufefft,x_r, x_r\n0,1,2\n", encoding="utf-8")
    with pytest.raises(InvalidInput, match="column = 'x_r': must be there once"):
        read_measured(file)
    frame = pandas.DataFrame({**data, "x_r": data["x_c"]}).rename(columns={"x_r": "x_m"})
    with pytest.raises(InvalidInput, match="column = 'x_m': must be there once"):
        measured(frame)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"t": None}, "columns"),
        ({"x_m": np.append(np.arange(59.0), np.inf)}, "x_m in row 60 = inf"),
        ({"x_m": None, "x_c": None}, "columns"),
        ({"y": np.zeros(60)}, "column = "),
        ({"x_m": np.zeros(60)}, "constant"),
        ({"x_m": np.full(60, np.nan)}, "empty"),
        ({"x_m": 1e60 * np.arange(60.0)}, "x_m = 5.9e.61: must be at most"),
        ({"x_m": 1e-60 * np.arange(60.0)}, "x_m = 5.9e-59: must be at most"),
        ({"x_m": np.zeros(59)}, "x_m"),
        ({"t": np.zeros(60)}, "t in row 2"),
        ({"t": np.full(60, np.nan)}, "t in row 1 = nan"),
        ({"t": np.zeros((60, 2))}, "t = "),
        ({"x_m": ["a"] * 60}, "x_m"),
    ],
)
def test_bad_columns_are_named(change, named) -> None:
    data = {k: v for k, v in (series(count=60) | change).items() if v is not None}
    with pytest.raises(InvalidInput, match=named):
        measured(data)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"unknown": ("mass",)}, "unknown"),
        ({"unknown": ()}, "unknown"),
        ({"unknown": ("alpha", "alpha")}, "unknown"),
        ({"unknown": ("mu",)}, "unknown"),
        ({"loss": "median"}, "loss"),
        ({"starts": -1}, "starts"),
        ({"follow": 0}, "follow"),
        ({"seed": -1}, "seed"),
        ({"steps": 0}, "steps"),
        ({"bounds": {"beta": (0, 1)}}, "bounds"),
        ({"bounds": {"alpha": (1, 0)}}, "bounds of alpha"),
        ({"bounds": {"alpha": (-1, 2)}}, "bounds of alpha"),
        ({"bounds": {"alpha": (0.1, 0.2)}}, "alpha"),
        ({"state": (0, 0)}, "state"),
        ({"state": (math.nan, 0, 0)}, "state"),
        ({"phase": math.inf}, "phase"),
    ],
)
def test_bad_requests_are_named(options, named) -> None:
    with pytest.raises(InvalidInput, match=named):
        fit(
            series(count=60),
            TRUE,
            **{"unknown": ("alpha",), "state": START, "phase": PHASE} | options,
        )


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("t,x_m\n\n0,1\n1,2\n1,3\n", "t in row 5 = 1.0"),
        ("t,x_m\n\n0,1\n1,inf\n", "x_m in row 4 = inf"),
        ("t,x_m\n0,1,2\n", "row 2"),
        ("t,x_m\n0,one\n", "x_m in row 2"),
        ("", "columns"),
    ],
)
def test_bad_files_are_named(tmp_path, text, named) -> None:
    file = tmp_path / "data.csv"
    file.write_text(text)
    with pytest.raises(InvalidInput, match=named):
        measured(read_measured(file))
    with pytest.raises(InvalidInput, match="file"):
        read_measured(tmp_path / "absent.csv")


@pytest.mark.parametrize(("run", "loss"), [(1, "linear"), (7, "linear"), (15, "cauchy")])
def test_a_fit_that_is_out_of_time_has_the_best_that_was_tried(monkeypatch, run, loss) -> None:
    data, guess = series(count=60, noise=1e-3), TRUE.replace(alpha=0.9, beta=1.2)
    how = {"state": START, "phase": PHASE, "loss": loss}
    assert fit(data, guess, ("alpha", "beta"), **how).success
    clock = Clock(monkeypatch, rf", {run} runs?\b")
    limited = {"max_seconds": LIMIT, "progress": clock.progress}
    found = fit(data, guess, ("alpha", "beta"), **limited, **how)
    assert (found.status, found.success) == ("time-limit", False)
    problem = problem_of(data, guess, ("alpha", "beta"), START, PHASE)
    values = np.array(list(found.values.values()))
    assert np.array_equal(problem.residuals(values), found.residuals)
    if run > 1:
        assert np.sum(found.residuals**2) < np.sum(problem.residuals(problem.guess) ** 2)
    else:
        assert values.tolist() == [0.9, 1.2]


def test_the_time_in_which_guesses_are_drawn_counts(monkeypatch) -> None:
    clock, drawn = Clock(monkeypatch, "drawn"), misfit_module.drawn

    def slowly(*arguments):
        clock.progress("drawn")
        return drawn(*arguments)

    monkeypatch.setattr(misfit_module, "drawn", slowly)
    limited = {"max_seconds": LIMIT, "starts": 8}
    found = fit(series(count=60), TRUE, ("alpha",), state=START, phase=PHASE, **limited)
    assert found.status == "time-limit"


def test_derivatives_are_taken_at_steps_alone(monkeypatch) -> None:
    rows = []

    def counted(run, times):
        rows.append(len(times))
        return sensitivities(run, times)

    monkeypatch.setattr("capsule_sym._design.misfit.sensitivities", counted)
    told = []
    how = {"state": START, "phase": PHASE, "starts": 8, "progress": told.append}
    data = series(count=250, noise=1e-3)
    found = fit(data, TRUE.replace(alpha=0.85), ("alpha", "beta"), follow=1, **how)
    assert found.success
    assert told[0] == "guess 1 of 9, 1 run"
    assert set(rows) == {250}
    assert len(rows) <= (found.evaluations - 9) / 2 + 1


def test_derivatives_that_do_not_exist_are_not_given_to_lapack(capfd, monkeypatch) -> None:
    def after_grazing(run, times):
        found = sensitivities(run, times)
        found.slopes[times > 40.0] = np.inf
        return found

    monkeypatch.setattr("capsule_sym._design.misfit.sensitivities", after_grazing)
    how = {"state": START, "phase": PHASE}
    found = fit(series(count=60), TRUE.replace(alpha=0.85), ("alpha",), **how)
    assert found.values["alpha"] == pytest.approx(0.83, abs=1e-6)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("phase", [-1, math.nan, 100.0])
def test_a_phase_outside_the_period_is_refused(phase: float) -> None:
    data = {"t": np.arange(9.0), "x_r": np.zeros(9)}
    with pytest.raises(InvalidInput, match="phase"):
        fit(data, Parameters(), ["alpha"], phase=phase)


def test_values_that_are_no_system_count_as_a_lost_motion() -> None:
    """Pulses of a share of 1e-10 of the period are none: the least that is allowed is 1e-9."""
    system = scenes.reaction_pulse.Parameters(D=0.3)
    data = {"t": [0.0, 1.0, 2.0], "x_r": [0.0, 0.1, 0.2]}
    problem = problem_of(data, system, ("D",), (0.0, 0.0, 0.0), 0.0)
    assert (problem.residuals(np.array([1e-10])) == misfit_module.LOST).all()
    assert (abs(problem.residuals(np.array([0.3]))) < misfit_module.LOST).all()
