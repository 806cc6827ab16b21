"""Fits to synthetic videos, whose truth is known."""

import json
import math
import runpy
import shutil

import numpy as np
import pytest
from scipy.stats import binom

import capsule_sym as cs
from capsule_sym._design.problem import Misfit
from capsule_sym._design.rig import recorded
from capsule_sym.inputs import Rig, RigRun, read_measured, read_rig
from tests.design.rigs import DEVICE, DRIVES, SCALE, SLIP, phase_of, video
from tests.design.test_fit import PHASE, START, TRUE, series
from tests.examples import ROOT

GUESS = DEVICE.replace(mu=0.3, c=0.13, G=3e-4, k2=50.0)
DEVICES = ("mu", "c", "G", "k2", "k1")
START_OF_EACH = ("phase", "x_r", "v_r", "v_c")


def rig(runs=None, unknown=(*DEVICES, "scale", "slip"), each=START_OF_EACH, **options):
    runs = [video(name) for name in DRIVES] if runs is None else runs
    return Rig(runs, unknown, each, **options)


def off(found, truth):
    """Errors of values in standard errors, by name."""
    return {
        name: (found.values[name] - value) / found.standard_errors[name]
        for name, value in truth.items()
    }


def truth_of(*runs):
    phases = {f"{name}.phase": phase_of(name) for name in runs}
    own = {name: getattr(DEVICE, name) for name in DEVICES}
    return own | {"scale": SCALE, "slip": SLIP} | phases


@pytest.mark.long
def test_device_camera_and_clock_are_found_from_videos_with_outliers() -> None:
    found = cs.fit_rig(rig(), GUESS, loss="cauchy")
    assert found.success
    errors = off(found, truth_of(*DRIVES))
    assert max(map(abs, errors.values())) < 4
    # The slip of the clock is identified: without it the model is off.
    assert found.standard_errors["slip"] < SLIP / 50
    assert [one.name for one in found.runs] == list(DRIVES)
    assert found.runs[0].system.P_d == DRIVES["slow"][0]
    assert found.runs[0].series["x_m"][0] == found.values["scale"]
    without = cs.fit_rig(rig(unknown=(*DEVICES, "scale")), GUESS, loss="cauchy")
    assert without.noise > 2 * found.noise
    wrong = [
        abs(without.values[name] - getattr(DEVICE, name)) / found.standard_errors[name]
        for name in DEVICES
    ]
    assert max(wrong) > 5


@pytest.mark.long
def test_errors_of_a_rig_hold() -> None:
    sets, off_by = 40, []
    for seed in range(sets):
        found = cs.fit_rig(rig([video(name, seed) for name in DRIVES]), GUESS, loss="cauchy")
        assert found.success
        off_by.append(list(off(found, truth_of(*DRIVES)).values()))
    held = np.abs(off_by) < 1.96
    # Fewer of one value than this happen once in a million.
    assert held.sum(axis=0).min() >= binom.ppf(1e-6, sets, 0.95)
    assert 0.92 < held.mean() < 0.98


def test_scales_and_drifts_of_each_series_are_found() -> None:
    runs = [video(name, drift=-7.0, scales=(SCALE, 1.01 * SCALE)) for name in DRIVES]
    unknown = (*DEVICES, "scale_x_m", "scale_x_c", "slip")
    found = cs.fit_rig(rig(runs, unknown, (*START_OF_EACH, "drift")), GUESS, loss="cauchy")
    assert found.success
    truth = truth_of(*DRIVES) | {"scale_x_m": SCALE, "scale_x_c": 1.01 * SCALE}
    truth |= {f"{name}.drift_{series}": -7.0 for name in DRIVES for series in ("x_m", "x_c")}
    del truth["scale"]
    assert max(map(abs, off(found, truth).values())) < 4


def test_a_scale_that_a_parameter_could_be_is_named() -> None:
    # Forces and lengths in proportion give the same picture in other pixels.
    runs, guess = [video("slow", seconds=1.0)], DEVICE.replace(mu=0.3, G=3e-4)
    unknown = ("mu", "G", "scale")
    found = cs.fit_rig(rig(runs, unknown, (*START_OF_EACH, "P_d")), guess, loss="cauchy")
    assert found.status == "not-identifiable"
    (lost,) = found.open_combinations
    assert "mu, G, scale, " in found.message
    for name in ("scale", "mu", "G", "slow.P_d"):
        assert math.isinf(found.standard_errors[name])
        assert abs(lost[name]) > 0.1
    known = cs.fit_rig(rig(runs, unknown, START_OF_EACH), guess, loss="cauchy")
    assert known.success


def test_the_jacobian_of_a_rig_is_that_of_its_residuals() -> None:
    runs = [video("slow", seconds=0.5), video("fast", seconds=0.5)]
    runs[1].data["v_m"] = np.gradient(runs[1].data["x_c"], runs[1].data["t"])
    runs[1].data["v_m"][::3] = 0.1
    unknown = ("mu", "k1", "M_m", "scale", "scale_x_c", "slip", "x_r")
    problem = Misfit(
        recorded(rig(runs, unknown, ("phase", "drift", "P_d"), scale=8e3), GUESS), unknown
    )
    at = problem.guess.copy()
    at[problem.unknown.index("slip")] = 0.01
    jacobian = problem.at(at)[1]
    for k, name in enumerate(problem.unknown):
        step = np.zeros(len(at))
        step[k] = 1e-6 * problem.sizes(at)[k]
        change = (problem.residuals(at + step) - problem.residuals(at - step)) / (2 * step[k])
        assert jacobian[:, k] == pytest.approx(change, abs=1e-5 * np.abs(change).max()), name
        assert np.abs(change).max() > 0


def test_runs_without_a_guess_of_their_start_begin_on_the_steady_motion() -> None:
    p = cs.Parameters(alpha=0.83, zeta=0.06)
    run = cs.simulate(p, periods=120)
    times = np.linspace(0.0, 60.0, 300)
    x_r, _, _, x_c = run(100.3 * p.period + times, position=True).T
    data = {"t": times, "x_r": 3.0 * x_r + 5.0, "x_c": 3.0 * x_c}
    one = Rig(
        [RigRun("one", data, {"alpha": 0.83, "omega": p.omega})],
        ("zeta", "scale"),
        START_OF_EACH,
    )
    found = cs.fit_rig(one, p.replace(zeta=0.05))
    assert found.success
    assert found.values["zeta"] == pytest.approx(0.06, abs=1e-8)
    assert found.values["one.phase"] == pytest.approx(0.3 * p.period, abs=1e-7)
    assert found.values["one.offset_x_r"] == pytest.approx(5.0, abs=1e-8)


def noisy(seed, memory, count=250):
    """A series with autoregressive errors, at even times."""
    draw = np.random.default_rng(seed)
    data = series(count=count)
    data["t"] = np.linspace(PHASE, 50.0, count)
    x_r, _, _, x_c = cs.simulate(TRUE, START, PHASE, 9)(data["t"], position=True).T
    for name, x in (("x_m", x_r + x_c), ("x_c", x_c)):
        errors = draw.normal(size=count)
        for i in range(1, count):
            errors[i] += memory * errors[i - 1]
        data[name] = x + 1e-3 * errors
    return data


def test_residuals_tell_how_errors_are_correlated() -> None:
    how = {"state": START, "phase": PHASE}
    white, red = (cs.fit(noisy(3, m), TRUE, ("alpha", "zeta"), **how) for m in (0.0, 0.8))
    assert abs(white.autocorrelation) < 0.15
    assert red.autocorrelation == pytest.approx(0.8, abs=0.12)


def test_intervals_are_of_a_probability() -> None:
    found = cs.fit(noisy(3, 0.0, 9), TRUE, ("alpha", "zeta"), state=START, phase=PHASE)
    # Student's t of 16 degrees of freedom, from a table.
    assert found.deviations() == pytest.approx(2.120, abs=5e-4)
    assert found.deviations(0.99) == pytest.approx(2.921, abs=5e-4)
    ends, wide = found.interval("alpha"), found.interval("alpha", 0.99)
    assert wide[0] < ends[0] < ends[1] < wide[1]
    for level in (0.0, 1.0, math.nan, "95 %"):
        with pytest.raises(cs.InvalidInput, match="level"):
            found.interval("alpha", level)
    with pytest.raises(cs.InvalidInput, match="name"):
        found.interval("beta")


RUN = """
[[run]]
file = "slow.csv"
P_d = 0.25
Omega = 38.0
"""
HEAD = """
unknown = ["mu", "scale", "slip"]
each = ["phase", "x_r", "v_r", "v_c"]
"""


@pytest.fixture
def folder(tmp_path):
    data = video("slow", seconds=1.0).data
    rows = ["".join(("t,x_m,x_c",))]
    rows += [
        ",".join("" if math.isnan(v) else repr(float(v)) for v in row)
        for row in zip(*data.values(), strict=True)
    ]
    (tmp_path / "slow.csv").write_text("\n".join(rows))
    (tmp_path / "rig.toml").write_text(HEAD + RUN)
    lines = [f"{name} = {value!r}" for name, value in DEVICE.replace(mu=0.28).to_dict().items()]
    (tmp_path / "device.toml").write_text("\n".join(lines))
    return tmp_path


def test_the_command_fits_a_rig_of_a_file(call, folder) -> None:
    words = ("fit", "rig.toml", "--params", "device.toml", "--loss", "cauchy")
    status, out, err = call(*words, "--json", "--out", "found")
    assert (status, err) == (0, ["wrote found/fit.json, found/fit.csv, found/fit.svg"])
    record = json.loads(out)
    assert record["values"]["mu"] == pytest.approx(
        DEVICE.mu, abs=4 * record["standard_errors"]["mu"]
    )
    assert record["runs"][0]["name"] == "slow"
    assert (
        (folder / "found" / "fit.csv").read_text().startswith("run,t,column,value,residual\nslow,")
    )
    status, out, _ = call(*words)
    assert status == 0
    assert "slow.phase" in out
    status, out, err = call(*words, "--unknown", "mu")
    assert (status, err[-1].split(":")[0]) == (2, "error")


BAD = {
    "no drive": (HEAD + RUN.replace("P_d = 0.25", ""), "slow: P_d"),
    "no run": (HEAD, "run"),
    "no file": (HEAD + RUN.replace("slow.csv", "none.csv"), "none.csv: file"),
    "no name of a file": (HEAD + RUN.replace('"slow.csv"', "3"), "file"),
    "a key": ("fps = 120\n" + HEAD + RUN, "key"),
    "a parameter of a run": (HEAD + RUN + "speed = 3.0\n", "slow: parameter"),
    "an unknown of two": (HEAD.replace('"mu"', '"mu", "phase"') + RUN, "unknown"),
    "another unknown": (HEAD.replace('"mu"', '"nu"') + RUN, "unknown"),
    "names": (HEAD.replace('["mu", "scale", "slip"]', '"mu"') + RUN, "unknown"),
    "given and unknown": (HEAD.replace('"mu"', '"P_d"') + RUN, "slow: P_d"),
    "two of one name": (HEAD + RUN + RUN, "name"),
    "a scale of 0": ("scale = 0\n" + HEAD + RUN, "scale"),
    "bounds": (HEAD + "[bounds]\nmu = [0.3]\n" + RUN, "bounds of mu"),
    "bounds of another": (HEAD + "[bounds]\nc = [0.1, 0.3]\n" + RUN, "bounds"),
    "a state": (HEAD + RUN + "state = [0, 0]\n", "state"),
    "a state of one": (HEAD + RUN + "state = 3\n", "state"),
    "a phase in words": (HEAD + RUN + 'phase = "late"\n', "phase"),
    "a slip in words": ("slip = true\n" + HEAD + RUN, "slip"),
    "a slip beyond all": ("slip = -2\n" + HEAD + RUN, "slip"),
    "a drive in words": (HEAD + RUN.replace("0.25", "'large'"), "drive"),
    "a drive below 0": (HEAD + RUN.replace("0.25", "-1"), "slow: P_d"),
    "a name in numbers": (HEAD + RUN + "name = 3\n", "name"),
    "no table of runs": ("run = 3\n" + HEAD, "run"),
    "bounds that go down": (HEAD + "[bounds]\nmu = [0.5, 0.3]\n" + RUN, "bounds of mu"),
    "no TOML": ("unknown = [", "file"),
    "a drift of all": (HEAD.replace('"mu"', '"drift"') + RUN, "unknown"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_rig_is_named_in_one_line(name, call, folder) -> None:
    text, field = BAD[name]
    (folder / "rig.toml").write_text(text)
    status, out, err = call("fit", "rig.toml", "--params", "device.toml")
    assert (status, out, len(err)) == (2, "", 1)
    assert err[0].startswith(f"error: {field} = ")


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("t,x_m,x_c\n0,1,2\n0.1,1\n", "slow.csv: row 3"),
        ("t,x_m,x_c\n0,1,2\n0.1,2,3\n0.1,3,4\n", "slow.csv: t in row 4"),
        ("t,x_m,y\n0,1,2\n0.1,2,3\n", "slow.csv: column"),
        ("x_m,x_c\n0,1\n0.1,2\n", "slow.csv: columns"),
        ("t\n0\n0.1\n", "slow.csv: columns"),
        ("t,x_m\n0,1\n0.1,2\n", "data"),
    ],
)
def test_a_bad_file_of_a_rig_is_named_in_one_line(text, field, call, folder) -> None:
    (folder / "slow.csv").write_text(text)
    status, out, err = call("fit", "rig.toml", "--params", "device.toml")
    assert (status, out, len(err)) == (2, "", 1)
    assert err[0].startswith(f"error: {field} = ")


def test_columns_of_different_lengths_are_named() -> None:
    run = video("slow")
    run.data["x_c"] = run.data["x_c"][:-1]
    with pytest.raises(cs.InvalidInput, match="slow: x_c = "):
        cs.fit_rig(rig([run]), GUESS)


@pytest.mark.long
def test_the_videos_of_the_documentation_are_made_by_their_script(tmp_path, monkeypatch) -> None:
    pages = ROOT / "docs" / "howto" / "rig"
    shutil.copy(pages / "device.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(pages / "videos.py"))
    for name in DRIVES:
        committed, made = (read_measured(place / f"{name}.csv") for place in (pages, tmp_path))
        assert list(committed) == list(made)
        for column in made:  # written with two digits
            assert committed[column] == pytest.approx(made[column], abs=0.011, nan_ok=True)


def test_a_rig_is_read_as_it_stands(folder) -> None:
    text = "scale = 8000\nslip = 0.001\n" + HEAD + "[bounds]\nmu = [0.1, 0.5]\n" + RUN
    (folder / "rig.toml").write_text(text + 'name = "first"\nstate = [0, 0, 0]\nphase = 0.1\n')
    found = read_rig(folder / "rig.toml")
    assert (found.scale, found.slip, found.bounds) == (8000, 0.001, {"mu": [0.1, 0.5]})
    (run,) = found.runs
    assert (run.name, run.drive) == ("first", {"P_d": 0.25, "Omega": 38.0})
    assert (run.state, run.phase) == ([0, 0, 0], 0.1)


@pytest.mark.parametrize("name", ["slope", "prototype", "reaction", "reaction_pulse"])
def test_rigs_of_every_scene_are_fitted(name) -> None:
    scene = getattr(cs.scenes, name)
    p = scene.Parameters(alpha=1.3, zeta=0.06)
    run = cs.simulate(p, (0.1, 0.2, 0.3), 0.4, periods=10)
    times = np.linspace(0.0, 8 * p.period, 200)
    x_r, _, _, x_c = run(0.4 + 1.001 * times, position=True).T
    data = {"t": times, "x_m": 3.0 * (x_r + x_c) + 5.0, "x_c": 3.0 * x_c}
    one = RigRun("one", data, {"alpha": 1.3, "omega": p.omega}, (0.12, 0.2, 0.3), 0.45)
    each = ("phase", "x_r")
    found = cs.fit_rig(Rig([one], ("zeta", "gamma", "slip", "scale"), each), p.replace(zeta=0.05))
    assert found.success
    truth = {"zeta": 0.06, "gamma": p.gamma, "slip": 1e-3, "scale": 3.0, "one.phase": 0.4}
    for key, value in truth.items():
        assert found.values[key] == pytest.approx(value, abs=1e-7), key
