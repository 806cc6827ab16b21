"""Runs in threads give what they give one by one; mpmath's precision stays the user's."""

import subprocess
import sys

import mpmath
import pytest

from capsule_sym import Parameters, simulate

# Swings that all but touch the stop, in threads that change hands very often, while another thread
# does as it likes with mpmath's precision. Results are compared with those of serial runs.
_SCRIPT = """
import sys
backend = sys.argv[1]
from concurrent.futures import ThreadPoolExecutor
from random import Random
from threading import Event, Thread
import mpmath
from capsule_sym import Parameters, simulate

def run(start):
    found = simulate(*start, 0.0, 2, backend=backend, max_segments=2)
    segments = [(s.field, s.source, s.target, s.outcome, s.end_state) for s in found.segments]
    return found.statistics.escalations, repr(segments)

def swing():  # it comes back to delta, but for a rounding
    free = Parameters(alpha=0, zeta=0, delta=random.uniform(0.1, 0.9), beta=random.uniform(1, 9))
    return free, (-free.delta * (1 + random.choice((-1, 1)) * 10 ** random.uniform(-17, -13)), 0, 0)
random = Random(7)
starts = [swing() for _ in range(int(sys.argv[2]))]
serial = [run(start) for start in starts]
settled = sum(found[0] for found in serial)

mpmath.mp.dps = 23
over = Event()
def meddle():
    while not over.wait(1e-4):
        with mpmath.workdps(8):
            mpmath.sin(1)
meddler = Thread(target=meddle)
sys.setswitchinterval(1e-5)
meddler.start()
with ThreadPoolExecutor(8) as pool:
    threaded = list(pool.map(run, starts))
over.set()
meddler.join()
differ = sum(a != b for a, b in zip(serial, threaded))
assert not differ, f"{differ} of {len(starts)} runs differ in threads"
assert mpmath.mp.dps == 23, mpmath.mp.dps
print(settled)
"""


@pytest.mark.long
@pytest.mark.parametrize(("backend", "count"), [("numpy", 24), ("mpmath", 12)])
def test_threads_give_what_serial_runs_give(backend: str, count: int) -> None:
    command = [sys.executable, "-c", _SCRIPT, backend, str(count)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr[-2000:]
    assert backend == "mpmath" or int(done.stdout) > count // 2


def test_a_users_mpmath_is_neither_read_nor_changed() -> None:
    parameters = Parameters(alpha=1.3)
    right = simulate(parameters, periods=1, backend="mpmath").final
    with mpmath.workdps(7):
        found = simulate(parameters, periods=1, backend="mpmath").final
        assert mpmath.mp.dps == 7
    assert found == right


def test_numbers_keep_their_digits_whatever_mpmath_is_set_to() -> None:
    run = simulate(Parameters(alpha=1.3), periods=2, backend="mpmath")
    advance = run.advance
    with mpmath.workdps(60):
        exact = mpmath.fsum(mpmath.mpf(s.advance) for s in run.segments)
        assert abs(advance - exact) < 1e-55
