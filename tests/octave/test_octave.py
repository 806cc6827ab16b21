"""The gateways to the C library in Octave: against 50 digits, and as on the page."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp

from capsule_sym import Parameters, check_switches, inputs, simulate
from capsule_sym._parameters import scene
from paper.study.casestudy import PANELS
from tests.crosscheck import DIGITS
from tests.examples import ROOT, Page

OCTAVE = shutil.which("octave-cli")
GATEWAYS = ROOT / "matlab"
PAGE = Page(ROOT / "docs" / "howto" / "matlab.md")

pytestmark = pytest.mark.skipif(OCTAVE is None, reason="Octave is not here")


def octave(text: str, at: Path, *paths: Path) -> str:
    """Output of a script."""
    script = at / "script.m"
    script.write_text("".join(f"addpath('{path}');\n" for path in paths) + text)
    done = subprocess.run(
        [OCTAVE, "--quiet", "--no-gui", "--norc", script],
        cwd=at,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def declared(scene_name: str = "capsule", **given: float) -> str:
    """Statement that assigns a scene's parameters to p."""
    values = scene(scene_name).facts.DEFAULTS | given
    fields = ", ".join(f"'{name}', {value!r}" for name, value in values.items())
    return f"p = struct({fields});\n"


@pytest.mark.long
def test_every_function_has_a_help_text(tmp_path: Path) -> None:
    names = sorted(path.stem for path in GATEWAYS.glob("*.m"))
    assert sorted(re.findall(r"^\| `(\w+)` \|", PAGE.text, re.M)) == names
    for name in names:
        text = octave(f"disp(get_help_text('{name}'))", tmp_path, GATEWAYS)
        assert text.split()[0] == name.upper()
        assert len(text.splitlines()) > 4


@pytest.mark.long
def test_a_run_against_50_digits(gateways: Path, tmp_path: Path) -> None:
    p, periods, times = Parameters(alpha=1.2), 12, [0.5, 17.0, 61.25, 90.0]
    script = f"{declared(alpha=1.2)}r = capsule_simulate(p, {periods}, [0.1 0 0], 0.25, {times});\n"
    script += "printf('%s\\n', r.status); printf('%d ', r.segments.field); printf('\\n');\n"
    script += "printf('%.17g ', r.segments.duration, r.y(:, 1:3).', r.final);\n"
    status, fields, numbers = octave(script, tmp_path, gateways / "matlab").splitlines()
    with mp.workdps(DIGITS):
        run = simulate(p, (0.1, 0.0, 0.0), phase=0.25, periods=periods, backend="mpmath")
        durations = [float(segment.duration) for segment in run.segments]
        states = np.asarray(run(times), float).ravel()
        final = [float(value) for value in run.final[1]]
    assert status == "done"
    assert [int(word) for word in fields.split()] == [int(s.field) for s in run.segments]
    found = [float(word) for word in numbers.split()]
    assert found[:-1] == pytest.approx([*durations, *states, *final], abs=1e-11)


@pytest.mark.long
def test_many_runs_are_as_alone(gateways: Path, tmp_path: Path) -> None:
    script = """
P = repmat([0 0.8 0.02 0.05 1.5 3.3 1], 9, 1); P(:, 1) = (1:9)/5;
states = repmat([0.1 -0.2 0.3], 9, 1); phases = (0:8).'/2;
[y, status] = capsule_many(P, 25, states, phases);
names = {'alpha', 'omega', 'delta', 'zeta', 'beta', 'gamma', 'f_b'};
worst = max(status);
for k = 1:9
    r = capsule_simulate(cell2struct(num2cell(P(k, :)), names, 2), 25, states(k, :), phases(k));
    worst = max([worst, abs(r.final - y(k, :))]);
end
printf('%g', worst);
"""
    assert float(octave(script, tmp_path, gateways / "matlab")) < 1e-9


@pytest.mark.long
@pytest.mark.parametrize(
    ("call", "message"),
    [
        ("capsule_simulate(setfield(p, 'gamma', 0), 3)", "gamma = 0: must be finite and greater"),
        ("capsule_simulate(rmfield(p, 'beta'), 3)", "p.beta is missing"),
        ("capsule_simulate(p, 2.5)", "periods = 2.5: must be a whole number"),
        ("capsule_simulate(p, 2, [0 0])", "state has the wrong size"),
        ("capsule_simulate(p, 2, [0 0 0], 9)", "phase = 9: must be from 0 to 7.85398"),
        ("capsule_many(ones(2, 6), 3)", "P has the wrong size"),
        ("capsule_many(ones(2, 7), 3, zeros(2, 3), [0; 7])", "phases(2) = 7: must be in"),
    ],
)
def test_bad_input_is_told_in_one_line(gateways: Path, tmp_path: Path, call, message) -> None:
    script = f"{declared()}try, {call}; catch e, disp(e.message), end"
    told = octave(script, tmp_path, gateways / "matlab")
    assert message in told
    assert len(told.splitlines()) == 1


@pytest.mark.long
def test_the_page_is_run(gateways: Path, tmp_path: Path) -> None:
    figure, other = PAGE.blocks("matlab")
    assert len(figure.splitlines()) == 20
    if "gnuplot" not in octave("disp(available_graphics_toolkits())", tmp_path):
        pytest.skip("Octave has nothing to draw with: gnuplot")
    assert octave(other, gateways).split() == PAGE.blocks("text")[0].split()
    # Lines are counted by what is drawn: a curve a segment of four periods, each in its colour.
    script = f"{figure}\nprintf('%d ', arrayfun(@(a) numel(get(a, 'children')), "
    script += "findobj(gcf, 'type', 'axes')))"
    drawn = [int(word) for word in octave(script, gateways).split() if word.isdigit()][-16:]
    assert (gateways / "fig7.svg").stat().st_size > 10_000
    expected = []
    for alpha in PANELS.values():
        segments = simulate(Parameters(alpha=alpha), periods=304).segments
        expected.append(sum(segment.start.period >= 300 for segment in segments) + 1)
    assert sorted(drawn) == sorted(expected)


@pytest.mark.long
def test_the_switches_of_ode45_are_those_of_the_map_within_its_event_search(tmp_path: Path) -> None:
    # Octave puts an event on a straight line between the ends of a step.
    octave("switches_ode45(1e-11, 3);\n", tmp_path, ROOT / "docs" / "howto" / "check")
    read = inputs.read_switches(tmp_path / "switches.csv")
    found = check_switches(
        read.times, read.events, Parameters(alpha=0.7), end=read.settings["end"][0]
    )
    assert found.success
    assert 1e-6 < np.nanmax(abs(found.errors)) < 1e-2


SCENE = r"""
times = [0.5 17 61.25 90];
r = capsule_simulate(p, 12, [0.1 0 0.2], 0.25, times);
printf('%s\n', r.status); printf('%d ', r.segments.field, r.segments.target); printf('\n');
printf('%.17g ', r.segments.duration, r.y(:, 1:3).', r.final); printf('\n');
P = repmat(cell2mat(struct2cell(p)).', 9, 1); P(:, 1) = (1:9)/2;
states = repmat([0.1 -0.2 0.3], 9, 1); phases = (0:8).';
[y, status] = capsule_many(P, 25, states, phases);
worst = max(status);
for k = 1:9
    p.alpha = P(k, 1);
    r = capsule_simulate(p, 25, states(k, :), phases(k));
    worst = max([worst, abs(r.final - y(k, :))]);
end
printf('%g\n', worst);
for wrong = {setfield(p, 'D', 1), setfield(setfield(p, 'delta_1', 0), 'delta_2', 0), struct()}
    try, capsule_simulate(wrong{1}, 3); catch e, disp(e.message), end
end
"""


@pytest.mark.long
def test_gateways_of_a_scene(gateways: Path, tmp_path: Path) -> None:
    script, path = declared("prototype", alpha=4.0, D=0.2) + SCENE, "build/matlab/prototype"
    status, itinerary, numbers, worst, *refused = octave(
        script, tmp_path, gateways / path
    ).splitlines()
    p = scene("prototype").Parameters(alpha=4, D=0.2)
    with mp.workdps(DIGITS):
        run = simulate(p, (0.1, 0.0, 0.2), phase=0.25, periods=12, backend="mpmath")
        durations = [float(segment.duration) for segment in run.segments]
        states = np.asarray(run([0.5, 17, 61.25, 90]), float).ravel()
        final = [float(value) for value in run.final[1]]
    assert status == "done"
    passed = [
        *(s.field for s in run.segments),
        *(int((s.target or "Σ0")[1:]) for s in run.segments),
    ]
    assert list(map(int, itinerary.split())) == passed
    found = list(map(float, numbers.split()))
    assert found[:-1] == pytest.approx([*durations, *states, *final], abs=1e-10)
    assert float(worst) < 1e-9
    assert refused == [
        "capsule_simulate: D = 1: must be finite and below 1",
        "capsule_simulate: the sum of both gaps = 0: must be finite and greater than 0",
        "capsule_simulate: p.alpha is missing",
    ]
