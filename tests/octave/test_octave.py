"""The functions for MATLAB and the gateways, in Octave: against 50 digits, and as on the page."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf
from numpy.typing import NDArray

from capsule_sym import Parameters, check_switches, read_switches, simulate
from capsule_sym.generated.capsule.mp import kernels as exact
from capsule_sym.generated.capsule.py import kernels as double
from paper.study.casestudy import PANELS
from tests.crosscheck import DIGITS, Case
from tests.crosscheck.test_kernels_backends import (
    BOUND,
    FLOWS,
    JACOBIANS,
    Rows,
    worst_flow,
    worst_jacobian,
)
from tests.examples import ROOT, Page
from tests.sampling import sampled, some

OCTAVE = shutil.which("octave-cli")
GENERATED, GATEWAYS = ROOT / "generated" / "capsule" / "m", ROOT / "matlab"
PAGE = Page(ROOT / "docs" / "howto" / "matlab.md")
NAMES = ("alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b")

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


RUN = """
f = fopen('given', 'r'); given = fread(f, [16, Inf], 'double'); fclose(f);
f = fopen('found', 'w');
for one = given
    p = cell2struct(num2cell(one(2:8)), {'alpha','omega','delta','zeta','beta','gamma','f_b'});
    c = capsule_constants(one(1), p);
    start = struct('x_r', one(9), 'gap', one(10), 'v_r', one(11), 'v_c', one(12), ...
        'margin', one(13), 'cos_theta', one(14), 'sin_theta', one(15));
    [values, rows] = capsule_flow(c, start, one(16));
    fwrite(f, [numel(values), values, reshape(rows.', 1, [])], 'double');
end
fclose(f);
"""


def evaluated(batch: list[Case], at: Path, functions: Path) -> list[tuple[Rows, Rows]]:
    """Values and Jacobians of cases by `capsule_flow`, passed on to the last bit."""
    given = [
        (c.field, *c.parameters.__getstate__(), *c.start(double, float), c.duration) for c in batch
    ]
    np.array(given, float).tofile(at / "given")
    octave(RUN, at, functions)
    found = np.fromfile(at / "found").tolist()
    results = []
    while found:
        count = int(found[0])
        values, flat = found[1 : count + 1], found[count + 1 : 13 * count + 1]
        results.append((values, [flat[i : i + 12] for i in range(0, 12 * count, 12)]))
        del found[: 13 * count + 1]
    return results


@sampled
def test_flows_against_50_digits(tmp_path: Path) -> None:
    units, case = worst_flow(
        lambda batch: [values for values, _ in evaluated(batch, tmp_path, GENERATED)],
        some(FLOWS, 80),
    )
    assert units < BOUND, case


@pytest.mark.long
def test_jacobians_against_50_digits(tmp_path: Path) -> None:
    units, entry, case = worst_jacobian(
        lambda batch: [rows for _, rows in evaluated(batch, tmp_path, GENERATED)], JACOBIANS
    )
    assert units < BOUND, (entry, case)


@pytest.mark.long
def test_a_wrong_constant_is_seen(tmp_path: Path) -> None:
    changed = Path(shutil.copytree(GENERATED, tmp_path / "changed"))
    file = changed / "capsule_constants.m"
    file.write_text(file.read_text().replace("c.rate = ", "c.m = c.m*(1 + 1e-13);\nc.rate = "))
    units, _ = worst_flow(
        lambda batch: [values for values, _ in evaluated(batch, tmp_path, changed)], FLOWS
    )
    assert units > 10 * BOUND


def test_a_field_has_the_rates_of_its_flow_and_the_guards_of_its_cell(tmp_path: Path) -> None:
    p = Parameters(alpha=1.2)
    parameters = ", ".join(f"'{n}', {v!r}" for n, v in zip(NAMES, p.__getstate__(), strict=True))
    script = f"p = struct({parameters});\n"
    for field in range(1, 7):
        script += f"[A, G] = capsule_field({field}, p);\n"
        script += "printf('%d\\n', rows(G)); printf('%.17g\\n', A.', G.');\n"
    found = list(map(float, octave(script, tmp_path, GENERATED).split()))
    matrices: dict[int, tuple[NDArray[np.float64], NDArray[np.float64]]] = {}
    for field in range(1, 7):
        count = 36 + 6 * int(found[0])
        numbers, found = np.array(found[1 : count + 1]), found[count + 1 :]
        matrices[field] = numbers[:36].reshape(6, 6), numbers[36:].reshape(-1, 6)

    def extended(state: tuple[float, ...], angle: float) -> NDArray[np.float64]:
        return np.array([*state, p.alpha * np.cos(angle), p.alpha * np.sin(angle), 1.0])

    for field, (rates, _) in matrices.items():
        state, angle = (0.3, -0.4, 0.2 if field not in (2, 5) else 0.0), 1.0
        case = Case(p, field, state, angle, 0.0)
        with mp.workdps(DIGITS):
            slopes = exact.jacobian(case.constants(exact, mpf), case.start(exact, mpf), mpf(0))
        by_h = [float(row[exact.JACOBIAN_COLUMNS.index("h")]) for row in slopes[:3]]
        assert (rates @ extended(state, angle))[: len(by_h)] == pytest.approx(by_h, abs=1e-14)

    seen = set()
    for segment in simulate(p, periods=20).segments[:-1]:
        guards = matrices[segment.field][1]
        ends = guards @ extended(segment.end_state, p.omega * segment.end.phase)
        assert np.abs(ends).min() < 1e-12
        assert ends.min() > -1e-12
        seen.add(segment.field)
    assert len(seen) > 3


@pytest.mark.long
def test_every_function_has_a_help_text(tmp_path: Path) -> None:
    names = sorted({path.stem for folder in (GENERATED, GATEWAYS) for path in folder.glob("*.m")})
    listed = re.findall(r"^\| `(\w+)` \|", PAGE.text, re.M)
    assert sorted(listed) == names
    for folder in (GENERATED, GATEWAYS):
        for path in folder.glob("*.m"):
            text = octave(f"disp(get_help_text('{path.stem}'))", tmp_path, folder)
            assert text.split()[0] == path.stem.upper()
            assert len(text.splitlines()) > 4


@pytest.mark.long
def test_a_run_against_50_digits(gateways: Path, tmp_path: Path) -> None:
    p, periods, times = Parameters(alpha=1.2), 12, [0.5, 17.0, 61.25, 90.0]
    script = "p = struct('alpha', 1.2, 'omega', 0.8, 'delta', 0.02, 'zeta', 0.05, ...\n"
    script += "  'beta', 1.5, 'gamma', 3.3, 'f_b', 1);\n"
    script += f"r = capsule_simulate(p, {periods}, [0.1 0 0], 0.25, {times});\n"
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
        ("capsule_field(7, p)", "field must be 1 to 6"),
    ],
)
def test_bad_input_is_told_in_one_line(gateways: Path, tmp_path: Path, call, message) -> None:
    script = "p = struct('alpha', 0.7, 'omega', 0.8, 'delta', 0.02, 'zeta', 0.05, ...\n"
    script += "  'beta', 1.5, 'gamma', 3.3, 'f_b', 1);\n"
    script += f"try, {call}; catch e, disp(e.message), end"
    told = octave(script, tmp_path, gateways / "matlab", GENERATED)
    assert message in told
    assert len(told.splitlines()) == 1


@pytest.mark.long
def test_the_page_is_run(gateways: Path, tmp_path: Path) -> None:
    figure, flow, other = PAGE.blocks("matlab")
    assert len(figure.splitlines()) == 20
    values = octave(flow, gateways).split()
    with mp.workdps(DIGITS):
        p = Parameters()
        case = Case(p, 1, (-0.5, 0.2, 0.1), 1.0, 0.3)
        c, start = case.constants(exact, mpf), case.start(exact, mpf)
        truth = [exact.flow(c, start, mpf(0.3))[1], exact.jacobian(c, start, mpf(0.3))[1][5]]
    assert [float(value) for value in values] == pytest.approx([float(t) for t in truth], abs=2e-12)
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
    read = read_switches(tmp_path / "switches.csv")
    found = check_switches(
        read.times, read.events, Parameters(alpha=0.7), end=read.settings["end"][0]
    )
    assert found.success
    assert 1e-6 < np.nanmax(abs(found.errors)) < 1e-2
