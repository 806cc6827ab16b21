"""The functions for MATLAB of every scene, in Octave: beside 50 digits, and as matrices."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

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
