"""The functions for MATLAB of every scene, in Octave: beside 50 digits, and as matrices."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

from capsule_sym import simulate
from capsule_sym._parameters import scene
from tests.crosscheck.test_kernels_scenes import BOUND, DIGITS, Case, cases, largest
from tests.octave.test_octave import octave
from tests.sampling import sampled, some
from tests.scenes import SCENES, UNIT

pytestmark = pytest.mark.skipif(shutil.which("octave-cli") is None, reason="Octave is not here")

ROOT = Path(__file__).parents[2]
RUN = """
names = {%(names)s};
f = fopen('given', 'r'); given = fread(f, [%(count)d, Inf], 'double'); fclose(f);
f = fopen('found', 'w');
for one = given
    p = cell2struct(num2cell(one(7:end)), names);
    c = capsule_constants(one(1), p);
    s = capsule_start(c, one(2), one(3), one(4), one(5));
    [values, rows] = capsule_flow(c, s, one(6));
    [A, G] = capsule_field(one(1), p);
    fwrite(f, [s.gap, s.margin, s.cos_theta, s.sin_theta], 'double');
    fwrite(f, [numel(values), values, reshape(rows.', 1, [])], 'double');
    fwrite(f, [size(G), reshape(A.', 1, []), reshape(G.', 1, [])], 'double');
end
fclose(f);
try, capsule_constants(%(fields)d + 1, p); catch e, disp(e.message), end
try, capsule_field(0, p); catch e, disp(e.message), end
"""


class Found:
    """Numbers that a script wrote, read in their order."""

    def __init__(self, path: Path) -> None:
        self.numbers, self.at = np.fromfile(path), 0

    def next(self, *shape: int) -> np.ndarray:
        """So many more."""
        count = int(np.prod(shape))
        self.at += count
        return self.numbers[self.at - count : self.at].reshape(shape)


def judged(case: Case, found: Found, columns: int, kernels: object, *, pulsed: bool) -> None:
    """One case: its start, flow and Jacobian by the kernels in 50 digits, and its matrices."""
    with mp.workdps(DIGITS):
        c, start = case.with_(kernels)
        right = kernels.flow(c, start, case.duration, advance=True)
        rows = np.array(kernels.jacobian(c, start, case.duration)).astype(float)
        matrix, pull, y = case.rows()
        scale = float(largest(case)) * (1 + float(case.duration))
        rate = np.array(matrix.tolist()).astype(float)
    expected = [start.gap, start.margin, start.cos_theta, start.sin_theta]
    assert found.next(4) == pytest.approx(list(map(float, expected)), abs=1e-14)
    (count,) = map(int, found.next(1))
    assert found.next(count) == pytest.approx(list(map(float, right)), abs=BOUND * UNIT * scale)
    limit = BOUND * UNIT * (scale + np.abs(rows).max()) * (1 + float(case.duration)) ** 2
    assert np.abs(found.next(count, columns) - rows).max() < limit
    guards, size = map(int, found.next(2))
    kept = [0, 1, 2, 6] if pulsed else [0, 1, 2, 4, 5, 6]
    assert size == len(kept)
    assert found.next(size, size)[: size - 1] == pytest.approx(
        rate[np.ix_(kept, kept)][: size - 1], rel=1e-14, abs=1e-15
    )
    state, p = np.array(y).astype(float)[kept], case.general()
    _, contact, way = case.field.mode
    expected = [state[0] - p["delta_1"]] if contact == 1 else []
    expected += [] if contact else [p["delta_1"] - state[0]]
    if case.field.form.stops == 2 and contact != 1:
        expected.append((1 if contact == 0 else -1) * (state[0] + p["delta_2"]))
    force = float(mp.fdot(pull, y))
    expected += [way * state[2]] if way else [p["f_plus"] - force, p["f_minus"] + force]
    assert found.next(guards, size) @ state == pytest.approx(list(map(float, expected)), abs=1e-13)


@sampled
@pytest.mark.parametrize("name", SCENES)
def test_functions_of_a_scene(name: str, tmp_path: Path) -> None:
    given = scene(name)
    names, kernels = given.facts.PARAMETERS, given.exact_kernels
    batch = [one for kind in ("weak", "strong", "critical") for one in cases(name, kind, 2)]
    batch = some(batch, 40)
    rows = [
        [one.field.index, *one.state, one.theta, one.duration, *(one.parameters[n] for n in names)]
        for one in batch
    ]
    np.array(rows, float).tofile(tmp_path / "given")
    fields = len(list(cases(name, "weak", 1)))
    quoted = ", ".join(f"'{n}'" for n in names)
    script = RUN % {"names": quoted, "count": 6 + len(names), "fields": fields}
    said = octave(script, tmp_path, ROOT / "generated" / name / "m")
    assert said.splitlines() == [f"field must be 1 to {fields}"] * 2
    found, form = Found(tmp_path / "found"), SCENES[name]
    for one in batch:
        exact = one._replace(duration=mpf(float(one.duration)))
        judged(exact, found, len(kernels.JACOBIAN_COLUMNS), kernels, pulsed=form.pulsed)
    assert found.at == len(found.numbers)


@sampled
@pytest.mark.parametrize("name", SCENES)
def test_parameters_of_a_scene(name: str, tmp_path: Path) -> None:
    facts = scene(name).facts
    script = "p = capsule_parameters();\nprintf('%s\\n', fieldnames(p){:});\n"
    script += "printf('%.17g\\n', struct2cell(p){:});"
    found = octave(script, tmp_path, ROOT / "generated" / name / "m").split()
    count = len(facts.PARAMETERS)
    assert tuple(found[:count]) == facts.PARAMETERS
    assert [float(one) for one in found[count:]] == [facts.DEFAULTS[n] for n in facts.PARAMETERS]


GATEWAYS = r"""
p = capsule_parameters(); p.alpha = 4; p.D = 0.2;
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
    paths = gateways / "build" / "matlab" / "prototype", ROOT / "generated" / "prototype" / "m"
    status, itinerary, numbers, worst, *refused = octave(GATEWAYS, tmp_path, *paths).splitlines()
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
